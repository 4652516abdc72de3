// Rotations and rigid motions as plain numbers. A rotation is a unit quaternion [x, y, z, w]; a pose maps the axes of a camera into a frame:
// x_frame = rotation * x_camera + position.

/** @typedef {import("../messages").Triple} Triple @typedef {import("../messages").Quaternion} Quaternion @typedef {import("../messages").WirePose} Pose */
/**
 * A motion in the axes of the pose where it begins; the rotation is a vector: its axis times its angle.
 * @typedef {{ translation: Triple, rotation: Triple }} Motion
 */

/** @returns {Triple} */
export const add = (a, b, factor = 1) => [a[0] + factor * b[0], a[1] + factor * b[1], a[2] + factor * b[2]];
/** @returns {Triple} */
export const minus = (a, b) => add(a, b, -1);
export const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
export const length = (a) => Math.hypot(a[0], a[1], a[2]);

/** The rotation by b, then by a. @returns {Quaternion} */
export function multiply([ax, ay, az, aw], [bx, by, bz, bw]) {
  return [aw * bx + ax * bw + ay * bz - az * by, aw * by + ay * bw + az * bx - ax * bz, aw * bz + az * bw + ax * by - ay * bx, aw * bw - ax * bx - ay * by - az * bz];
}

/** @returns {Quaternion} */
export const conjugate = ([x, y, z, w]) => [-x, -y, -z, w];

/** @returns {Quaternion} */
export function normalized(q) {
  const scale = 1 / Math.hypot(q[0], q[1], q[2], q[3]);
  return [q[0] * scale, q[1] * scale, q[2] * scale, q[3] * scale];
}

/** @returns {Triple} */
export function rotate([x, y, z, w], [a, b, c]) {
  const [tx, ty, tz] = [2 * (y * c - z * b), 2 * (z * a - x * c), 2 * (x * b - y * a)];
  return [a + w * tx + y * tz - z * ty, b + w * ty + z * tx - x * tz, c + w * tz + x * ty - y * tx];
}

/** The axis of a rotation times its angle, which is at most pi. @returns {Triple} */
export function rotationVector([x, y, z, w]) {
  const sin = Math.hypot(x, y, z);
  const factor = (w < 0 ? -1 : 1) * (sin > 1e-9 ? (2 * Math.atan2(sin, Math.abs(w))) / sin : 2);
  return [factor * x, factor * y, factor * z];
}

/** @returns {Quaternion} */
export function ofRotationVector(v) {
  const angle = length(v);
  const factor = angle > 1e-9 ? Math.sin(angle / 2) / angle : 0.5;
  return normalized([factor * v[0], factor * v[1], factor * v[2], Math.cos(angle / 2)]);
}

/** The pose in the frame of a: where b is in the axes of a. @param {Pose} a  @param {Pose} b  @returns {Pose} */
export const compose = (a, b) => ({ position: add(a.position, rotate(a.rotation, b.position)), rotation: normalized(multiply(a.rotation, b.rotation)) });

/** @param {Pose} pose  @returns {Pose} */
export function inverse({ position, rotation }) {
  const back = conjugate(rotation);
  const [x, y, z] = rotate(back, position);
  return { position: [-x, -y, -z], rotation: back };
}

/** @param {Pose} from  @param {Pose} to  @returns {Motion} */
export function between(from, to) {
  const back = conjugate(from.rotation);
  return { translation: rotate(back, minus(to.position, from.position)), rotation: rotationVector(multiply(back, to.rotation)) };
}

/** The pose after a share of a motion. @param {Pose} pose  @param {Motion} motion  @returns {Pose} */
export function moved({ position, rotation }, { translation, rotation: turn }, share = 1) {
  return {
    position: add(position, rotate(rotation, translation), share),
    rotation: normalized(multiply(rotation, ofRotationVector([share * turn[0], share * turn[1], share * turn[2]]))),
  };
}
