// odometry_module.mjs MODULE CAMERA SAMPLES FOLDER: gives the odometry for browsers the images of FOLDER, and prints as JSON how
// what it tells differs from what the native one told of them (odometry_estimates.cc), and how long it took. Writes its trajectory
// to FOLDER.
import { openSync, readFileSync, readSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { pathToFileURL } from "node:url";

const [, , module, cameraText, samplesFile, folder] = process.argv;
const { Odometry } = await import(pathToFileURL(module).href);
const camera = JSON.parse(cameraText);
const METRE = 43, DOUBLES = 48, INTEGERS = 8; // of OaslamEstimate (bindings/wasm/odometry_js.h)

const bytesOf = (path) => new Uint8Array(readFileSync(path)); // a copy of its own, which is aligned
const doublesOf = (path) => new Float64Array(bytesOf(path).buffer);
const estimates = bytesOf(join(folder, "estimates"));
let read = 0;
function take(Type, length) {
  const begin = read;
  read += length * Type.BYTES_PER_ELEMENT;
  return new Type(estimates.slice(begin, read).buffer);
}
function nextNative() {
  const doubles = take(Float64Array, DOUBLES);
  const [state, run, image, keyframe, tracked, inliers, points] = take(Int32Array, INTEGERS);
  return {
    words: { state: ["preliminary", "tracking", "uncertain", "inertial", "blind"][state], run, image, keyframe: keyframe === 1, tracked, inliers },
    pose: { rotation: doubles.subarray(0, 4), translation: doubles.subarray(4, 7) }, covariance: doubles.subarray(7, METRE), metre: doubles.subarray(METRE),
    points: take(Float32Array, 3 * points),
  };
}

const bytes = (array) => Buffer.from(array.buffer, array.byteOffset, array.byteLength);
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const distance = (a, b) => Math.hypot(...Array.from(a, (x, i) => x - b[i]));
function center({ rotation: [x, y, z, w], translation }) {
  const axis = [-x, -y, -z];
  const once = cross(axis, translation);
  const twice = cross(axis, once.map((v, i) => v + w * translation[i]));
  return Array.from(translation, (v, i) => -(v + 2 * twice[i]));
}
const angle = (a, b) => 2 * Math.min(distance(a, b), distance(a, Array.from(b, (v) => -v)));

// `first`: the first image in which something is not the same, bit for bit. `position` in the odometry's unit, `rotation` in rad; `metre`: metres of its unit and their
// sigma, and gravity. `told`: the last of these, and how many images had them.
const result = { images: 0, bytes: 0, first: {}, position: 0, rotation: 0, px: 0, inverse_depth: 0, metre: 0, told: { images: 0 } };
function compareBits(what, native, estimate) {
  result.bytes += native.byteLength;
  if (!bytes(native).equals(bytes(estimate))) result.first[what] ??= result.images;
}
function most(what, difference) {
  result[what] = Math.max(result[what], difference);
}
function compareMetre(native, { metresPerUnit, metreSigma, gravity }) {
  const metre = Float64Array.from([metresPerUnit ?? 0, metreSigma ?? 0, ...(gravity ?? [0, 0, 0])]);
  compareBits("metre", native.metre, metre);
  most("metre", distance(native.metre, metre));
  if (metresPerUnit !== null) result.told = { images: result.told.images + 1, metres: metresPerUnit, sigma: metreSigma, gravity: Array.from(gravity) };
}
function compare(native, estimate) {
  for (const [key, value] of Object.entries(native.words)) if (estimate[key] !== value) result.first[key] ??= result.images;
  const pose = estimate.camFromOdom;
  if (pose) {
    for (const key of ["rotation", "translation"]) compareBits(key, native.pose[key], pose[key]);
    most("position", distance(center(native.pose), center(pose)));
    most("rotation", angle(native.pose.rotation, pose.rotation));
  }
  compareBits("covariance", native.covariance, estimate.covariance);
  compareMetre(native, estimate);
  compareBits("points", native.points, estimate.points);
  for (let i = 0; i < Math.min(native.points.length, estimate.points.length); i += 3) {
    most("px", distance(native.points.subarray(i, i + 2), estimate.points.subarray(i, i + 2)));
    most("inverse_depth", Math.abs(native.points[i + 2] - estimate.points[i + 2]));
  }
}

// Of the key points: how many there are, how many images differ in their places, octaves or descriptors, and the largest difference of an angle.
const features = { images: 0, count: 0, different: 0, angle: 0 };
const native = bytesOf(join(folder, "features"));
let readFeatures = 0;
function compareFeatures({ count, bytes }) {
  const [asked] = new Int32Array(native.slice(readFeatures, (readFeatures += 4)).buffer);
  const of = native.slice(readFeatures, (readFeatures += 45 * asked)), ours = bytes.slice();
  ++features.images;
  features.count += asked;
  if (count !== asked) return void ++features.different;
  const angles = 8 * count, octaves = 12 * count; // where they begin
  const same = (from, to) => Buffer.from(of.buffer, from, to - from).equals(Buffer.from(ours.buffer, from, to - from));
  if (!same(0, angles) || !same(octaves, 45 * count)) ++features.different;
  const [a, b] = [of, ours].map((all) => new Float32Array(all.slice(angles, octaves).buffer));
  for (let i = 0; i < count; ++i) features.angle = Math.max(features.angle, Math.abs(a[i] - b[i]));
}

const [columns, ...samples] = doublesOf(samplesFile);
const images = openSync(join(folder, "images"));
const grey = new Uint8Array(camera.width * camera.height);
const odometry = await Odometry.create({ camera });
const trajectory = [], ms = [];
let sample = 0;
for (const time of doublesOf(join(folder, "times"))) {
  readSync(images, grey, 0, grey.length, null);
  const given = [];
  for (; sample < samples.length && samples[sample] <= time + 0.1; sample += columns) given.push(samples.slice(sample, sample + columns));
  const start = performance.now();
  const estimate = odometry.process(grey, time, given);
  ms.push(performance.now() - start);
  compare(nextNative(), estimate);
  if (result.images++ % 50 === 0) compareFeatures(odometry.features(1000));
  if (!estimate.camFromOdom) continue;
  const [x, y, z, w] = estimate.camFromOdom.rotation;
  trajectory.push([time, ...center(estimate.camFromOdom), -x, -y, -z, w].join(" ") + "\n");
}
odometry.delete();
writeFileSync(join(folder, "trajectory.txt"), trajectory.join(""));
ms.sort((a, b) => a - b);
result.ms = { median: ms[Math.floor(ms.length / 2)], most_of_99_percent: ms[Math.floor(ms.length * 0.99)] };
console.log(JSON.stringify({ ...result, features }));
