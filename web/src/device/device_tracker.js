// @ts-nocheck: STAND-IN until branch w48_device is merged
import { Odometry } from "../odometry/oaslam_odometry.js";
const conj = ([x, y, z, w]) => [-x, -y, -z, w];
function rotate([x, y, z, w], [a, b, c]) {
  const tx = 2 * (y * c - z * b), ty = 2 * (z * a - x * c), tz = 2 * (x * b - y * a);
  return [a + w * tx + y * tz - z * ty, b + w * ty + z * tx - x * tz, c + w * tz + x * ty - y * tx];
}
/** @typedef {{ position: number[], rotation: number[] }} Pose */
/** @typedef {{ time: number, state: string, camera: import("../odometry/oaslam_odometry.js").Camera | null, pose: Pose | null, world: "map" | "odometry" | null, age: number | null, sigma: number, points: Float32Array }} Tracked */
export class DeviceTracker extends EventTarget {
  odometry = null; last = null; run = -1;
  /** @param {{ camera?: any, wasm?: any, worker?: any, service?: { url: string, map: string, token?: string }, share?: "images" | "features" }} options */
  constructor({ camera = null, wasm } = {}) { super(); this.camera = camera; this.wasm = wasm; }
  /** @param {{ image: ImageData, time: number, gyroscope?: any, gravity?: any, jpeg?: () => Promise<Uint8Array> }} p  @returns {Promise<Tracked>} */
  async process({ image, time, gyroscope }) {
    const { width, height } = image;
    if (!this.camera) { const f = Math.max(width, height) / 2 / Math.tan(Math.PI / 6); this.camera = { width, height, fx: f, fy: f, cx: (width - 1) / 2, cy: (height - 1) / 2 }; }
    this.odometry ??= await Odometry.create({ camera: this.camera, ...(this.wasm && { wasm: this.wasm }) });
    const e = this.odometry.process(image, time, gyroscope);
    let pose = null;
    if (e.camFromOdom) {
      const q = conj([...e.camFromOdom.rotation]);
      pose = { rotation: q, position: rotate(q, [...e.camFromOdom.translation]).map((v) => -v) };
    }
    if (e.run !== this.run) { this.run = e.run; this.dispatchEvent(new Event("run")); }
    return (this.last = { time, state: e.state, camera: this.camera, pose, world: pose ? "odometry" : null, age: 0, sigma: 0, points: e.points.slice() });
  }
  /** @param {number} x @param {number} y @returns {{ position: number[], normal?: number[] } | null} */
  hit(x, y) {
    const { pose, points, camera: c } = this.last ?? {};
    if (!pose || points.length < 9) return null;
    const all = [];
    for (let i = 0; i < points.length; i += 3) all.push([Math.hypot(points[i] - x, points[i + 1] - y), points[i + 2]]);
    const near = all.sort((a, b) => a[0] - b[0]).slice(0, 7).map((p) => p[1]).sort((a, b) => a - b);
    const d = 1 / near[3];
    const p = rotate(pose.rotation, [((x - c.cx) / c.fx) * d, ((y - c.cy) / c.fy) * d, d]);
    return { position: p.map((v, i) => v + pose.position[i]) };
  }
  delete() { this.odometry?.delete(); this.odometry = null; }
}
