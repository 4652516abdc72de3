/**
 * The corners of a camera's image at a depth, in the camera's frame.
 * @param {import("./messages").Lens} camera
 * @returns {import("./messages").Triple[]}
 */
export function frustumCorners(camera, depth) {
  /** @returns {import("./messages").Triple} */
  const corner = (x, y) => [(((x - 0.5 - camera.cx) / camera.fx) * depth), ((y - 0.5 - camera.cy) / camera.fy) * depth, depth];
  return [corner(0, 0), corner(camera.width, 0), corner(camera.width, camera.height), corner(0, camera.height)];
}

export const DEFAULT_CAMERA = { width: 640, height: 480, fx: 540, fy: 540, cx: 319.5, cy: 239.5 };

/** Line segments of the outline: pairs of points in the camera's frame. @param {import("./messages").Lens} camera @returns {import("./messages").Triple[]} */
export function frustumLines(camera, depth) {
  const [a, b, c, d] = frustumCorners(camera, depth);
  /** @type {import("./messages").Triple} */
  const o = [0, 0, 0];
  return [o, a, o, b, o, c, o, d, a, b, b, c, c, d, d, a];
}
