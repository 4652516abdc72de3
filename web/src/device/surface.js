// Where a ray meets what the odometry sees.
/** @import { Lens, Triple } from "../messages" */
import { rayOf } from "./lens.js";
import { length } from "./rigid.js";

const NEAREST = 16; // points that a plane is laid through
const FAR = 0.25; // of the focal length: points further from the ray say nothing about its surface
const LEAST = 4;
const CLOSE = 0.02; // of the focal length: points nearer than this are alike
const ROUNDS = 6; // of least squares
const OFF = 0.05; // of the depth: by how much a point may be off its surface

/**
 * The depth (z) at which the ray meets the plane through the nearest points, and the plane's normal towards the camera; in the camera's axes. Null without
 * points near it.
 * @param {Triple} ray z = 1  @param {ArrayLike<number>} points x, y and inverse depth each  @param {Lens} camera
 * @returns {{ depth: number, normal: Triple } | null}
 */
export function surfaceAt(ray, points, camera) {
  /** @type {{ x: number, y: number, inverse: number, far: number }[]} */
  const near = [];
  for (let i = 0; i + 2 < points.length; i += 3) {
    const [x, y] = rayOf(camera, [points[i], points[i + 1]]);
    const far = Math.hypot(x - ray[0], y - ray[1]);
    if (far < FAR && points[i + 2] > 0) near.push({ x: x - ray[0], y: y - ray[1], inverse: points[i + 2], far });
  }
  near.sort((a, b) => a.far - b.far).splice(NEAREST);
  if (near.length < LEAST) return null;
  // The nearest points say most: those further away may be of things that stand before or behind.
  const reach = Math.max(near[LEAST - 1].far, CLOSE);
  const share = near.map(({ far }) => 1 / (1 + (far / reach) ** 2) ** 2);
  const middle = medianOf(near, share);
  // Points of other surfaces lose their weight.
  let [a, b, c] = [0, 0, middle];
  let weights = share;
  for (let i = 0; i < ROUNDS; ++i) {
    [a, b, c] = planeOf(near, weights) ?? [0, 0, middle];
    weights = near.map((p, k) => share[k] / (1 + ((a * p.x + b * p.y + c - p.inverse) / (OFF * middle)) ** 2) ** 2);
  }
  // Where the plane is steep it may lie behind or far before the points.
  const isSound = c > 0.7 * middle && c < 1.4 * middle;
  // a (x - ray x) + b (y - ray y) + c = 1 / z is a plane in space.
  /** @type {Triple} */
  const normal = isSound ? [-a, -b, a * ray[0] + b * ray[1] - c] : [-ray[0], -ray[1], -ray[2]];
  const scale = 1 / length(normal);
  return { depth: 1 / (isSound ? c : middle), normal: [normal[0] * scale, normal[1] * scale, normal[2] * scale] };
}

// Of the inverse depths.
function medianOf(points, weights) {
  const order = points.map(({ inverse }, i) => ({ inverse, weight: weights[i] })).sort((a, b) => a.inverse - b.inverse);
  let left = weights.reduce((sum, weight) => sum + weight, 0) / 2;
  return (order.find(({ weight }) => (left -= weight) <= 0) ?? order[order.length - 1]).inverse;
}

// The inverse depth as a linear function of x and y, by least squares; null where the points lie on a line.
function planeOf(points, weights) {
  const total = weights.reduce((sum, weight) => sum + weight, 0);
  const mean = (of) => points.reduce((sum, p, i) => sum + weights[i] * of(p), 0) / total;
  const [mx, my, mi] = [mean((p) => p.x), mean((p) => p.y), mean((p) => p.inverse)];
  const [xx, xy, yy] = [mean((p) => (p.x - mx) ** 2), mean((p) => (p.x - mx) * (p.y - my)), mean((p) => (p.y - my) ** 2)];
  const [xi, yi] = [mean((p) => (p.x - mx) * (p.inverse - mi)), mean((p) => (p.y - my) * (p.inverse - mi))];
  const determinant = xx * yy - xy * xy;
  if (determinant < 0.02 * (xx + yy) ** 2) return null;
  const a = (yy * xi - xy * yi) / determinant, b = (xx * yi - xy * xi) / determinant;
  return [a, b, mi - a * mx - b * my];
}
