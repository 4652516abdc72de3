// What both pages compute, without a browser.   node --test web/test/camera_units_test.mjs
import assert from "node:assert/strict";
import { test } from "node:test";

if (!(await import("three").catch(() => null))) {
  console.log("SKIPPED: no three (npm ci in web/)");
  process.exit(0);
}
const { Quaternion, Vector3 } = await import("three");
const { AnchorEdits } = await import("../src/anchor_edits.js");
const { Link } = await import("../src/link.js");
const { packImage, samplesHeader } = await import("../src/device/framing.js");
const { forceOfMotion, gravityOfMotion, gravityOfOrientation, toPicture } = await import("../src/camera/gravity.js");
const { Gyroscope } = await import("../src/camera/gyroscope.js");
const { refusal } = await import("../src/camera/help.js");
const { KnownCameras, sentSize } = await import("../src/camera/intrinsics.js");
const { guessedCamera, rayOf, scaledCamera } = await import("../src/device/lens.js");
const { Pacer } = await import("../src/device/pacer.js");
const { surfaceAt } = await import("../src/device/surface.js");
const { Service } = await import("../src/service.js");
const { ageInWords, describe } = await import("../src/camera/words.js");

const near = (a, b, tolerance = 1e-9) => a.forEach((x, i) => assert.ok(Math.abs(x - b[i]) < tolerance, `${a}, not ${b}`));

test("an image is framed so that its header ends on a multiple of four", () => {
  for (let n = 0; n < 8; ++n) {
    const header = { type: "image", id: 7, name: "\u00e9".repeat(n) };
    const jpeg = Uint8Array.from([255, 216, n]);
    const message = packImage(header, jpeg);
    const length = new DataView(message.buffer).getUint32(0, true);
    assert.equal(length % 4, 0);
    assert.deepEqual(JSON.parse(new TextDecoder().decode(message.subarray(4, 4 + length))), header);
    assert.deepEqual([...message.subarray(4 + length)], [...jpeg]);
  }
});

test("gravity in the picture's axes, however the phone is held", () => {
  const g = 9.81;
  const held = (angle, beta, gamma, isFront) => toPicture(gravityOfOrientation(beta, gamma), angle, isFront);
  near(held(0, 90, 0), [0, g, 0]); // upright, looking at the horizon: down is y
  near(held(0, 0, 0), [0, 0, g]); // on a table, looking down
  near(held(180, -90, 0), [0, g, 0]); // upside down, and the picture with it
  near(held(90, 0, -90), [0, g, 0]); // its top to the left: the picture is turned clockwise
  near(held(270, 0, 90), [0, g, 0]); // its top to the right
  near(held(0, 60, 0), [0, g * Math.sin(Math.PI / 3), g / 2]); // looking down by 30 degrees
  near(held(0, 120, 0), [0, g * Math.sin(Math.PI / 3), -g / 2]); // looking up
  // Rolled: its right side is lower, so that down is to the right in the picture.
  const rolled = held(0, 60, 20);
  assert.ok(rolled[0] > 0 && rolled[1] > 0);
  // The camera beside the screen looks the other way, and is not mirrored.
  near(held(0, 90, 0, true), [0, g, 0]);
  near(held(0, 0, 0, true), [0, 0, -g]);
  near([held(0, 60, 20, true)[0]], [-rolled[0]]);
});

test("the angles of orientation and the acceleration at rest say the same, on both systems", () => {
  // The device's rotation as the W3C defines it, by quaternions.
  const axis = { x: new Vector3(1, 0, 0), y: new Vector3(0, 1, 0), z: new Vector3(0, 0, 1) };
  for (const [alpha, beta, gamma] of [[10, 20, 30], [200, -70, 55], [0, 130, -80], [300, 89, 1]]) {
    const turn = (name, degrees) => new Quaternion().setFromAxisAngle(axis[name], (degrees * Math.PI) / 180);
    const earthFromDevice = turn("z", alpha).multiply(turn("x", beta)).multiply(turn("y", gamma));
    const down = new Vector3(0, 0, -9.81).applyQuaternion(earthFromDevice.invert()); // gravity in the device
    near(gravityOfOrientation(beta, gamma), down.toArray(), 1e-6);
    const [x, y, z] = down.toArray();
    near(gravityOfMotion({ x: -x, y: -y, z: -z }, false), down.toArray());
    near(gravityOfMotion({ x, y, z }, true), down.toArray());
  }
});

test("how the device turns, about the picture's axes, in the last second", () => {
  const gyroscope = new Gyroscope();
  assert.deepEqual(gyroscope.read(false, 0), []);
  // Upright it turns to the left, about its own y axis, which is up: against the picture's y.
  for (const time of [9, 10, 10.5, 10.5, 10.4]) gyroscope.take(time, { alpha: 0, beta: 90, gamma: 0 });
  const rows = gyroscope.read(false, 0);
  near(rows.map(([time]) => time), [10, 10.5]);
  near(rows[0].slice(1), [0, -Math.PI / 2, 0]);
  // The picture of a device with its top to the left is turned: the device's x axis is up.
  near(gyroscope.read(false, 90)[0].slice(1), [-Math.PI / 2, 0, 0]);
  near(gyroscope.read(true, 0)[0].slice(1), [0, -Math.PI / 2, 0]);
});

test("what an accelerometer measures beside it, with the sign of each system", () => {
  const still = { alpha: 0, beta: 0, gamma: 0 }, g = 9.81;
  // At rest and upright, the force that holds the device points up: against the picture's y.
  for (const [y, isWebKit] of [[g, false], [-g, true]]) {
    const gyroscope = new Gyroscope();
    gyroscope.take(1, still, forceOfMotion({ x: 1, y, z: 2 }, isWebKit));
    gyroscope.take(1.01, still, forceOfMotion({ x: 1, y, z: 2 }, isWebKit));
    const [x, z] = isWebKit ? [-1, -2] : [1, 2];
    const [row, last] = gyroscope.read(false, 0);
    near(row, [1, 0, 0, 0, x, -g, -z]);
    near(last, [1.01, ...row.slice(1)]);
    near(gyroscope.read(true, 0)[0].slice(4), [-x, -g, z]); // the camera beside the screen
    near(gyroscope.read(false, 90)[0].slice(4), [-g, -x, -z]); // its top to the left
    near(gyroscope.read(false, 0)[0].slice(4).map((a) => -a), toPicture(gravityOfMotion({ x: 1, y, z: 2 }, isWebKit), 0));
    gyroscope.take(1.02, still); // an event without an acceleration
    assert.deepEqual(gyroscope.read(false, 0).map(({ length }) => length), [4, 4, 4]);
  }
});

test("the events of the motion sensors become samples", () => {
  const heard = [];
  const [was, wasNavigator] = [globalThis.addEventListener, Object.getOwnPropertyDescriptor(globalThis, "navigator")];
  try {
    globalThis.addEventListener = (type, listener) => heard.push([type, listener]);
    Object.defineProperty(globalThis, "navigator", { value: { vendor: "Apple Computer, Inc." }, configurable: true });
    const gyroscope = new Gyroscope();
    gyroscope.start();
    const [[type, listener]] = heard;
    assert.equal(type, "devicemotion");
    listener({ timeStamp: 2000, rotationRate: { alpha: 90, beta: 0, gamma: 0 }, accelerationIncludingGravity: { x: 0, y: -9.81, z: 0 } });
    near(gyroscope.read(false, 0)[0], [2, Math.PI / 2, 0, 0, 0, -9.81, 0]);
    listener({ timeStamp: 2010, rotationRate: { alpha: null }, accelerationIncludingGravity: { x: 0, y: -9.81, z: 0 } });
    assert.equal(gyroscope.samples.length, 1); // a device without a gyroscope
    listener({ timeStamp: 2020, rotationRate: { alpha: 0, beta: 0, gamma: 0 }, accelerationIncludingGravity: { x: null, y: null, z: null } });
    assert.deepEqual(gyroscope.read(false, 0).map(({ length }) => length), [4, 4]);
  } finally {
    if (was) globalThis.addEventListener = was;
    else delete globalThis.addEventListener;
    if (wasNavigator) Object.defineProperty(globalThis, "navigator", wasNavigator);
    else delete globalThis.navigator;
  }
});

test("the service gets samples under the name that their rows have", () => {
  assert.deepEqual(samplesHeader([]), {});
  assert.deepEqual(samplesHeader([[1, 0, 0, 0]]), { angular_velocity: [[1, 0, 0, 0]] });
  assert.deepEqual(samplesHeader([[1, 0, 0, 0, 0, -9.81, 0]]), { imu: [[1, 0, 0, 0, 0, -9.81, 0]] });
});

test("intrinsics of another size show the same rays, and are kept for the lens they are of", () => {
  const camera = { model: "pinhole", width: 640, height: 480, fx: 525, fy: 526, cx: 319.5, cy: 239.5, distortion: [0.1, 0, 0, 0, 0] };
  const large = scaledCamera(camera, 1280, 960);
  near([large.fx, large.fy, large.cx, large.cy], [1050, 1052, 639.5, 479.5]);
  // Scaling keeps the ray through the border between two pixels.
  const ray = (c, edge) => (edge - 0.5 - c.cx) / c.fx;
  near([ray(camera, 100)], [ray(large, 200)]);
  assert.deepEqual(large.distortion, camera.distortion);
  assert.deepEqual(sentSize(640, 480), { width: 640, height: 480 });
  assert.deepEqual(sentSize(720, 1280), { width: 416, height: 739 });
  assert.deepEqual(sentSize(320, 240), { width: 320, height: 240 });

  const kept = new Map();
  const storage = { getItem: (key) => kept.get(key) ?? null, setItem: (key, value) => kept.set(key, value), removeItem: (key) => kept.delete(key) };
  const known = new KnownCameras(storage);
  const lens = { label: "back", deviceId: "a", width: 1280, height: 960 };
  assert.equal(known.recall(lens, { width: 640, height: 480 }), null);
  known.remember(lens, large);
  near([known.recall(lens, { width: 640, height: 480 }).fx], [525]);
  assert.equal(known.recall({ ...lens, deviceId: "b" }, { width: 640, height: 480 }).fx, 525); // ids change between visits
  assert.equal(known.recall({ ...lens, width: 960, height: 1280 }, { width: 480, height: 640 }), null); // turned
  assert.equal(known.recall({ ...lens, label: "front" }, { width: 640, height: 480 }), null);
  for (const bad of ["", "{", "null", "[]", '{"width":1}', '{"width":640,"height":480,"fx":-1,"fy":1,"cx":0,"cy":0}']) {
    kept.set(known.key(lens), bad);
    assert.equal(known.recall(lens, { width: 640, height: 480 }), null, bad);
  }
  known.forget(lens);
  assert.equal(kept.size, 0);
  const refusing = new KnownCameras(undefined); // a browser that keeps nothing
  refusing.remember(lens, large);
  assert.equal(refusing.recall(lens, { width: 640, height: 480 }), null);
});

test("images are sent when the last is answered, no more often than asked; where answers are late, some before", () => {
  const pacer = new Pacer();
  assert.ok(pacer.maySend(0, 500));
  pacer.sent(1, 0);
  assert.ok(!pacer.maySend(50, 0)); // it is on its way
  pacer.answered(1);
  assert.ok(pacer.maySend(100, 0));
  assert.ok(!pacer.maySend(100, 500) && pacer.maySend(500, 500));
  pacer.sent(2, 500);
  assert.ok(!pacer.maySend(799, 0, 300) && pacer.maySend(800, 0, 300));
  assert.ok(!pacer.maySend(900, 500, 300)); // the interval counts, too
  pacer.sent(3, 800);
  pacer.sent(4, 1100);
  assert.ok(!pacer.maySend(2000, 0, 300)); // three at most
  pacer.answered(4); // the server has dropped those before
  assert.deepEqual(pacer.flying, []);
  pacer.sent(5, 2000);
  assert.ok(!pacer.maySend(5000, 0) && pacer.maySend(6001, 0)); // a lost answer does not stop the images
  pacer.reset();
  assert.ok(pacer.maySend(2001, 500));
});

test("the ray of a pixel, through any lens; the guess of a lens", () => {
  near(rayOf({ fx: 500, fy: 400, cx: 320, cy: 240 }, [420, 200]), [0.2, -0.1, 1]);
  const lens = { width: 640, height: 480, fx: 500, fy: 500, cx: 320, cy: 240 };
  // Where a ray is in the image, by OpenCV's models.
  const [x, y] = [0.3, -0.2], r2 = x * x + y * y;
  const radial = 1 - 0.3 * r2 + 0.1 * r2 * r2;
  const pinhole = [x * radial + 2 * 0.01 * x * y - 0.02 * (r2 + 2 * x * x), y * radial + 0.01 * (r2 + 2 * y * y) - 2 * 0.02 * x * y];
  near(rayOf({ ...lens, distortion: [-0.3, 0.1, 0.01, -0.02, 0] }, [pinhole[0] * 500 + 320, pinhole[1] * 500 + 240]), [x, y, 1], 1e-6);
  const r = Math.sqrt(r2), angle = Math.atan(r), bent = angle * (1 + 0.05 * angle ** 2);
  near(rayOf({ ...lens, model: "fisheye", distortion: [0.05, 0, 0, 0] }, [((x * bent) / r) * 500 + 320, ((y * bent) / r) * 500 + 240]), [x, y, 1], 1e-6);
  const guess = guessedCamera(480, 640);
  assert.ok(Math.abs(2 * Math.atan(320 / guess.fy) - Math.PI / 3) < 1e-9 && guess.fx === guess.fy);
});

test("a ray meets the plane through the points beside it", () => {
  const lens = { width: 640, height: 480, fx: 500, fy: 500, cx: 320, cy: 240 };
  // A floor below the camera, y = 1.5, which looks down a little; and a pole before it.
  const points = [];
  for (let u = 40; u < 640; u += 60) for (let v = 300; v < 480; v += 30) points.push(u, v, (v - 240) / 500 / 1.5);
  const floor = surfaceAt([0.1, 0.3, 1], points, lens);
  assert.ok(Math.abs(floor.depth - 5) < 1e-6, String(floor.depth));
  near(floor.normal, [0, -1, 0], 1e-6); // towards the camera
  const pole = [...points, ...[280, 300, 350].flatMap((v) => [370, v, 1, 372, v + 5, 1])];
  assert.ok(Math.abs(surfaceAt([0.1, 0.3, 1], pole, lens).depth - 5) < 0.3); // points of another surface are left out
  assert.equal(surfaceAt([0.1, -0.4, 1], points, lens), null); // there is nothing
  assert.equal(surfaceAt([0, 0, 1], [], lens), null);
});

test("a socket opens again, later each time, and gives one message at a time", async (t) => {
  const [sockets, waits, states, taken] = [[], [], [], []];
  let finish = null; // ends the handling of a message
  class FakeSocket {
    static OPEN = 1;
    readyState = 1;
    constructor() {
      sockets.push(this);
    }
    say(message) {
      this.onmessage({ data: JSON.stringify(message) });
    }
    close() {}
  }
  const { WebSocket, setTimeout, reportError } = globalThis;
  t.after(() => Object.assign(globalThis, { WebSocket, setTimeout, reportError }));
  Object.assign(globalThis, { WebSocket: FakeSocket, setTimeout: (act, ms) => waits.push({ act, ms }), reportError: () => {} });
  const onMessage = ({ type, fails }) => new Promise((resolve, reject) => {
    taken.push(type);
    finish = () => (fails ? reject(new Error("as told")) : resolve());
  });
  const step = () => new Promise((done) => setImmediate(done));
  const link = new Link({ url: "", protocols: [], onMessage, onState: (state) => states.push(state) });
  for (const message of [{ type: "hello" }, { type: "bad", fails: true }, { type: "good" }]) sockets[0].say(message);
  for (const expected of [["hello"], ["hello", "bad"], ["hello", "bad", "good"]]) { // one that fails does not stop the others
    await step();
    assert.deepEqual(taken, expected);
    if (expected.length < 3) finish();
  }
  assert.deepEqual(states, ["connecting", "open"]);
  // A message of a socket that was closed meanwhile is not taken any more.
  sockets[0].say({ type: "late" });
  sockets[0].onclose();
  for (const ms of [500, 1000, 2000, 4000, 8000, 8000]) {
    assert.equal(link.state, "waiting");
    assert.equal(waits.at(-1).ms, ms);
    waits.at(-1).act();
    sockets.at(-1).onclose();
  }
  waits.at(-1).act();
  sockets.at(-1).say({ type: "hello" });
  finish();
  await step();
  assert.deepEqual(taken, ["hello", "bad", "good", "hello"]);
  assert.ok(link.isOpen && link.delay === 500);
  const count = waits.length;
  link.end();
  sockets.at(-1).onclose();
  assert.ok(!link.isOpen && waits.length === count);
});

test("an anchor that is renamed here keeps its place in the list, and is followed; so is one that is placed", () => {
  const store = { models: [{ name: "flag" }], anchors: ["a", "b", "c"].map((name) => ({ name, size: 1 })) };
  const sent = [];
  const edits = new AnchorEdits(store, (message) => sent.push(message));
  const listed = () => edits.numbered().map(({ anchor, number }) => `${anchor.name}${number}`).join(" ");
  assert.equal(listed(), "a1 b2 c3");
  edits.rename("a", "z");
  assert.deepEqual(sent.splice(0), [{ type: "anchor", name: "a", rename: "z" }]);
  store.anchors = ["b", "c", "z"].map((name) => ({ name, size: 1 }));
  assert.equal(edits.follow("a"), "z");
  assert.equal(listed(), "z1 b2 c3");
  store.anchors.push({ name: "a", size: 1 }); // of another
  assert.equal(edits.follow("z"), "z");
  assert.equal(listed(), "z1 b2 c3 a4");
  edits.place({ origin: [0, 0, 0], direction: [0, 0, 1] });
  assert.equal(sent[0].model, "flag");
  store.anchors.push({ name: "flag 1", size: 1 });
  assert.equal(edits.follow("z"), "flag 1");
  assert.equal(edits.follow("gone"), null);
});

test("addresses and the token", () => {
  const service = new Service({ protocol: "https:", host: "desk:8350", pathname: "/", hash: "#token=a-b.c_d~1" });
  assert.deepEqual(service.socketOf("my desk", "track"), { url: "wss://desk:8350/v1/maps/my%20desk/track", protocols: ["oaslam", "oaslam.token.a-b.c_d~1"] });
  assert.deepEqual(service.headers, { Authorization: "Bearer a-b.c_d~1" });
  assert.deepEqual(new Service({ protocol: "https:", host: "desk", pathname: "/", hash: "#token=no%20token%0a" }).headers, {});
  const open = new Service({ protocol: "http:", host: "127.0.0.1", pathname: "/camera", hash: "" }, "/camera");
  assert.deepEqual(open.socketOf("a", "record"), { url: "ws://127.0.0.1/v1/maps/a/record", protocols: ["oaslam"] });
  assert.deepEqual(open.headers, {});
});

test("a proxy may give the pages a path", () => {
  const base = (pathname, page) => new Service({ protocol: "https:", host: "h", pathname, hash: "" }, page).base;
  for (const [pathname, expected] of [["/", ""], ["/a", "/a"], ["/a/", "/a"], ["/a/b//", "/a/b"], ["/camera", "/camera"]])
    assert.equal(base(pathname), `https://h${expected}`, pathname);
  for (const [pathname, expected] of [["/camera", ""], ["/a/camera", "/a"], ["/", ""], ["/a", "/a"], ["/a/", "/a"], ["/camera/", "/camera"], ["/camera/camera", "/camera"], ["/mycamera", "/mycamera"]])
    assert.equal(base(pathname, "/camera"), `https://h${expected}`, pathname);
});

test("help: only where there is something to help with, and with the address to use", () => {
  const fine = { isSecure: true, hasCamera: true, hasGraphics: true, error: null, address: "https://desk:8350/camera?map=a#token=b" };
  assert.equal(refusal(fine), null);
  const insecure = refusal({ ...fine, isSecure: false, hasCamera: false, address: "http://10.0.0.2:8350/camera?map=a#token=b" });
  assert.ok(insecure.steps.some((step) => step.includes("https://10.0.0.2:8350/camera?map=a#token=b")));
  const titles = ["NotAllowedError", "NotFoundError", "NotReadableError", "TypeError"].map((name) => refusal({ ...fine, error: { name, message: "x" } }).title);
  assert.equal(new Set(titles).size, 4);
  assert.match(refusal({ ...fine, hasGraphics: false }).steps[0], /WebGL/);
});

test("the state in words", () => {
  assert.equal(describe({ link: "connecting" }).text, "connecting");
  assert.equal(describe({ link: "waiting", kind: "track", why: null, seconds: 3.2 }).text, "no connection: again in 4 s");
  assert.equal(describe({ link: "waiting", kind: "track", why: "no map desk", seconds: 0 }).text, "no map desk: again in 1 s");
  assert.match(describe({ link: "waiting", kind: "record" }).text, /not saved/);
  const tracked = { pose: {}, state: "tracking" };
  assert.equal(describe({ link: "open", kind: "track", answer: { state: "tracking" }, tracked }).text, "in the map");
  assert.match(describe({ link: "waiting", kind: "track", why: null, seconds: 1, tracked }).text, /^no connection: again/);
  assert.match(describe({ link: "open", kind: "track", answer: { state: "lost" }, tracked }).text, /looking/);
  assert.match(describe({ link: "open", kind: "track", answer: { state: "tracking" }, tracked: { pose: null, state: "preliminary" } }).text, /move sideways/);
  assert.match(describe({ link: "open", kind: "track", answer: { state: "lost" }, tracked: { pose: null, state: "blind" } }).text, /hold on to/);
  assert.match(describe({ link: "open", answer: { state: "lost" } }).text, /looking/);
  assert.equal(describe({ kind: "alone", tracked }).text, "without a map");
  for (const session of [{ kind: "alone" }, { kind: "track", link: "open", answer: { state: "tracking" } }]) {
    assert.match(describe({ ...session, tracked: { pose: {}, state: "inertial" } }).text, /sees too little/);
  }
  assert.match(describe({ kind: "alone", tracked: { pose: {}, state: "preliminary" } }).text, /move sideways/);
  assert.deepEqual([0.41, 9.96, 12.3].map(ageInWords), ["place 0.4 s old", "place 10.0 s old", "place 12 s old"]);
});
