/** @import { Lens, Pixel, Pose } from "./messages" */
import { Quaternion, Vector3 } from "three";

/** From the axes of images (x right, y down, z forward) to those of three.js. */
export const FLIP = new Quaternion(1, 0, 0, 0);

/**
 * Makes a camera of three.js project as that of an image does, whose place on a canvas of a size is `area`.
 * @param {import("three").Camera} camera  @param {Lens} lens  @param {import("./image_area.js").ImageArea} area
 * @param {{ width: number, height: number, near: number, far: number }} view
 */
export function setProjection(camera, { fx, fy, cx, cy }, area, { width, height, near, far }) {
  const principal = area.toElement([cx, cy]);
  camera.projectionMatrix.set(
    (2 * fx * area.scale) / width, 0, 1 - (2 * principal.x) / width, 0,
    0, (2 * fy * area.scale) / height, (2 * principal.y) / height - 1, 0,
    0, 0, -(far + near) / (far - near), (-2 * far * near) / (far - near),
    0, 0, -1, 0);
  camera.projectionMatrixInverse.copy(camera.projectionMatrix).invert();
}

/** The ray from a camera through a pixel, in the frame of its pose. @param {Pixel} pixel  @param {Pose} pose  @param {Lens} lens */
export function rayThrough([u, v], pose, lens) {
  const direction = new Vector3((u - lens.cx) / lens.fx, (v - lens.cy) / lens.fy, 1).normalize().applyQuaternion(new Quaternion().fromArray(pose));
  return { origin: new Vector3().fromArray(pose, 4), direction };
}
