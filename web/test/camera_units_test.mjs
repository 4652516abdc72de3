// What both pages compute, without a browser.   node --test web/test/camera_units_test.mjs
import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { test } from "node:test";

if (!(await import("three").catch(() => null))) {
  console.log("SKIPPED: no three (npm ci in web/)");
  process.exit(0);
}
const { Quaternion, Vector3 } = await import("three");
const { AnchorEdits } = await import("../src/anchor_edits.js");
const { Link } = await import("../src/link.js");
const { packImage } = await import("../src/camera/framing.js");
const { gravityOfMotion, gravityOfOrientation, toPicture } = await import("../src/camera/gravity.js");
const { Gyroscope } = await import("../src/camera/gyroscope.js");
const { refusal } = await import("../src/camera/help.js");
const { KnownCameras, scaledCamera, sentSize } = await import("../src/camera/intrinsics.js");
const { between, moved, MotionFilter } = await import("../src/camera/motion.js");
const { Pacer } = await import("../src/camera/pacer.js");
const { Service } = await import("../src/service.js");
const { describe } = await import("../src/camera/words.js");

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

// A camera with a constant motion.
const steady = (t) => {
  const q = new Quaternion().setFromAxisAngle(new Vector3(0.2, 1, -0.3).normalize(), 0.8 * t).multiply(new Quaternion(0.1, -0.4, 0.2, 0.8).normalize());
  return [...q.toArray(), 1 + 0.5 * t, -0.2 * t, 2 + 0.1 * t];
};
const apart = (a, b) => {
  const { rotation, translation } = between(a, b);
  return { angle: rotation.length(), way: translation.length() };
};

test("poses: the way between two, and a share of it", () => {
  const [a, b] = [steady(0), steady(1.3)];
  const way = between(a, b);
  assert.ok(apart(moved(a, way), b).angle < 1e-9 && apart(moved(a, way), b).way < 1e-9);
  assert.ok(Math.abs(way.rotation.length() - 0.8 * 1.3) < 1e-9);
  assert.ok(apart(moved(a, way, 0.5), steady(0.65)).angle < 1e-9);
  // The shorter rotation of the two, and none at all.
  const opposite = [...b.slice(0, 4).map((x) => -x), ...b.slice(4)];
  assert.ok(apart(b, opposite).angle < 1e-6);
  assert.deepEqual(moved(a, between(a, a)).map((x) => x.toFixed(9)), a.map((x) => x.toFixed(9)));
});

test("a steady motion is foretold; what is not known to go on is not", () => {
  const filter = new MotionFilter();
  assert.equal(filter.at(1), null);
  filter.add(steady(0), 0, 2);
  assert.ok(apart(filter.at(0.1), steady(0)).way < 1e-12); // one pose tells no motion
  for (const t of [0.05, 0.09, 0.15]) filter.add(steady(t), t, 2);
  for (const t of [0.15, 0.2, 0.39]) {
    const { angle, way } = apart(filter.at(t), steady(t));
    assert.ok(angle < 1e-6 && way < 1e-6, `${t}: ${angle}, ${way}`);
  }
  assert.ok(apart(filter.at(0.9), steady(0.4)).way < 1e-6); // at most a quarter of a second ahead
  assert.equal(filter.at(1.5), null);
  filter.add(steady(0.1), 0.1, 2); // one that is older than the newest is ignored
  assert.ok(apart(filter.at(0.2), steady(0.2)).way < 1e-6);
  filter.reset();
  assert.equal(filter.at(0.2), null);
});

test("a correction does not jump and is made soon; another place is shown at once", () => {
  const filter = new MotionFilter();
  for (const t of [0, 0.05, 0.1]) filter.add(steady(t), t, 2);
  const before = filter.show(0.2);
  const aside = (t) => moved(steady(t), { rotation: new Vector3(0, 0.03, 0), translation: new Vector3(0.05, 0, 0) });
  filter.add(aside(0.15), 0.15, 2);
  let last = filter.show(0.2);
  assert.ok(apart(last, before).angle < 1e-6 && apart(last, before).way < 1e-6);
  let answered = 0.15;
  for (let t = 0.21; t < 0.8; t += 0.01) {
    if (t - answered > 0.1) filter.add(aside((answered += 0.05)), answered, 2);
    const now = filter.show(t);
    assert.ok(apart(last, now).way < 0.04 && apart(last, now).angle < 0.04, `a jump at ${t}: ${JSON.stringify(apart(last, now))}`);
    last = now;
  }
  assert.ok(apart(last, aside(0.79)).way < 0.005, String(apart(last, aside(0.79)).way));
  // A jump to another place is not taken for a motion that goes on.
  const elsewhere = moved(steady(0.7), { rotation: new Vector3(0, 2, 0), translation: new Vector3(3, 0, 0) });
  filter.add(elsewhere, 0.75, 2);
  assert.ok(apart(filter.show(0.85), elsewhere).way < 1e-9);
});

test("walks with a camera in a trembling hand: content drawn by what is foretold is nearer to its place than by the newest pose", () => {
  // How far a point 2 m in front of the camera is drawn from its place, in pixels at a focal length of 525.
  const pixels = (drawn, pose) => {
    const point = new Vector3(0.3, 0.2, 2).applyQuaternion(new Quaternion().fromArray(pose)).add(new Vector3().fromArray(pose, 4));
    const p = point.sub(new Vector3().fromArray(drawn, 4)).applyQuaternion(new Quaternion().fromArray(drawn).invert());
    return Math.hypot((525 * p.x) / p.z - (525 * 0.3) / 2, (525 * p.y) / p.z - (525 * 0.2) / 2);
  };
  const median = (values) => values.toSorted((a, b) => a - b)[values.length >> 1];
  for (const clip of ["map_front", "query_around", "lost_and_back"])
    for (const [every, late] of [[1, 2], [2, 3], [4, 5]]) { // at 30 images a second: images from answer to answer, and from an image to its answer
      const lines = readFileSync(new URL(`../../data/sample/${clip}/groundtruth.txt`, import.meta.url), "utf8").split("\n").filter((line) => /^[\d.]/.test(line));
      const truth = lines.map((line) => line.split(/\s+/).map(Number)).map(([t, x, y, z, ...q]) => ({ t, pose: [...q, x, y, z] }));
      const filter = new MotionFilter();
      const errors = [];
      let newest = null;
      truth.forEach(({ t, pose }, i) => {
        if (i >= late && (i - late) % every === 0) {
          newest = truth[i - late];
          filter.add(newest.pose, newest.t, 2);
        }
        const drawn = filter.show(t);
        if (i >= 30) errors.push([pixels(drawn, pose), pixels(newest.pose, pose)]);
      });
      const [foretold, last] = [0, 1].map((which) => median(errors.map((pair) => pair[which])));
      const fast = errors.filter(([, last]) => last > 15); // while the camera turns quickly
      const [fastForetold, fastLast] = [0, 1].map((which) => median(fast.map((pair) => pair[which])));
      console.log(`${clip}, an answer every ${every} images, ${late} late: ${foretold.toFixed(1)} px, not ${last.toFixed(1)}; in ${fast.length} images of fast motion ${fastForetold?.toFixed(1)}, not ${fastLast?.toFixed(1)}`);
      assert.ok(foretold < 1.1 * last);
      if (fast.length >= 20) assert.ok(fastForetold < 0.75 * fastLast);
    }
});

test("images are sent at the pace of the answers, two on the way at most", () => {
  const pacer = new Pacer();
  assert.ok(pacer.maySend(0));
  pacer.sent(1, 0);
  assert.ok(!pacer.maySend(50)); // the pace is not known yet
  pacer.answered(1, 100);
  assert.ok(pacer.maySend(100));
  pacer.sent(2, 100);
  assert.ok(!pacer.maySend(140));
  assert.ok(pacer.maySend(150)); // half a round trip later
  pacer.sent(3, 150);
  assert.ok(!pacer.maySend(1000));
  pacer.answered(2, 1010);
  assert.ok(pacer.maySend(1010));
  pacer.sent(4, 1010);
  assert.ok(!pacer.maySend(1011));
  pacer.answered(4, 1100); // 3 was dropped
  assert.deepEqual(pacer.flying, []);
  pacer.sent(5, 1100);
  assert.ok(pacer.maySend(6000)); // a lost answer does not stop the images
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
  const service = new Service({ protocol: "https:", host: "desk:8350", hash: "#token=a-b.c_d~1" });
  assert.deepEqual(service.socketOf("my desk", "track"), { url: "wss://desk:8350/v1/maps/my%20desk/track", protocols: ["oaslam", "oaslam.token.a-b.c_d~1"] });
  assert.deepEqual(service.headers, { Authorization: "Bearer a-b.c_d~1" });
  assert.deepEqual(new Service({ protocol: "https:", host: "desk", hash: "#token=no%20token%0a" }).headers, {});
  const open = new Service({ protocol: "http:", host: "127.0.0.1", hash: "" });
  assert.deepEqual(open.socketOf("a", "record"), { url: "ws://127.0.0.1/v1/maps/a/record", protocols: ["oaslam"] });
  assert.deepEqual(open.headers, {});
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
  assert.equal(describe({ link: "open", answer: { state: "tracking" } }).state, "tracking");
  assert.match(describe({ link: "open", answer: { state: "lost" } }).text, /looking/);
});
