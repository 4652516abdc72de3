// How the odometry's module is called (dist/oaslam_odometry.js); what it tells is compared in tests/e2e/odometry_js_test.py.
//   node --test web/test/odometry_test.mjs
import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { test } from "node:test";

const { Odometry } = await import("../dist/oaslam_odometry.js");
const WIDTH = 320, HEIGHT = 240;
const camera = { width: WIDTH, height: HEIGHT, fx: 300, fy: 300, cx: 160, cy: 120 };

// Squares of four pixels, seen from x pixels further to the right each time.
function wall(x) {
  const image = new Uint8Array(WIDTH * HEIGHT);
  for (let r = 0; r < HEIGHT; ++r) {
    for (let c = 0; c < WIDTH; ++c) image[r * WIDTH + c] = Math.imul(((r >> 2) << 10) + ((c + x) >> 2), 0x9e3779b1) >>> 24;
  }
  return image;
}
const imageData = (grey) => ({ width: WIDTH, height: HEIGHT, data: Uint8ClampedArray.from({ length: 4 * grey.length }, (_, i) => (i % 4 === 3 ? 255 : grey[i >> 2])) });

test("a wall that moves is followed, as grey bytes and as ImageData alike", async () => {
  const [one, other] = [await Odometry.create({ camera, seed: 1 }), await Odometry.create({ camera, seed: 1 })];
  for (let i = 0; i < 10; ++i) {
    const a = one.process(wall(2 * i), i / 30);
    const b = other.process(imageData(wall(2 * i)), i / 30);
    assert.deepEqual(a, b);
    assert.equal(a.image, i);
    if (i === 0) continue;
    assert.equal(a.state, "preliminary");
    assert.ok(a.tracked > 40);
    assert.ok(Math.abs(Math.hypot(...a.camFromOdom.rotation) - 1) < 1e-9);
  }
  one.delete();
  other.delete();
});

// A wall with dots at three distances, seen by a camera that moves to the right.
function room(x) {
  const image = new Uint8Array(WIDTH * HEIGHT).fill(90);
  for (let i = 0; i < 400; ++i) {
    const hash = (salt) => (Math.imul(i * 7 + salt, 0x9e3779b1) >>> 8) % 4096;
    const [column, row] = [hash(1) % 700 - 100 - Math.round(x / (1 + i % 3)), hash(2) % HEIGHT];
    for (let r = row; r < Math.min(row + 5, HEIGHT); ++r)
      for (let c = Math.max(column, 0); c < Math.min(column + 5, WIDTH); ++c) image[r * WIDTH + c] = hash(3) % 256;
  }
  return image;
}

test("the keyframes that are corrected, in the frame of the poses", async () => {
  const odometry = await Odometry.create({ camera });
  let corrected = 0;
  for (let i = 0; i < 90; ++i) {
    const { state, keyframes, image, camFromOdom } = odometry.process(room(3 * i), i / 30);
    if (state === "preliminary") assert.equal(keyframes.length, 0);
    if (state !== "tracking") continue;
    ++corrected;
    assert.ok(keyframes.length % 8 === 0 && keyframes.length >= 16);
    const rows = Array.from({ length: keyframes.length / 8 }, (_, row) => [...keyframes.subarray(8 * row, 8 * row + 8)]);
    rows.forEach(([of], row) => assert.ok(of <= image && (row === 0 || of > rows[row - 1][0])));
    for (const row of rows) assert.ok(Math.abs(Math.hypot(...row.slice(4)) - 1) < 1e-9);
    // A camera that moves to the right, and does not turn: so do its keyframes, to where it is.
    assert.ok(rows.at(-1)[1] > rows[0][1] && rows.at(-1)[1] < -camFromOdom.translation[0] + 0.1, `${rows.at(-1)} ${camFromOdom.translation}`);
  }
  assert.ok(corrected > 20, String(corrected));
  odometry.delete();
});

test("an image that is refused does not become the last one", async () => {
  const odometry = await Odometry.create({ camera });
  odometry.process(room(0), 1);
  const before = odometry.features(300).bytes.slice();
  const other = new Uint8Array(WIDTH * HEIGHT).map((_, i) => (i * 7919) % 251);
  assert.throws(() => odometry.process(other, 1), { message: /^odometry: time stamp 1\.000000 is not after/ });
  assert.throws(() => odometry.process(other, 2, [[1, 0, 0, NaN]]), { message: /finite/ });
  assert.deepEqual(odometry.features(300).bytes.slice(), before);
  odometry.delete();
});

test("key points of the last image, in the layout that the service takes", async () => {
  const odometry = await Odometry.create({ camera });
  assert.throws(() => odometry.features(), { message: "odometry: there is no image yet" });
  odometry.process(room(0), 0);
  assert.throws(() => odometry.features(0), { message: /^odometry: 0 key points, expected 1 to/ });
  const { count, lowest, levels, factor, bytes } = odometry.features(300);
  assert.ok(count > 100 && count < 400 && bytes.length === 45 * count && levels === 8 && factor === 1.2);
  assert.equal(lowest, 1);
  const floats = new Float32Array(bytes.slice(0, 12 * count).buffer);
  for (let i = 0; i < count; ++i) {
    const [x, y, angle] = floats.subarray(3 * i, 3 * i + 3);
    assert.ok(x > 0 && x < WIDTH && y > 0 && y < HEIGHT && angle >= 0 && angle < 6.2832);
    assert.ok(bytes[12 * count + i] < levels);
  }
  assert.equal(new Set(Array.from({ length: count }, (_, i) => bytes.subarray(13 * count + 32 * i, 13 * count + 32 * i + 32).join())).size > 0.9 * count, true);
  odometry.delete();
});

test("the estimate is one object, and an image without texture ends the run", async () => {
  const odometry = await Odometry.create({ camera });
  const first = odometry.process(wall(0), 0);
  for (let i = 1; i < 5; ++i) assert.equal(odometry.process(wall(2 * i), i), first);
  assert.equal(odometry.process(new Uint8Array(WIDTH * HEIGHT), 5).state, "blind");
  assert.equal(first.camFromOdom, null);
  assert.ok(odometry.process(wall(0), 6).run > 0);
  odometry.delete();
});

test("the memory of the module grows", async () => {
  const [width, height] = [4096, 3072];
  const odometry = await Odometry.create({ camera: { width, height, fx: 4000, fy: 4000, cx: 2048, cy: 1536 } });
  const grey = Uint8Array.from({ length: width * height }, (_, i) => Math.imul((i >> 17 << 10) + ((i % width) >> 5), 0x9e3779b1) >>> 24);
  const data = new Uint8ClampedArray(4 * grey.length).map((_, i) => grey[i >> 2]);
  assert.equal(odometry.process(grey, 0).image, 0);
  const tracked = odometry.process({ width, height, data }, 1).tracked;
  assert.ok(tracked > 40);
  assert.equal(odometry.process(grey, 2).tracked, tracked);
  odometry.delete();
});

test("a camera that is refused", async () => {
  const refused = (change, message) => assert.rejects(Odometry.create({ camera: { ...camera, ...change } }), { message });
  await refused({ fx: 1.2 }, /^camera: focal length fx: 1.2, expected pixels; a share of the image's width/);
  await refused({ cy: 241 }, "camera: principal point cy: 241, allowed: 0 to 240");
  await refused({ width: "320" }, "camera: width: 320, expected a number");
  await refused({ height: 20.5 }, "camera: height: 20.5, expected a whole number");
  await refused({ width: 30, height: 30, cx: 15, cy: 15, fx: 30, fy: 30 }, /too small: tracked at 30 x 30, more than 32 asked/);
  await refused({ model: "omni" }, "camera: model: omni, allowed: pinhole | fisheye");
  await refused({ model: "fisheye", distortion: [0, 0, 0, 0, 0] }, /distortion: 0,0,0,0,0, expected up to 4 numbers/);
  await refused({ distortion: [200] }, "camera: distortion coefficient: 200, allowed: -100 to 100");
  await assert.rejects(Odometry.create({ camera, seed: -1 }), { message: /^seed: -1/ });
  await assert.rejects(Odometry.create({ camera, wasm: new URL("none.wasm", import.meta.url) }), /none.wasm/);
});

test("an image, a time or a sample that is refused changes nothing", async () => {
  const odometry = await Odometry.create({ camera, wasm: await WebAssembly.compile(readFileSync(new URL("../dist/oaslam_odometry.wasm", import.meta.url))) });
  const refused = (image, time, samples, message) => assert.throws(() => odometry.process(image, time, samples), { message });
  refused(new Uint8Array(100), 0, [], "odometry: an image of 100 bytes, expected 320 x 240 = 76800");
  refused({ width: 240, height: 320, data: new Uint8ClampedArray(4 * 76800) }, 0, [], "odometry: an image of 240 x 320, expected 320 x 240");
  assert.equal(odometry.process(wall(0), 1).image, 0);
  refused(wall(2), 1, [], "odometry: time stamp 1.000000 is not after the one before, 1.000000");
  refused(wall(2), NaN, [], "odometry: time stamp: must be finite");
  refused(wall(2), 2, [[0, 200, 0, 0]], "odometry: angular velocity: 200 rad/s, allowed: 0 to 100");
  refused(wall(2), 2, [[0, 0, 0, 0], [0, 0, 0, 0]], /is not after the one before/);
  refused(wall(2), 2, [[0, 200, 0, 0, 0, -9.8, 0]], "odometry: angular velocity: 200 rad/s, allowed: 0 to 100");
  refused(wall(2), 2, [[0, 0, 0, 0, 0, 0, 0], [1, 0, 0, 0, 0, 9810, 0]], "odometry: acceleration: 9810 m/s^2, allowed: 0 to 1000");
  refused(wall(2), 2, [[0, 0, 0, 0, NaN, 0, 0]], /^odometry: acceleration: nan/);
  refused(wall(2), 2, [[0, 0, 0]], "odometry: sample 0: 3 numbers, expected 4 in each, or 7 in each");
  refused(wall(2), 2, [[0, 0, 0, 0, 0, 0, 0], [1, 0, 0, 0]], "odometry: sample 1: 4 numbers, expected 4 in each, or 7 in each");
  const told = odometry.process(wall(2), 2, [[1, 0, 0, 0], [2, 0, 0, 0]]);
  assert.deepEqual([told.image, told.metresPerUnit, told.metreSigma, told.gravity], [1, null, null, null]);
  odometry.delete();
  odometry.delete();
  refused(wall(4), 3, [], "odometry: was deleted");
});
