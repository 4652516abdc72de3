// What is known exactly of a clip of data/sample: where its camera was, and where the desk's top is.
import { readFileSync } from "node:fs";

export const SIZE = { width: 640, height: 480 };
export const FOCAL = 525, CENTER = [319.5, 239.5];
const DESK_TOP = 0.74; // metres

const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
function rotate([x, y, z, w], v) {
  const t = cross([x, y, z], v).map((c) => 2 * c);
  const u = cross([x, y, z], t);
  return v.map((c, i) => c + w * t[i] + u[i]);
}
const inverse = ([x, y, z, w]) => [-x, -y, -z, w];

/** The poses of the camera, an image each: { position, rotation }, camera to world. */
export function posesOf(clip) {
  const rows = readFileSync(`${clip}/groundtruth.txt`, "utf8").split("\n").filter((line) => /^\d/.test(line));
  return rows.map((row) => row.split(" ").map(Number)).map(([, x, y, z, ...rotation]) => ({ position: [x, y, z], rotation }));
}

/** The direction of a pixel's ray, in the world of the pose. */
export const rayOf = ({ rotation }, [u, v]) => rotate(rotation, [(u - CENTER[0]) / FOCAL, (v - CENTER[1]) / FOCAL, 1]);

/** Where the ray of a pixel meets the top of the desk. */
export function onDesk({ position, rotation }, pixel) {
  const ray = rayOf({ rotation }, pixel);
  const t = (DESK_TOP - position[2]) / ray[2];
  return position.map((p, i) => p + t * ray[i]);
}

export function pixelOf({ position, rotation }, point) {
  const [x, y, z] = rotate(inverse(rotation), point.map((p, i) => p - position[i]));
  return [(FOCAL * x) / z + CENTER[0], (FOCAL * y) / z + CENTER[1]];
}

export const distanceTo = ({ position }, point) => Math.hypot(...point.map((p, i) => p - position[i]));

/** Gravity in the camera's axes, m/s2. */
export const gravityIn = ({ rotation }) => rotate(inverse(rotation), [0, 0, -9.81]);
