// The WebSocket to the program. Message: u32 length of the JSON header, header, arrays that it names (docs/viewer.md).
const TYPES = { f32: Float32Array, u32: Uint32Array, u8: Uint8Array };

export function decode(buffer) {
  const length = new DataView(buffer).getUint32(0, true);
  const message = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 4, length)));
  const arrays = {};
  let offset = 4 + length;
  for (const [name, type, count] of message.arrays ?? []) {
    arrays[name] = new TYPES[type](buffer, offset, count);
    offset += Math.ceil((count * TYPES[type].BYTES_PER_ELEMENT) / 4) * 4;
  }
  message.arrays = arrays;
  return message;
}

// What stands behind # is not sent with the page's own request.
export const tokenOf = (hash) => new URLSearchParams(hash.replace(/^#/, "")).get("token") ?? "";

export class Connection {
  constructor({ onMessage, onState }) {
    this.onMessage = onMessage;
    this.onState = onState;
    this.delay = 500;
    this.open();
  }

  open() {
    this.onState("connecting");
    const token = tokenOf(location.hash);
    const protocols = token ? ["oaslam", `oaslam.token.${token}`] : [];
    this.socket = new WebSocket(`${location.protocol === "https:" ? "wss" : "ws"}://${location.host}/ws`, protocols);
    this.socket.binaryType = "arraybuffer";
    let taken = Promise.resolve(); // one after the other: pictures take their time
    this.socket.onmessage = ({ data }) => {
      taken = taken.then(async () => {
        const message = decode(data);
        if (message.type === "hello") this.onState("open");
        this.delay = 500;
        await this.onMessage(message);
        // The next message comes when this one is taken.
        this.send({ type: "ack" });
      });
    };
    this.socket.onclose = () => {
      this.onState("closed");
      setTimeout(() => this.open(), this.delay);
      this.delay = Math.min(2 * this.delay, 8000);
    };
  }

  send(message) {
    if (this.socket.readyState === WebSocket.OPEN) this.socket.send(JSON.stringify(message));
  }
}
