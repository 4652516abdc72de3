// Where the camera is now, from poses of the past. A pose is [qx, qy, qz, qw, x, y, z], camera to map; times are in seconds.
import { Quaternion, Vector3 } from "three";

// The rotation (as a vector: axis times angle) and translation from one pose to another, in the axes of the first.
export function between(from, to) {
  const inverse = new Quaternion().fromArray(from).invert();
  const turn = inverse.clone().multiply(new Quaternion().fromArray(to)).normalize();
  if (turn.w < 0) turn.set(-turn.x, -turn.y, -turn.z, -turn.w);
  const sin = Math.hypot(turn.x, turn.y, turn.z);
  const rotation = new Vector3(turn.x, turn.y, turn.z).multiplyScalar(sin > 1e-9 ? (2 * Math.atan2(sin, turn.w)) / sin : 2);
  const translation = new Vector3().fromArray(to, 4).sub(new Vector3().fromArray(from, 4)).applyQuaternion(inverse);
  return { rotation, translation };
}

// The pose after a share of such a motion.
export function moved(pose, { rotation, translation }, share = 1) {
  const q = new Quaternion().fromArray(pose);
  const angle = rotation.length() * share;
  const axis = rotation.lengthSq() > 0 ? rotation.clone().normalize() : new Vector3(1, 0, 0);
  const p = translation.clone().multiplyScalar(share).applyQuaternion(q).add(new Vector3().fromArray(pose, 4));
  return [...q.multiply(new Quaternion().setFromAxisAngle(axis, angle)).normalize().toArray(), ...p.toArray()];
}

const scaled = ({ rotation, translation }, factor) => ({ rotation: rotation.clone().multiplyScalar(factor), translation: translation.clone().multiplyScalar(factor) });

const SPAN = { short: 0.12, long: 0.4, poses: 3 }; // seconds of poses that tell the motion; of the long one only so many: hands tremble
const MAX_LEAD = 0.25; // seconds: beyond, the motion is not known to go on
const MAX_AGE = 1.2; // seconds without a pose after which none is given
const EASE = 0.05; // seconds in which most of a correction is made
const MAX_CORRECTION = { angle: 0.5, share: 0.4 }; // radians, and of the depth of what is seen: what is more is another place

// Follows the camera by poses that come late: goes on with the motion of the last ones, and makes corrections little by little, so that nothing jumps.
export class MotionFilter {
  constructor() {
    this.reset();
  }

  reset() {
    this.poses = []; // { pose, time }, ascending
    this.depth = 1;
    this.correction = null; // from what follows from the poses to what was shown: { motion, since }
    this.shownAt = null; // the time of what was shown last
  }

  // A pose, and the depth of what is seen there (map units). One that is older than the last is of no use.
  add(pose, time, depth) {
    if (this.poses.length > 0 && time <= this.poses.at(-1).time) return;
    if (depth > 0) this.depth = depth;
    const expected = this.at(time);
    const shown = this.shownAt === null ? null : this.at(this.shownAt);
    this.correction = null;
    if (!expected || this.isElsewhere(between(expected, pose))) this.poses = [];
    this.poses.push({ pose, time });
    this.poses = this.poses.filter((each, i, { length }) => time - each.time <= (length - i <= SPAN.poses ? SPAN.long : SPAN.short));
    const motion = shown && between(this.predict(this.shownAt), shown);
    if (motion && !this.isElsewhere(motion)) this.correction = { motion, since: this.shownAt };
  }

  isElsewhere({ rotation, translation }) {
    return rotation.length() > MAX_CORRECTION.angle || translation.length() > MAX_CORRECTION.share * this.depth;
  }

  // The motion in a second, by least squares over the last poses.
  velocity() {
    const { pose: last, time: now } = this.poses.at(-1);
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

  predict(time) {
    const last = this.poses.at(-1);
    return moved(last.pose, this.velocity(), Math.max(-MAX_LEAD, Math.min(time - last.time, MAX_LEAD)));
  }

  // The pose of a moment, null where it is not known.
  at(time) {
    const last = this.poses.at(-1);
    if (!last || time - last.time > MAX_AGE) return null;
    const pose = this.predict(time);
    if (!this.correction) return pose;
    return moved(pose, this.correction.motion, Math.exp(-Math.max(0, time - this.correction.since) / EASE));
  }

  // The same, for showing it.
  show(time) {
    const pose = this.at(time);
    this.shownAt = pose ? time : null;
    return pose;
  }
}
