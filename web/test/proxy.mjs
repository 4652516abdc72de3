// A proxy that gives a program a path of its own: requests and WebSockets below PREFIX go to the program without it.
import { createServer, request } from "node:http";

/** Resolves to the proxy's `url`, which is `http://127.0.0.1:PORT` and the prefix, the paths of `others` that it was asked for, and `close()`. @param {string} target  @param {string} prefix */
export async function proxyOf(target, prefix) {
  const others = [];
  const pass = ({ url, method, headers }) => {
    const isBelow = url === prefix || url.startsWith(`${prefix}/`) || url.startsWith(`${prefix}?`);
    if (isBelow) return request(new URL(target), { method, headers, path: url.slice(prefix.length).replace(/^\/?/, "/") });
    others.push(url);
    return null;
  };
  const proxy = createServer((asked, answer) => {
    const passed = pass(asked);
    if (!passed) return answer.writeHead(404).end();
    passed.on("response", (got) => got.pipe(answer.writeHead(got.statusCode, got.headers)));
    passed.on("error", () => answer.destroy());
    asked.pipe(passed);
  });
  proxy.on("upgrade", (asked, socket, asking) => {
    const passed = pass(asked);
    socket.on("error", () => passed?.destroy());
    if (!passed) return socket.end("HTTP/1.1 404 Not Found\r\n\r\n");
    passed.on("response", ({ statusCode }) => socket.end(`HTTP/1.1 ${statusCode} No\r\n\r\n`));
    passed.on("upgrade", (got, other, head) => {
      const fields = got.rawHeaders.flatMap((name, i, all) => (i % 2 ? [] : [`${name}: ${all[i + 1]}\r\n`]));
      socket.write(`HTTP/1.1 101 Switching Protocols\r\n${fields.join("")}\r\n`);
      other.on("error", () => socket.destroy());
      // What came with the upgrade are the first bytes of the stream.
      socket.write(head);
      other.write(asking);
      other.pipe(socket).pipe(other);
    });
    passed.on("error", () => socket.destroy());
    passed.end();
  });
  await new Promise((done) => proxy.listen(0, "127.0.0.1", done));
  const close = () => {
    proxy.close();
    proxy.closeAllConnections();
  };
  return { url: `http://127.0.0.1:${/** @type {any} */ (proxy.address()).port}${prefix}`, others, close };
}
