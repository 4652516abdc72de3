// Where the camera is now, from earlier poses. A pose is [qx, qy, qz, qw, x, y, z], camera to map; times are in seconds.
import { Quaternion, Vector3 } from "three";

/**
 * The motion from one pose to another, in the axes of the first; the rotation is a vector: its axis times its angle.
 * @typedef {{ rotation: Vector3, translation: Vector3 }} Motion
 * @param {number[]} from  @param {number[]} to
 * @returns {Motion}
 */
export function between(from, to) {
  const inverse = new Quaternion().fromArray(from).invert();
  const turn = inverse.clone().multiply(new Quaternion().fromArray(to)).normalize();
  if (turn.w < 0) turn.set(-turn.x, -turn.y, -turn.z, -turn.w);
  const sin = Math.hypot(turn.x, turn.y, turn.z);
  const rotation = new Vector3(turn.x, turn.y, turn.z).multiplyScalar(sin > 1e-9 ? (2 * Math.atan2(sin, turn.w)) / sin : 2);
  const translation = new Vector3().fromArray(to, 4).sub(new Vector3().fromArray(from, 4)).applyQuaternion(inverse);
  return { rotation, translation };
}

/** The pose after a share of a motion. @param {number[]} pose  @param {Motion} motion */
export function moved(pose, { rotation, translation }, share = 1) {
  const q = new Quaternion().fromArray(pose);
  const angle = rotation.length() * share;
  const axis = rotation.lengthSq() > 0 ? rotation.clone().normalize() : new Vector3(1, 0, 0);
  const p = translation.clone().multiplyScalar(share).applyQuaternion(q).add(new Vector3().fromArray(pose, 4));
  return [...q.multiply(new Quaternion().setFromAxisAngle(axis, angle)).normalize().toArray(), ...p.toArray()];
}

/** @param {Motion} motion */
const scaled = ({ rotation, translation }, factor) => ({ rotation: rotation.clone().multiplyScalar(factor), translation: translation.clone().multiplyScalar(factor) });

// The motion follows from the poses of the last `short` seconds, and from the last few within `long` seconds where answers are slow. Hands tremble:
// more poses would average over a motion that has changed.
const SPAN = { short: 0.12, long: 0.4, poses: 3 };
const MAX_LEAD = 0.25; // seconds after which a motion is not assumed to go on
const MAX_AGE = 1.2; // seconds without a pose after which none is given
const EASE = 0.05; // seconds in which most of a correction is made
const MAX_CORRECTION = { angle: 0.5, share: 0.4 }; // radians, and of the depth of what is seen: a larger jump is another place, not an error

/** Follows the camera by poses that come late: extends the motion of the last ones, and makes corrections gradually, so that content does not jump. */
export class MotionFilter {
  /** @type {{ pose: number[], time: number }[]} */ poses; // ascending
  /** @type {{ motion: Motion, since: number } | null} */ correction; // from the predicted pose to the one that was shown
  /** @type {number | null} */ shownAt; // the time of the pose that was shown last

  constructor() {
    this.reset();
  }

  reset() {
    this.poses = [];
    this.depth = 1;
    this.correction = null;
    this.shownAt = null;
  }

  // Adds a pose, and the depth of what is seen there (map units). One that is older than the last is ignored.
  add(pose, time, depth) {
    const last = this.poses.at(-1);
    if (last && time <= last.time) return;
    if (depth > 0) this.depth = depth;
    const expected = this.at(time);
    const { shownAt } = this;
    const shown = shownAt === null ? null : this.at(shownAt);
    this.correction = null;
    if (!expected || this.isElsewhere(between(expected, pose))) this.poses = [];
    this.poses.push({ pose, time });
    this.poses = this.poses.filter((each, i, { length }) => time - each.time <= (length - i <= SPAN.poses ? SPAN.long : SPAN.short));
    if (shownAt === null || !shown) return;
    const motion = between(this.predict({ pose, time }, shownAt), shown);
    if (!this.isElsewhere(motion)) this.correction = { motion, since: shownAt };
  }

  isElsewhere({ rotation, translation }) {
    return rotation.length() > MAX_CORRECTION.angle || translation.length() > MAX_CORRECTION.share * this.depth;
  }

  // The motion in a second at the newest pose, by least squares over the last ones.
  velocity({ pose: last, time: now }) {
    const sum = { rotation: new Vector3(), translation: new Vector3() };
    let weight = 0;
    for (const { pose, time } of this.poses.slice(0, -1)) {
      const { rotation, translation } = between(last, pose);
      sum.rotation.addScaledVector(rotation, time - now);
      sum.translation.addScaledVector(translation, time - now);
      weight += (time - now) ** 2;
    }
    return weight > 0 ? scaled(sum, 1 / weight) : sum;
  }

  predict(last, time) {
    return moved(last.pose, this.velocity(last), Math.max(-MAX_LEAD, Math.min(time - last.time, MAX_LEAD)));
  }

  // The pose at a time, null where it is not known.
  at(time) {
    const last = this.poses.at(-1);
    if (!last || time - last.time > MAX_AGE) return null;
    const pose = this.predict(last, time);
    if (!this.correction) return pose;
    return moved(pose, this.correction.motion, Math.exp(-Math.max(0, time - this.correction.since) / EASE));
  }

  // The pose at a time, which is shown: later corrections start from it.
  show(time) {
    const pose = this.at(time);
    this.shownAt = pose ? time : null;
    return pose;
  }
}
