// The page for phones in a real browser, with a file as its camera, against a service of this test that speaks the protocol of docs/service.md.
// OASLAM_SOURCE_DIR=... node --test web/test/camera_test.mjs      Pictures go to OASLAM_SCREENSHOTS where that is set.
import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { join } from "node:path";
import { after, before, test } from "node:test";
import { cameraFile, closeAll, contentPixels, LANDSCAPE, launch, newPage, PORTRAIT, settle, shoot, skipUnlessReady } from "./phone.mjs";

skipUnlessReady();
const ROOT = process.env.OASLAM_SOURCE_DIR;
const PAGE = readFileSync(join(ROOT, "web", "dist", "camera.html"));
const MODULE = readFileSync(join(ROOT, "web", "dist", "oaslam_odometry.wasm"));
const POLICY = "default-src 'none'; script-src 'unsafe-inline' 'wasm-unsafe-eval'; worker-src blob:; style-src 'unsafe-inline'; img-src blob: data:; media-src blob:; connect-src 'self' blob: data:; base-uri 'none'; form-action 'none'; frame-ancestors 'none'";
const CAMERA = { model: "pinhole", width: 640, height: 480, fx: 500, fy: 520, cx: 300, cy: 260, distortion: [0, 0, 0, 0, 0] };
// A millimetre and half a milliradian.
const COVARIANCE = Array.from({ length: 36 }, (_, i) => (i % 7 ? 0 : i < 21 ? 1e-6 : 2.5e-7));
const STILL = { position: [0, 0, 0], rotation: [0, 0, 0, 1] };
const UPRIGHT = [1, 0, 0, 0]; // y up, while that of the camera points down

let browser, walking; // with a camera that stands, and with one that moves
before(async () => {
  walking = await launch(cameraFile("walking", join(ROOT, "data", "sample", "map_front", "video.mp4")));
  browser = await launch(cameraFile("still", join(ROOT, "data", "sample", "map_front", "video.mp4"), 40, 41));
});
after(closeAll);

// A service with two maps. `answer` makes the answer to an image from its header; null: none.
class Service {
  constructor({ anchors = [], objects = [], mayWrite = true, token = "" } = {}) {
    Object.assign(this, { anchors, objects, mayWrite, token, isUp: true, images: [], edits: [], sockets: [], requests: [] });
    this.maps = ["desk", "hall"];
    this.answer = () => this.pose(STILL);
  }

  pose(pose, more = {}) {
    return { type: "pose", state: pose ? "tracking" : "lost", ...(pose ? { pose, covariance: COVARIANCE } : {}), confidence: 0.95, camera: CAMERA, depth: 1.5, dropped: 0, ms: 5, ...more };
  }

  hello(map, more = {}) {
    const models = ["flag", "robot"].map((name) => ({ name, url: `/models/${name}/${name}.glb` }));
    return { type: "hello", protocol: 1, map, digest: "d", may_write: this.mayWrite, models, anchors: this.anchors, objects: this.objects, up: [0, -1, 0], is_metric: true, ...more };
  }

  // `prefix`: of its paths, as a proxy gives one.
  async serve(page, origin = "http://localhost:8350", prefix = "") {
    this.origin = origin;
    this.prefix = prefix;
    await page.route("**/*", (route) => {
      const url = new URL(route.request().url());
      if (/^(blob|data):/.test(url.protocol)) return route.continue();
      this.requests.push(url.pathname);
      assert.ok(url.origin === origin && url.pathname.startsWith(prefix), `a request to elsewhere: ${url}`);
      url.pathname = url.pathname.slice(prefix.length);
      if (!this.isUp) return route.abort("connectionrefused");
      if (["/camera", "/"].includes(url.pathname)) return route.fulfill({ body: PAGE, contentType: "text/html", headers: { "Content-Security-Policy": POLICY } });
      if (url.pathname === "/oaslam_odometry.wasm") return route.fulfill({ body: MODULE, contentType: "application/wasm" });
      if (url.pathname.startsWith("/models/")) return route.fulfill({ status: 404, json: { error: "no such model" } });
      const isKnown = !this.token || route.request().headers().authorization === `Bearer ${this.token}`;
      if (!isKnown) return route.fulfill({ status: 401, json: { error: "a token is needed" } });
      if (url.pathname === "/v1/maps") return route.fulfill({ json: { maps: this.maps.map((name) => ({ name, digest: "d", bytes: 1, changed: 0 })) } });
      const map = decodeURIComponent(url.pathname.match(/^\/v1\/maps\/([^/]+)$/)?.[1] ?? "");
      if (this.maps.includes(map)) return route.fulfill({ json: { name: map } });
      return route.fulfill({ status: 404, json: { error: `no map ${map}` } });
    });
    await page.routeWebSocket(/\/v1\/maps\//, (socket) => this.connect(socket));
    return page;
  }

  connect(socket) {
    const { pathname } = new URL(socket.url());
    assert.ok(pathname.startsWith(this.prefix));
    const [, map, kind] = pathname.slice(this.prefix.length).match(/^\/v1\/maps\/([^/]+)\/(track|record)$/);
    const isKnown = !this.token || socket.protocols().includes(`oaslam.token.${this.token}`);
    if (!this.isUp || !isKnown || (kind === "track" && !this.maps.includes(decodeURIComponent(map)))) return socket.close({ code: 1011 });
    assert.equal(socket.protocols()[0], "oaslam");
    this.sockets.push(socket);
    socket.say = (message) => socket.send(JSON.stringify(message));
    socket.kind = kind;
    socket.onMessage((data) => {
      if (typeof data === "string") return this.edit(socket, JSON.parse(data));
      const length = data.readUInt32LE(0);
      const header = JSON.parse(data.subarray(4, 4 + length).toString());
      const body = data.subarray(4 + length);
      if (header.features) assert.equal(body.length, 45 * header.features.count);
      else assert.ok(body[0] === 0xff && body[1] === 0xd8, "not a JPEG");
      this.images.push({ ...header, at: performance.now(), bytes: body.length });
      const answer = this.answer(header, socket);
      if (answer) setTimeout(() => socket.say({ id: header.id, time: header.time, ...answer }), this.slow ?? 20);
    });
    socket.say(this.hello(decodeURIComponent(map), kind === "record" ? { anchors: undefined, objects: undefined } : {}));
  }

  edit(socket, message) {
    this.edits.push(message);
    this.onEdit?.(message, socket);
  }

  tell(message) {
    for (const socket of this.sockets) socket.say(message);
  }

  drop() {
    for (const socket of this.sockets.splice(0)) socket.close({ code: 1012 });
  }
}

async function open(service, path = "/camera?map=desk", options) {
  const page = await service.serve(await newPage(browser, options));
  await page.goto(service.origin + path);
  return page;
}

async function openAndStart(service, options) {
  const page = await open(service, "/camera?map=desk", options);
  await page.locator("[data-action=start]").tap();
  await page.waitForFunction(() => window.oaslam?.session.answer);
  return page;
}

async function until(holds) {
  for (let i = 0; i < 300 && !holds(); ++i) await new Promise((done) => setTimeout(done, 50));
  assert.ok(holds(), String(holds));
}

const isShowing = (page) => page.waitForSelector("#view[data-showing=true]");
const anchorAt = (name, position, size = 0.1) => ({ name, model: "none", size, pose: { position, rotation: UPRIGHT }, version: 1 });
// Where a pixel of the image is in the window, which the image fills.
function inWindow([u, v], { width, height } = LANDSCAPE) {
  const scales = [width / 640, height / 480].sort((a, b) => a - b);
  const scale = scales[0] / scales[1] >= 0.6 ? scales[1] : scales[0];
  return { x: (width - 640 * scale) / 2 + (u + 0.5) * scale, y: (height - 480 * scale) / 2 + (v + 0.5) * scale };
}
const project = ([x, y, z]) => [(CAMERA.fx * x) / z + CAMERA.cx, (CAMERA.fy * y) / z + CAMERA.cy];

test("content stands in the picture where the pose and the lens put it, in any window", async () => {
  const service = new Service({ anchors: [anchorAt("pin", [0.1, -0.02, 1])] });
  const page = await openAndStart(service);
  await isShowing(page);
  for (const size of [LANDSCAPE, { width: 700, height: 600 }, PORTRAIT]) {
    await page.setViewportSize(size);
    await settle(page);
    await settle(page);
    const tip = inWindow(project([0.1, -0.02, 1]), size);
    const { count, lowest } = await contentPixels(page);
    assert.ok(count > 100 && Math.hypot(lowest.x - tip.x, lowest.y - tip.y) < 6, JSON.stringify({ size, count, lowest, tip }));
  }
  await page.setViewportSize(LANDSCAPE);
  assert.match(await page.locator("#state").textContent(), /in the map/);
  assert.match(await page.locator("#age").textContent(), /^place \d\.\d s old$/);
  await page.locator("[data-action=objects]").tap();
  await shoot(page, "camera_mock");
  // Where the service does not know the place, the device still follows its own motion.
  service.answer = () => service.pose(null);
  await page.waitForFunction(() => /looking for this place/.test(document.querySelector("#state").textContent));
  await page.waitForFunction(() => Number(document.querySelector("#age").textContent.match(/[\d.]+/)[0]) > 1);
  assert.equal(await page.locator("#view").getAttribute("data-showing"), "true");
  assert.equal(await page.locator("#view .labels button:visible").count(), 1);
  assert.deepEqual(page.errors, []);
  await page.context().close();
});

test("behind a proxy that gives it a path: at the page's name, or where the path itself leads to the page", async () => {
  const prefix = "/robots/7%20b";
  for (const end of ["/camera", ""]) {
    const service = new Service({ anchors: [{ ...anchorAt("pin", [0, 0, 1]), model: "flag" }] });
    const page = await newPage(browser);
    await service.serve(page, undefined, prefix);
    await page.goto(`${service.origin}${prefix}${end}?map=desk`);
    await page.locator("[data-action=start]").tap();
    await isShowing(page);
    await until(() => ["/oaslam_odometry.wasm", "/models/flag/flag.glb"].every((path) => service.requests.includes(prefix + path)));
    assert.match(page.url(), /\?map=desk$/);
    assert.deepEqual(page.errors.filter((error) => !/404/.test(error)), []);
    await page.context().close();
  }
});

test("the picture is shown without the distortion of its lens", async () => {
  const service = new Service();
  const distortion = [-0.3, 0.1, 0.01, -0.02, 0];
  service.answer = () => service.pose(STILL, { camera: { ...CAMERA, distortion } });
  const page = await openAndStart(service, { size: { width: 640, height: 480 } });
  await isShowing(page);
  // Each pixel of the ideal image shows that of the given one where OpenCV's model puts it.
  const differences = await page.evaluate(async ({ fx, fy, cx, cy, k }) => {
    const { view, source } = window.oaslam;
    view.draw();
    const read = (image) => {
      const canvas = Object.assign(document.createElement("canvas"), { width: 640, height: 480 });
      const context = canvas.getContext("2d");
      context.drawImage(image, 0, 0, 640, 480);
      return context.getImageData(0, 0, 640, 480).data;
    };
    const [shown, given] = [read(view.canvas), read(source.small.canvas)];
    const at = (data, x, y) => [0, 1, 2].map((c) => data[4 * (640 * y + x) + c]);
    const result = { mapped: 0, same: 0, n: 0 };
    for (let v = 20; v < 460; v += 7)
      for (let u = 20; u < 620; u += 7) {
        const [x, y] = [(u - cx) / fx, (v - cy) / fy];
        const r2 = x * x + y * y;
        const radial = 1 + r2 * (k[0] + r2 * (k[1] + r2 * k[4]));
        const from = [x * radial + 2 * k[2] * x * y + k[3] * (r2 + 2 * x * x), y * radial + k[2] * (r2 + 2 * y * y) + 2 * k[3] * x * y];
        const [s, t] = [Math.round(from[0] * fx + cx), Math.round(from[1] * fy + cy)];
        if (s < 0 || t < 0 || s > 639 || t > 479) continue;
        const far = (a, b) => a.reduce((sum, value, i) => sum + Math.abs(value - b[i]), 0);
        result.mapped += far(at(shown, u, v), at(given, s, t));
        result.same += far(at(shown, u, v), at(given, u, v));
        ++result.n;
      }
    return result;
  }, { ...CAMERA, k: distortion });
  assert.ok(differences.n > 3000 && differences.mapped < 0.25 * differences.same, JSON.stringify(differences));
  await page.context().close();
});

test("two images a second are sent where the place is sure, more where it is not, with the motion and what was found about the camera; none while the page is hidden", async () => {
  const service = new Service();
  service.slow = 100;
  const page = await openAndStart(service);
  await until(() => service.images.length > 5 && service.images.at(-1).motion);
  const first = service.images[0];
  assert.equal(first.camera, "auto");
  assert.ok(first.id === 1 && first.time > 0 && first.gravity === undefined && first.motion === undefined);
  const { camera, time, motion } = service.images.at(-1);
  // The service goes on looking at it, and may find a better one.
  assert.equal(camera, "auto");
  assert.deepEqual(await page.evaluate(() => window.oaslam.session.tracker.camera), CAMERA);
  const better = { ...CAMERA, fx: 503, fy: 523 };
  service.answer = () => service.pose(STILL, { camera: better });
  await page.waitForFunction(() => window.oaslam.session.tracker.camera.fx === 503);
  assert.ok(time > first.time);
  assert.ok(motion.image >= 0 && motion.preliminary && Math.abs(Math.hypot(...motion.pose.rotation) - 1) < 1e-9, JSON.stringify(motion).slice(0, 300));
  // By the page's own clock: what arrives here is late by what this machine does besides.
  const paced = await page.evaluate(async () => {
    const { pacer } = window.oaslam.session.stream;
    const images = [];
    let interval;
    const { maySend, sent } = pacer;
    pacer.maySend = (now, asked, slow) => maySend.call(pacer, now, (interval = asked), slow);
    pacer.sent = (id, now) => {
      images.push({ interval, waited: now - pacer.last });
      sent.call(pacer, id, now);
    };
    const isEnough = () => images.filter((image) => image.interval === 500).length > 3;
    for (let i = 0; i < 300 && !isEnough(); ++i) await new Promise((done) => setTimeout(done, 50));
    return images;
  });
  const whereSure = paced.filter(({ interval }) => interval === 500);
  assert.ok(whereSure.length > 3 && paced.every(({ interval, waited }) => waited >= interval), JSON.stringify(paced));
  assert.ok(service.images.every(({ time }, i) => i === 0 || time > service.images[i - 1].time));
  // Gravity, in the picture's axes: held upright.
  const feed = setInterval(() => page.evaluate(() => dispatchEvent(new DeviceOrientationEvent("deviceorientation", { alpha: 0, beta: 90, gamma: 0 }))).catch(() => null), 50);
  const n = service.images.length;
  await page.waitForFunction((ids) => window.oaslam.session.stream.ids > ids + 3, n);
  clearInterval(feed);
  const { gravity } = service.images.at(-1);
  assert.ok(Math.abs(Math.hypot(...gravity) - 9.81) < 0.01, String(gravity));
  // The browser remembers the lens.
  await page.reload();
  const before = service.images.length;
  await page.locator("[data-action=start]").tap();
  await page.waitForFunction(() => window.oaslam?.session.stream.ids > 2);
  assert.deepEqual(service.images[before].camera, better);
  // The user can have it forgotten.
  await page.locator("#bar [data-action=maps]").tap();
  await page.locator("[data-action=lens]").tap();
  const again = service.images.length;
  await page.locator("[data-map=desk]").tap();
  await until(() => service.images.length > again);
  assert.equal(service.images[again].camera, "auto");
  // A hidden page sends nothing.
  await page.evaluate(() => Object.defineProperty(document, "hidden", { configurable: true, get: () => true }));
  await page.waitForTimeout(100);
  const [hidden, sent] = [service.images.length, await page.evaluate(() => window.oaslam.session.stream.ids)];
  await page.waitForTimeout(500);
  assert.equal(service.images.length, hidden);
  await page.evaluate(() => {
    delete document.hidden;
    document.dispatchEvent(new Event("visibilitychange"));
  });
  await page.waitForFunction((ids) => window.oaslam.session.stream.ids > ids, sent);
  assert.deepEqual(page.errors, []);
  await page.context().close();
});

test("with ?share=features no picture leaves the device", async () => {
  const service = new Service({ anchors: [anchorAt("pin", [0, 0, 1])] });
  service.answer = ({ camera }) => service.pose(STILL, { camera });
  const page = await open(service, "/camera?map=desk&share=features");
  assert.match(await page.locator("#screen").textContent(), /No image leaves this device/);
  await page.locator("[data-action=start]").tap();
  await isShowing(page);
  assert.match(page.url(), /\?map=desk&share=features$/);
  assert.ok(service.images.every(({ features, camera, bytes }) => features.count > 300 && bytes === 45 * features.count && features.lowest === 1 && camera.width === 640));
  assert.deepEqual(page.errors, []);
  await page.context().close();
});

test("without a server content is placed on what the odometry sees", async () => {
  const service = new Service();
  service.isUp = false;
  const page = await newPage(walking);
  await service.serve(page);
  await page.route(/\/camera$|\.wasm$/, (route) => route.fulfill(/wasm$/.test(route.request().url()) ? { body: MODULE, contentType: "application/wasm" } : { body: PAGE, contentType: "text/html", headers: { "Content-Security-Policy": POLICY } }));
  await page.goto("http://localhost:8350/camera");
  await page.waitForSelector("[data-action=alone]");
  await shoot(page, "camera_no_server");
  await page.locator("[data-action=alone]").tap();
  await page.waitForFunction(() => document.querySelector("#state")?.textContent === "without a map");
  await page.locator("[data-action=place]").tap();
  await page.touchscreen.tap(422, 250);
  await page.waitForFunction(() => window.oaslam.state.anchors.length === 1);
  // Where it was tapped, on the surface there, and it stays in the room: not in the picture.
  const drawn = () => page.evaluate(() => ({ pixel: window.oaslam.view.pixelOf("pin 1"), image: window.oaslam.view.tracked.time, pose: window.oaslam.view.tracked.pose }));
  const at = await drawn();
  await page.waitForFunction(([x, y]) => {
    const pixel = window.oaslam.view.pixelOf("pin 1");
    return !pixel || Math.hypot(pixel.x - x, pixel.y - y) > 20;
  }, [at.pixel.x, at.pixel.y]);
  await shoot(page, "camera_alone");
  await page.locator("#anchor [data-action=larger]").tap();
  await page.locator("#anchor [data-action=remove]").tap();
  await page.waitForFunction(() => window.oaslam.state.anchors.length === 0);
  assert.deepEqual(page.errors.filter((error) => !/ERR_CONNECTION_REFUSED|Failed to load/.test(error)), []);
  await page.context().close();
});

test("a tap places content along its ray, on an object or a surface; the anchor that comes can be changed", async () => {
  const objects = [{ id: 7, category: "cup", name: "", ellipsoid: { center: [0, 0, 2], half_axes: [0.3, 0.2, 0.2], rotation: [0, 0, 0, 1] } },
    { id: 8, category: "dining table", name: "", ellipsoid: { center: [0, 0.1, 2.4], half_axes: [2, 1, 1], rotation: [0, 0, 0, 1] } }];
  const service = new Service({ objects });
  const turned = Math.PI / 6;
  service.answer = () => service.pose({ position: [-0.2, 0, 0], rotation: [0, 0, Math.sin(turned / 2), Math.cos(turned / 2)] });
  service.onEdit = (message, socket) => message.type === "place" && socket.say({ type: "anchors", version: 2, anchors: [anchorAt("flag 1", [0.1, 0.1, 2])], removed: [] });
  const page = await openAndStart(service);
  await isShowing(page);
  const tap = async (pixel) => {
    const { x, y } = inWindow(pixel);
    await page.touchscreen.tap(x, y);
  };
  // The expected ray of a pixel, for the camera that is rolled about z.
  const rayOf = ([u, v]) => {
    const [x, y] = [(u - CAMERA.cx) / CAMERA.fx, (v - CAMERA.cy) / CAMERA.fy];
    return [x * Math.cos(turned) - y * Math.sin(turned), x * Math.sin(turned) + y * Math.cos(turned), 1];
  };
  const pixel = [400, 280];
  await tap(pixel);
  assert.deepEqual(service.edits, []); // nothing is placed before Place was tapped
  await page.locator("[data-action=place]").tap();
  assert.match(await page.locator("#models p").textContent(), /Tap the place/);
  await page.locator("#models >> text=robot").tap();
  await tap(pixel);
  await page.waitForFunction(() => document.body.dataset.anchor === "flag 1"); // the new anchor is selected
  const [{ type, model, origin, direction, object }] = service.edits;
  assert.deepEqual({ type, model, object, origin }, { type: "place", model: "robot", object: undefined, origin: [-0.2, 0, 0] });
  const ray = rayOf(pixel);
  ray.forEach((value, i) => assert.ok(Math.abs(value / Math.hypot(...ray) - direction[i]) < 2e-3, `${direction}, not along ${ray}`));
  assert.ok(await page.locator("#models").isHidden());
  await shoot(page, "camera_selected");

  // On the smallest object that the ray meets.
  const [x, y] = [0.2, 0]; // of the cup, from the camera
  const middle = [CAMERA.cx + (CAMERA.fx * (x * Math.cos(turned) + y * Math.sin(turned))) / 2, CAMERA.cy + (CAMERA.fy * (y * Math.cos(turned) - x * Math.sin(turned))) / 2];
  await page.locator("[data-action=place]").tap();
  await page.locator("#models >> text=on objects").tap();
  await shoot(page, "camera_placing");
  await tap(middle);
  await until(() => service.edits.length === 2);
  assert.equal(service.edits.at(-1).object, 7);

  // The panel.
  service.edits.length = 0;
  await page.locator('#view [data-anchor="flag 1"]').tap();
  for (const action of ["larger", "larger", "left"]) await page.locator(`#anchor [data-action=${action}]`).tap();
  await until(() => service.edits.length === 3);
  assert.ok(Math.abs(service.edits[1].size - 0.1 * 1.15 ** 2) < 1e-9 && service.edits[0].name === "flag 1");
  assert.ok(Math.abs(service.edits[2].turn - Math.PI / 12) < 1e-9);
  await page.locator("#anchor input").fill("door");
  await page.locator("#anchor input").press("Enter");
  await until(() => service.edits.length === 4);
  assert.equal(service.edits[3].rename, "door");
  service.tell({ type: "anchors", version: 3, anchors: [anchorAt("door", [0.1, 0.1, 2], 0.13), anchorAt("of another", [0, 0, 2])], removed: ["flag 1"] });
  await page.waitForFunction(() => window.oaslam.state.anchors.length === 2);
  assert.equal(await page.evaluate(() => document.body.dataset.anchor), "door");
  await page.locator("#anchor [data-action=remove]").tap();
  await until(() => service.edits.length === 5);
  assert.deepEqual(service.edits[4], { type: "anchor", name: "door", remove: true });
  service.tell({ type: "anchors", version: 4, anchors: [], removed: ["door"] });
  await page.waitForFunction(() => document.body.dataset.anchor === "");
  assert.ok(await page.locator("#anchor").isHidden());
  assert.deepEqual(await page.evaluate(() => window.oaslam.state.anchors.map(({ name }) => name)), ["of another"]);
  // A refusal is shown.
  service.tell({ type: "error", message: "too few landmarks there" });
  await page.waitForFunction(() => /too few landmarks/.test(document.querySelector("#toast").textContent));
  // Another map under the same name.
  service.tell({ ...service.hello("desk"), type: "map", anchors: [anchorAt("new", [0, 0, 1])] });
  await page.waitForFunction(() => window.oaslam.state.anchors[0]?.name === "new");
  assert.deepEqual(page.errors.filter((error) => !/404/.test(error)), []);
  await page.context().close();

  const reader = new Service({ mayWrite: false, anchors: [anchorAt("pin", [0, 0, 1])] });
  const watching = await openAndStart(reader);
  await isShowing(watching);
  assert.ok(await watching.locator("[data-action=place]").isHidden());
  await watching.locator("#view [data-anchor=pin]").tap();
  assert.ok(await watching.locator("#anchor [data-action=remove]").isHidden());
  await watching.context().close();
});

test("a lost connection comes back, later each time, and says why", async () => {
  const service = new Service({ anchors: [anchorAt("pin", [0, 0, 1])] });
  const page = await openAndStart(service);
  await isShowing(page);
  service.isUp = false;
  service.drop();
  await page.waitForFunction(() => /no connection: again in \d s/.test(document.querySelector("#state").textContent));
  // The device follows its own motion: content stays, and the page tells how old its place is.
  await page.waitForFunction(() => Number(document.querySelector("#age").textContent.match(/[\d.]+/)[0]) > 1.5);
  assert.equal(await page.locator("#view").getAttribute("data-showing"), "true");
  await page.waitForFunction(() => window.oaslam.session.stream.link.delay >= 2000);
  service.isUp = true;
  await page.waitForFunction(() => document.querySelector("#state").textContent === "in the map");
  assert.equal(service.sockets.length, 1);
  assert.equal(await page.evaluate(() => window.oaslam.session.stream.link.delay), 500);
  // The map was removed while the page had no connection.
  service.maps = ["hall"];
  service.drop();
  await page.waitForFunction(() => /no map desk/.test(document.querySelector("#state").textContent));
  await page.locator("#bar [data-action=maps]").tap();
  await page.locator("[data-map=hall]").tap();
  await page.waitForURL(/map=hall/);
  await isShowing(page);
  await page.context().close();
});

test("a new map: recorded, finished, and then the map that one is in; a token that is asked for", async () => {
  const service = new Service({ token: "a-token" });
  let keyframes = 0;
  service.answer = (header, socket) => {
    if (socket.kind === "track") return service.pose(STILL);
    socket.say({ type: "progress", phase: "mapping", keyframes: ++keyframes, landmarks: 100 * keyframes, objects: 3, text: "Go on: walk around what is to be mapped." });
    return service.pose(STILL, { state: "initializing", pose: undefined });
  };
  service.onEdit = (message, socket) => {
    if (message.type !== "finish") return;
    socket.say({ type: "progress", phase: "saving", keyframes, landmarks: 100, objects: 3, text: "saving" });
    service.maps.push("my-room");
    setTimeout(() => socket.say({ type: "saved", map: "my-room", digest: "e" }), 300);
  };
  const page = await open(service, "/camera", { size: PORTRAIT });
  await page.locator("input[placeholder=token]").fill("a-token");
  await page.locator("[data-action=token]").tap();
  await page.waitForSelector("[data-map=desk]");
  await shoot(page, "camera_maps");
  const name = page.locator("input[placeholder^=name]");
  for (const [bad, hint] of [["", /slash/], ["../x", /slash/], ["desk", /already/]]) {
    await name.fill(bad);
    await page.locator("[data-action=create]").tap();
    assert.match(await page.locator("#screen").textContent(), hint);
  }
  await name.fill("my-room");
  await page.locator("[data-action=create]").tap();
  await page.waitForFunction(() => /walk around/.test(document.querySelector("#progress").textContent) && window.oaslam.session.progress.keyframes > 2);
  assert.ok(await page.locator("[data-action=place]").isHidden());
  await shoot(page, "camera_record");
  // Upright and at rest, as Chromium tells it. The headers have what was measured with the images.
  await page.evaluate(() => {
    const event = { rotationRate: { alpha: 90, beta: 0, gamma: 0 }, accelerationIncludingGravity: { x: 0, y: 9.81, z: 0 } };
    window.oaslam.shaken = setInterval(() => dispatchEvent(new DeviceMotionEvent("devicemotion", event)), 20);
  });
  await page.waitForFunction(() => window.oaslam.session.gyroscope.samples.length > 10);
  await until(() => service.images.at(-1).imu?.length > 1);
  const { imu, time, angular_velocity } = service.images.at(-1);
  assert.ok(angular_velocity === undefined && imu.every(([at]) => Math.abs(at - time) < 2));
  assert.deepEqual(imu[0].slice(1).map((x) => Math.round(100 * x) / 100 + 0), [1.57, 0, 0, 0, -9.81, 0]);
  await page.evaluate(() => clearInterval(window.oaslam.shaken));
  await page.locator("[data-action=finish]").tap();
  const sent = service.images.length;
  assert.equal(await page.locator("#state").textContent(), "saving");
  await page.waitForFunction(() => window.oaslam.session.kind === "track");
  assert.ok(service.images.length - sent <= 1);
  await isShowing(page);
  assert.match(page.url(), /\?map=my-room#token=a-token$/);
  assert.deepEqual(service.edits, [{ type: "finish" }]);
  await page.context().close();
});

test("where the browser refuses, the page says what to do", async () => {
  const service = new Service();
  const insecure = await service.serve(await newPage(browser, { size: PORTRAIT }), "http://192.0.2.7:8350");
  await insecure.goto("http://192.0.2.7:8350/camera?map=desk#token=t");
  assert.match(await insecure.locator("#screen").textContent(), /https:\/\/192\.0\.2\.7:8350\/camera\?map=desk#token=t/);
  await shoot(insecure, "camera_help");
  await insecure.context().close();
  for (const [name, text] of [["NotAllowedError", /not allowed/], ["NotFoundError", /no camera/], ["NotReadableError", /in use/]]) {
    const page = await newPage(browser, { size: PORTRAIT });
    await page.addInitScript((name) => (navigator.mediaDevices.getUserMedia = () => Promise.reject(new DOMException("no", name))), name);
    await new Service().serve(page);
    await page.goto("http://localhost:8350/camera?map=desk");
    await page.locator("[data-action=start]").tap();
    await page.waitForFunction((source) => new RegExp(source).test(document.querySelector("#screen").textContent), text.source);
    await page.context().close();
  }
});
