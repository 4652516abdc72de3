// Lenses by OpenCV's models (docs/formats.md). Pixel centres are at integer coordinates.
/** @import { Lens, Pixel, Triple } from "../messages" */

const STEPS = 20; // of the iteration: a wide lens needs some ten

// Where a ray with z = 1 is in the image, in units of the focal length from the principal point.
/** @param {number[]} at  @param {Lens} camera */
function distorted([x, y], { model, distortion = [] }) {
  const [a = 0, b = 0, c = 0, d = 0, e = 0] = distortion;
  const r2 = x * x + y * y;
  if (model === "fisheye") {
    const r = Math.sqrt(r2);
    if (r < 1e-9) return [x, y];
    const angle = Math.atan(r), a2 = angle * angle;
    const factor = (angle * (1 + a2 * (a + a2 * (b + a2 * (c + a2 * d))))) / r;
    return [x * factor, y * factor];
  }
  const radial = 1 + r2 * (a + r2 * (b + r2 * e));
  return [x * radial + 2 * c * x * y + d * (r2 + 2 * x * x), y * radial + c * (r2 + 2 * y * y) + 2 * d * x * y];
}

/** The ray of a pixel, in the camera's axes, with z = 1. @param {Lens} camera  @param {Pixel} pixel  @returns {Triple} */
export function rayOf(camera, [u, v]) {
  const at = [(u - camera.cx) / camera.fx, (v - camera.cy) / camera.fy];
  let [x, y] = at;
  if (!camera.distortion?.some(Boolean) && camera.model !== "fisheye") return [x, y, 1];
  for (let i = 0; i < STEPS; ++i) {
    const [p, q] = distorted([x, y], camera);
    x += at[0] - p;
    y += at[1] - q;
  }
  return [x, y, 1];
}

/** The camera of an image of this size while nothing is known of its lens: 60 degrees along the longer side, as phones mostly have. @returns {Lens} */
export function guessedCamera(width, height) {
  const f = Math.max(width, height) / (2 * Math.tan(Math.PI / 6));
  return { width, height, fx: f, fy: f, cx: (width - 1) / 2, cy: (height - 1) / 2 };
}

/** The same camera for images of another size. @param {Lens} camera  @returns {Lens} */
export function scaledCamera(camera, width, height) {
  const [sx, sy] = [width / camera.width, height / camera.height];
  return { ...camera, width, height, fx: camera.fx * sx, fy: camera.fy * sy, cx: (camera.cx + 0.5) * sx - 0.5, cy: (camera.cy + 0.5) * sy - 0.5 };
}
