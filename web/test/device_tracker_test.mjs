// What a device's tracker makes of the odometry's estimates, with a worker that tells them as it was asked to.   node --test web/test/device_tracker_test.mjs
import assert from "node:assert/strict";
import { test } from "node:test";

globalThis.Worker ??= class {}; // Node has none of this name
const { DeviceTracker } = await import("../src/device/device_tracker.js");

const camera = { width: 640, height: 480, fx: 525, fy: 525, cx: 319.5, cy: 239.5 };
const image = { width: 640, height: 480, data: new Uint8ClampedArray(4) };
const still = { rotation: Float64Array.from([0, 0, 0, 1]), translation: Float64Array.from([0, 0, -0.5]) };
const tracking = {
  state: "tracking", run: 0, image: 0, camFromOdom: still, covariance: new Float64Array(36), points: Float32Array.from([320, 240, 0.5]), keyframes: new Float64Array(0),
  keyframe: false, tracked: 100, inliers: 90, metresPerUnit: null, metreSigma: null, gravity: null,
};

class FakeWorker extends Worker {
  estimates = [];
  samples = [];
  postMessage({ call, given }) {
    if (call === "process") this.samples.push(given.samples);
    queueMicrotask(() => this.onmessage({ data: { result: call === "process" ? this.estimates.shift() : undefined } }));
  }
  terminate() {}
}

async function begun(...estimates) {
  const worker = new FakeWorker();
  worker.estimates.push(...estimates);
  const tracker = new DeviceTracker({ camera, worker: () => worker });
  assert.equal((await tracker.process({ image, time: 0 })).state, "starting");
  await new Promise(setImmediate);
  return { tracker, worker };
}

test("without a map, poses keep the odometry's unit, and its length is told once it is known", async () => {
  const { tracker, worker } = await begun(tracking, { ...tracking, metresPerUnit: 1.5, metreSigma: 0.02, gravity: Float64Array.from([0, 9.81, 0]) });
  const rows = [[0.9, 0, 0, 0, 0, -9.81, 0]];
  const before = await tracker.process({ image, time: 1, gyroscope: rows });
  assert.equal(before.metresPerUnit, null);
  const after = await tracker.process({ image, time: 2, gyroscope: rows, gravity: [9.81, 0, 0] });
  assert.equal(after.metresPerUnit, 1.5);
  assert.deepEqual([after.world, after.pose.position, after.depth], ["odometry", before.pose.position, before.depth]);
  assert.deepEqual(worker.samples, [rows, rows]);
  assert.deepEqual(tracker.up.map(Math.round), [0, -1, 0]); // the odometry's gravity has no acceleration of the hand in it
});

test("a pose by the motion sensors alone is one; blind, there is none", async () => {
  const nothing = { points: new Float32Array(0), inliers: 0, tracked: 0 };
  const { tracker } = await begun({ ...tracking, ...nothing, state: "inertial", metresPerUnit: 1.5 }, { ...tracking, ...nothing, state: "blind", camFromOdom: null });
  const carried = await tracker.process({ image, time: 1 });
  assert.deepEqual([carried.state, carried.pose.position[2], carried.metresPerUnit], ["inertial", 0.5, 1.5]);
  assert.equal(tracker.hit(320, 240), null);
  const lost = await tracker.process({ image, time: 2 });
  assert.deepEqual([lost.state, lost.pose, lost.metresPerUnit], ["blind", null, null]);
});
