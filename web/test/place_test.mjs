// How a device's odometry is placed in a map by answers that come late.   node --test web/test/place_test.mjs
import assert from "node:assert/strict";
import { test } from "node:test";

const { correctedPose, motionOf, Place } = await import("../src/device/place.js");
const { between, compose, conjugate, inverse, length, minus, moved, multiply, normalized, ofRotationVector, rotate, rotationVector } = await import("../src/device/rigid.js");

const near = (a, b, tolerance = 1e-9) => a.forEach((x, i) => assert.ok(Math.abs(x - b[i]) < tolerance, `${a}, not ${b}`));

// The odometry's frame in the map: turned, moved, and in another unit.
const UNIT = 2.07;
const TURNED = normalized([0.3, -0.2, 0.5, 0.7]);
const MOVED = [3, -1, 2];
const inMap = ({ position, rotation }) => ({ position: rotate(TURNED, position).map((x, i) => UNIT * x + MOVED[i]), rotation: multiply(TURNED, rotation) });
// A camera that walks round and turns, in the odometry's frame; a metre of the map in a second or so.
const walk = (t) => ({ position: [0.4 * Math.sin(t), 0.05 * Math.sin(3 * t), 0.4 - 0.4 * Math.cos(t)], rotation: ofRotationVector([0.1 * Math.sin(2 * t), 0.5 * Math.sin(t), 0]) });
const KEYFRAME_EVERY = 10, WINDOW = 5;
const row = (image, { position, rotation }) => [image, ...position, ...rotation];
// What the odometry tells of an image at 30 a second. `off`: by how much it is wrong about a keyframe, when it is known at an image.
function estimateAt(image, { run = 0, state = "tracking", off = () => [0, 0, 0], pose = walk(image / 30) } = {}) {
  const newest = Math.floor(image / KEYFRAME_EVERY) * KEYFRAME_EVERY;
  const wrong = (of, { position, rotation }) => ({ position: minus(position, off(of, image)), rotation });
  const keyframes = [];
  for (let of = Math.max(0, newest - (WINDOW - 1) * KEYFRAME_EVERY); of <= newest; of += KEYFRAME_EVERY) keyframes.push(...row(of, wrong(of, walk(of / 30))));
  const { position, rotation } = inverse(wrong(newest, pose));
  return {
    state, run, image, camFromOdom: { rotation: Float64Array.from(rotation), translation: Float64Array.from(position) }, covariance: new Float64Array(36),
    points: Float32Array.from([100, 100, 1, 300, 200, 1.1, 500, 300, 0.9]), keyframes: Float64Array.from(state === "preliminary" ? [] : keyframes), keyframe: image === newest, tracked: 200, inliers: 190,
  };
}
const COVARIANCE = Array.from({ length: 36 }, (_, i) => (i % 7 ? 0 : i < 21 ? 1e-6 : 1e-7));
const answerAt = (image, more = {}) => ({ type: "pose", id: image, time: image / 30, state: "tracking", pose: inMap(walk(image / 30)), confidence: 0.95, covariance: COVARIANCE, unit: UNIT, depth: 2, ms: 5, ...more });
const offBy = (pose, image) => between(inMap(walk(image / 30)), pose);

// Walks for some seconds. `answer` makes the answer to an image, which comes `delay` images later; one image in 15 is sent. `look` gets each pose.
function follow(place, { from = 0, to, delay, answer = answerAt, options = {}, look = () => {} }) {
  const flying = [];
  for (let image = from; image < to; ++image) {
    const now = place.see(estimateAt(image, options), image / 30);
    if (image % 15 === 0) flying.push({ at: image + delay, message: answer(image), sighting: now });
    while (flying[0]?.at <= image) {
      const { message, sighting } = flying.shift();
      if (message) place.take(message, sighting, image / 30);
    }
    look(place.poseOf(now, image / 30), image, now);
  }
}

test("its own motion, which comes back from the service, and a pose without a depth are no evidence", () => {
  for (const none of [{ source: "registration" }, { depth: 0 }, { depth: undefined, unit: undefined }]) {
    const place = new Place();
    const sighting = place.see(estimateAt(0), 0);
    assert.equal(place.take(answerAt(0, { state: "objects", ...none }), sighting, 0), false);
    assert.equal(place.poseOf(sighting, 0), null);
    assert.equal(place.take(answerAt(0, { state: "objects", source: "objects" }), sighting, 0), true);
  }
});

test("rotations and poses", () => {
  const a = { position: [1, 2, 3], rotation: normalized([0.1, 0.7, -0.3, 0.5]) }, b = { position: [-2, 0, 1], rotation: normalized([0.5, 0.1, 0.2, -0.8]) };
  const back = compose(a, inverse(a));
  near([...back.position, ...back.rotation], [0, 0, 0, 0, 0, 0, 1]);
  near(rotate(conjugate(a.rotation), rotate(a.rotation, [3, 1, 2])), [3, 1, 2]);
  const way = between(a, b), there = moved(a, way);
  near(there.position, b.position);
  assert.ok(length(rotationVector(multiply(conjugate(there.rotation), b.rotation))) < 1e-9);
  const half = moved(a, way, 0.5);
  near(moved(half, between(half, b)).position, b.position);
  near([length(between(a, half).rotation)], [length(way.rotation) / 2]);
  near(rotationVector(ofRotationVector([0.2, -0.1, 3])), [0.2, -0.1, 3], 1e-9);
  near(rotationVector([0, 0, 0, 1]), [0, 0, 0]);
});

test("one answer places the camera, however late it is, and it is followed from there", () => {
  for (const delay of [0, 9, 60]) {
    const place = new Place();
    let seen = 0;
    follow(place, {
      to: 150, delay,
      look: (pose, image) => {
        if (image < delay) return void assert.equal(pose, null);
        ++seen;
        const { translation, rotation } = offBy(pose, image);
        assert.ok(length(translation) < 1e-6 && length(rotation) < 1e-6, `${delay} ${image}: ${translation} ${rotation}`);
        assert.ok(Math.abs(pose.age - ((image - delay) % 15 + delay) / 30) < 1e-9, `${image}: ${pose.age}`);
        assert.ok(pose.sigma > 0 && pose.depth === 2);
      },
    });
    assert.ok(seen >= 90);
  }
});

test("without answers the place gets older and less certain, and stays", () => {
  const place = new Place();
  follow(place, { to: 30, delay: 3 });
  let last = 0;
  follow(place, {
    from: 30, to: 180, delay: 3, answer: () => null,
    look: (pose, image) => {
      assert.ok(length(offBy(pose, image).translation) < 1e-6);
      assert.ok(pose.age > last);
      last = pose.age;
    },
  });
  assert.ok(last > 4.9);
  const early = place.poseOf(place.see(estimateAt(180), 6), 6).sigma;
  place.take(answerAt(180), place.newest, 6);
  assert.ok(place.poseOf(place.newest, 6).sigma < 0.5 * early);
});

test("the unit follows from the answers where the one that is told is wrong", () => {
  const place = new Place();
  const errors = [];
  follow(place, { to: 200, delay: 30, answer: (image) => answerAt(image, { unit: 0.96 * UNIT }), look: (pose, image) => errors.push(pose ? length(offBy(pose, image).translation) : 0) });
  assert.ok(Math.max(...errors.slice(30, 60)) > 0.01); // by one answer
  assert.ok(Math.max(...errors.slice(150)) < 0.006, String(Math.max(...errors.slice(150))));
  // Where none is told, it is guessed by the depths, and learnt.
  const other = new Place();
  follow(other, { to: 200, delay: 3, answer: (image) => answerAt(image, { unit: undefined }) });
  assert.ok(Math.abs(other.fit.scale / UNIT - 1) < 0.01, String(other.fit.scale));
});

test("a correction does not jump: it is eased in; another place is shown at once", () => {
  const place = new Place();
  const shift = [0.03, -0.02, 0.01];
  let last = null;
  const isShifted = (image) => image >= 60;
  follow(place, {
    to: 120, delay: 3,
    answer: (image) => answerAt(image, { covariance: COVARIANCE.map((x) => 400 * x), pose: { ...inMap(walk(image / 30)), position: inMap(walk(image / 30)).position.map((x, i) => x + (isShifted(image) ? shift[i] : 0)) } }),
    look: (pose, image) => {
      const off = pose && offBy(pose, image).translation;
      if (last && off) assert.ok(length(minus(off, last)) < 0.006, `a jump at ${image}: ${length(minus(off, last))}`);
      last = off;
    },
  });
  assert.ok(length(last) > 0.01); // towards the new answers
  // Two answers that agree on another place.
  const there = (image) => answerAt(image, { pose: { ...inMap(walk(image / 30)), position: inMap(walk(image / 30)).position.map((x) => x + 5) } });
  for (const image of [120, 121]) {
    place.see(estimateAt(image), image / 30);
    assert.equal(place.take(there(image), place.newest, image / 30), image === 121);
  }
  near(place.poseOf(place.newest, 121 / 30).position, there(121).pose.position, 1e-3);
});

test("a wrong answer among right ones, one that is not sure, and one that saw nothing of the map do not place the camera", () => {
  const place = new Place();
  const see = (image) => place.see(estimateAt(image), image / 30);
  const first = see(0);
  assert.equal(place.take(answerAt(0, { confidence: 0.4 }), first, 0), false);
  assert.equal(place.poseOf(first, 0), null);
  assert.equal(place.take(answerAt(0, { state: "odometry" }), first, 0), false);
  assert.equal(place.take(answerAt(0, { state: "lost", pose: undefined }), first, 0), false);
  const second = see(15);
  assert.equal(place.take(answerAt(15, { confidence: 0.4 }), second, 0.5), true); // it agrees with the other
  assert.ok(length(offBy(place.poseOf(second, 0.5), 15).translation) < 1e-6);
  const third = see(30);
  assert.equal(place.take(answerAt(30, { pose: inMap(walk(3)) }), third, 1), false);
  assert.ok(length(offBy(place.poseOf(third, 1), 30).translation) < 1e-6);
  assert.equal(place.take(answerAt(30), null, 1), false); // for an image whose motion was not known
});

test("what the odometry corrects moves with it", () => {
  // It finds at image 45 that the keyframes up to 20 were wrong by this.
  const off = (of, known) => (known >= 45 || of > 20 ? [0, 0, 0] : [0.02, 0, 0.01]);
  const then = new Place().see(estimateAt(25, { off }), 25 / 30), now = new Place().see(estimateAt(45, { off }), 1.5);
  near(then.pose.position, minus(walk(25 / 30).position, [0.02, 0, 0.01]));
  near(correctedPose(then, now).position, walk(25 / 30).position);
  assert.equal(correctedPose(then, new Place().see(estimateAt(300), 10)), null); // no keyframe is common
  const place = new Place();
  follow(place, { to: 100, delay: 3, options: { off }, look: (pose, image) => image >= 45 && assert.ok(length(offBy(pose, image).translation) < 1e-6) });
});

test("a new run begins without a place, and answers for images of the one before are dropped", () => {
  const place = new Place();
  follow(place, { to: 40, delay: 3 });
  const old = place.newest;
  assert.equal(place.see({ ...estimateAt(40), camFromOdom: null, state: "blind" }, 40 / 30), null);
  const first = place.see(estimateAt(0, { run: 1, state: "preliminary", pose: walk(41 / 30) }), 41 / 30);
  assert.equal(place.poseOf(first, 41 / 30), null);
  assert.equal(place.take(answerAt(39), old, 41 / 30), false);
  assert.equal(place.poseOf(first, 41 / 30), null);
  assert.equal(place.take(answerAt(41), first, 41 / 30), true);
  near(place.poseOf(first, 41 / 30).position, inMap(walk(41 / 30)).position, 1e-6);
  place.reset(); // another map
  assert.equal(place.poseOf(first, 41 / 30), null);
});

test("while the motion is preliminary the place soon gets uncertain", () => {
  const sigmas = ["preliminary", "tracking"].map((state) => {
    const place = new Place();
    place.take(answerAt(0), place.see(estimateAt(0, { state }), 0), 0);
    return place.poseOf(place.see(estimateAt(12, { state }), 0.4), 0.4).sigma;
  });
  assert.ok(sigmas[0] > 5 * sigmas[1], String(sigmas));
});

test("what the service is told of a motion", () => {
  const estimate = estimateAt(25);
  const motion = motionOf(estimate);
  assert.deepEqual([motion.run, motion.image, motion.preliminary, motion.agreeing, motion.keyframe], [0, 25, false, 0.95, false]);
  near(motion.pose.position, walk(25 / 30).position);
  near(motion.pose.rotation, walk(25 / 30).rotation);
  assert.deepEqual(motion.keyframes.map(([image]) => image), [0, 10, 20]);
  near(motion.keyframes[1].slice(1), row(10, walk(10 / 30)).slice(1));
  assert.deepEqual(motion.depths.map((depth) => depth.length), [3, 3, 3]);
  for (const state of ["uncertain", "inertial"]) assert.equal(motionOf({ ...estimate, state }), null);
  assert.equal(motionOf({ ...estimate, state: "blind", camFromOdom: null }), null);
});

test("turning the phone while key points are extracted does not end the session", async (t) => {
  const sockets = [], calls = [], problems = [];
  class FakeWorker {
    postMessage({ call }) {
      calls.push(call);
      if (call !== "features") queueMicrotask(() => this.onmessage({ data: { result: call === "process" ? estimateAt(1) : {} } })); // key points take long
    }
    terminate() {}
  }
  class FakeSocket {
    static OPEN = 1;
    readyState = 1;
    bufferedAmount = 0;
    constructor() {
      sockets.push(this);
    }
    send() {}
    close() {}
  }
  const { Worker, WebSocket, reportError } = globalThis;
  t.after(() => Object.assign(globalThis, { Worker, WebSocket, reportError }));
  Object.assign(globalThis, { Worker: FakeWorker, WebSocket: FakeSocket, reportError: (error) => problems.push(error.message) });
  const { DeviceTracker } = await import("../src/device/device_tracker.js");
  const step = () => new Promise((done) => setImmediate(done));
  const tracker = new DeviceTracker({ service: { url: "https://maps.example", map: "desk" }, share: "features", worker: () => new FakeWorker() });
  tracker.addEventListener("problem", ({ detail }) => problems.push(detail));
  sockets[0].onmessage({ data: JSON.stringify({ type: "hello", map: "desk", digest: "1" }) });
  const image = (width, height) => ({ width, height, data: new Uint8ClampedArray(4 * width * height) });
  for (const time of [0, 0.1]) {
    await tracker.process({ image: image(64, 48), time });
    await step();
  }
  assert.deepEqual(calls, ["create", "process", "features"]);
  await tracker.process({ image: image(48, 64), time: 0.2 });
  await step();
  assert.deepEqual(problems, []);
  assert.equal(tracker.stream.pacer.flying.length, 0); // the next image need not wait for its answer
  tracker.end();
});
