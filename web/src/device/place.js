// How the frame of a device's odometry lies in a map, by the service's answers for some of its images: a similarity, which gives each image of the odometry
// its pose in the map. Lengths of the odometry are in its own unit. Times are in seconds.
import { add, between, compose, conjugate, dot, inverse, length, minus, moved, multiply, normalized, rotate } from "./rigid.js";

/** @import { Answer, Motion as SentMotion, Triple, Quaternion, WirePose } from "../messages" */
/** @import { Estimate } from "../odometry/oaslam_odometry.js" */

/**
 * An image as the odometry saw it. `pose`: of the camera, in the odometry's frame. `keyframes`: those that were corrected then, ascending by image.
 * `way` and `turn`: how far the camera has moved and turned since the run began. `depth`: the median of the points; 0 where none is known.
 * @typedef {object} Sighting
 * @property {number} time
 * @property {number} run
 * @property {number} image
 * @property {WirePose} pose
 * @property {boolean} isPreliminary
 * @property {{ image: number, pose: WirePose }[]} keyframes
 * @property {number} way
 * @property {number} turn
 * @property {number} depth
 */
/**
 * An answer and the image it is for. `pose`: of the camera in the odometry's frame, as the odometry knows it by now.
 * @typedef {object} Known
 * @property {Sighting} sighting
 * @property {WirePose} pose
 * @property {WirePose} inMap
 * @property {number} position sigma, map units
 * @property {number} rotation sigma, rad
 * @property {number} unit map units in one of the odometry
 * @property {number} unitSigma as a share of it
 * @property {number} depth map units
 */
/**
 * x_map = scale * rotation * (x_odometry - middle) + position.
 * @typedef {object} Similarity
 * @property {number} scale
 * @property {Quaternion} rotation
 * @property {Triple} middle
 * @property {Triple} position
 * @property {{ position: number, rotation: number, scale: number }} sigma `scale`: as a share of it
 * @property {{ position: number, rotation: number }} drift what of that the odometry has added since the answers
 */

// The errors of the odometry, as shares of the way, of the depth and of the turn (core/oaslam/map/motion_sigmas.h).
const WAY = 0.01, DEPTH = 0.001, TURN = 0.0025, LEAST_TURN = 0.0005;
const PRELIMINARY = 1; // share of the way while the motion is preliminary: a turn may be taken for a way
const GUESS = 0.3; // of a unit that is only the quotient of two median depths
const UNIT = 0.03; // the error of the unit that the service tells
const MOST_UNITS = 4; // their errors have much in common
const SCALE = 0.004; // by how much the odometry's scale changes from place to place
const SCALE_SECONDS = 20;
// Of a position by one image, as a share of the depth, and of a rotation in rad: neighbouring answers have errors in common.
const LEAST_POSITION = 0.001;
// What of the error of an answer is its own; the rest it has in common with its neighbours, which see the same landmarks: averaging does not help there.
const OWN = 0.3;
const MOST_ANSWERS = 24; // the oldest ones say little about where the camera is now
const SURE = 0.9; // confidence with which a single answer is believed where there was none before
const OUTLIER = 4; // sigmas from what is known already
const EASE = 0.3; // seconds in which a correction is made
const ELSEWHERE = { angle: 0.5, share: 0.4 }; // radians, and of the depth: a larger correction is another place, and is made at once

const SEEN = new Set(["tracking", "relocalized", "objects"]); // states of answers that saw the map

/** @param {Float64Array | number[]} rows */
const keyframesOf = (rows) => Array.from({ length: rows.length / 8 }, (_, i) => ({ image: rows[8 * i], pose: poseOfRow(rows, 8 * i + 1) }));
/** @returns {WirePose} */
const poseOfRow = (r, at) => ({ position: [r[at], r[at + 1], r[at + 2]], rotation: [r[at + 3], r[at + 4], r[at + 5], r[at + 6]] });
/** @param {import("../odometry/oaslam_odometry.js").Pose} pose  @returns {WirePose} */
const poseOfEstimate = ({ rotation: [x, y, z, w], translation: [a, b, c] }) => inverse({ position: [a, b, c], rotation: [x, y, z, w] });

/** The median inverse depth of points (x, y, inverse depth each) as a depth; 0 without any. @param {ArrayLike<number>} points */
function medianDepth(points) {
  const inverse = new Float64Array(points.length / 3);
  for (let i = 0; i < inverse.length; ++i) inverse[i] = points[3 * i + 2];
  return inverse.length > 0 ? 1 / inverse.sort()[inverse.length >> 1] : 0;
}

/**
 * Where an earlier image was, as the odometry knows it with image `now`: it moves with the last keyframe before it that both know. Null where there is none.
 * @param {Sighting} earlier  @param {Sighting} now
 */
export function correctedPose(earlier, now) {
  let i = now.keyframes.length - 1;
  for (let k = earlier.keyframes.length - 1; k >= 0; --k) {
    const then = earlier.keyframes[k];
    while (i >= 0 && now.keyframes[i].image > then.image) --i;
    if (i >= 0 && now.keyframes[i].image === then.image) return compose(now.keyframes[i].pose, compose(inverse(then.pose), earlier.pose));
  }
  return null;
}

/** What the service is told of an image's motion. @param {Estimate} estimate  @returns {SentMotion | null} */
export function motionOf({ state, run, image, camFromOdom, keyframes, keyframe, points, tracked, inliers }) {
  if (!camFromOdom || (state !== "preliminary" && state !== "tracking")) return null;
  const rounded = (value, digits) => Number(value.toPrecision(digits));
  return {
    run,
    image,
    pose: poseOfEstimate(camFromOdom),
    preliminary: state === "preliminary",
    agreeing: inliers / Math.max(1, tracked),
    keyframes: Array.from({ length: keyframes.length / 8 }, (_, i) => Array.from(keyframes.subarray(8 * i, 8 * i + 8))),
    keyframe,
    depths: Array.from({ length: points.length / 3 }, (_, i) => [rounded(points[3 * i], 6), rounded(points[3 * i + 1], 6), rounded(points[3 * i + 2], 6)]),
  };
}

// The weighted mean of places in two frames.
class Mean {
  /** @type {Triple} */ from = [0, 0, 0];
  /** @type {Triple} */ to = [0, 0, 0];
  weight = 0;

  add(from, to, weight) {
    this.weight += weight;
    const share = weight / this.weight;
    this.from = add(this.from, minus(from, this.from), share);
    this.to = add(this.to, minus(to, this.to), share);
  }
}

export class Place {
  /** @type {Sighting | null} */ newest = null;
  /** @type {Known[]} */ known = []; // of this run, by time
  /** @type {Known | null} */ doubted = null; // an answer that does not fit the others, or that is not sure
  /** @type {Similarity | null} */ fit = null;
  /** @type {{ motion: import("./rigid.js").Motion, since: number } | null} */ correction = null; // from the pose that is known to the one that was shown
  depth = 0; // of what is seen, map units

  /** Forgets the map. */
  reset() {
    this.known = [];
    this.doubted = this.fit = this.correction = null;
  }

  /** Takes what the odometry tells of an image; null where it does not know the camera's pose. @param {Estimate} estimate  @param {number} time  @returns {Sighting | null} */
  see({ state, run, image, camFromOdom, keyframes, points }, time) {
    if (!camFromOdom) return null;
    let last = this.newest;
    if (last?.run !== run) {
      last = null; // nothing is known of how poses of different runs lie to each other
      this.reset();
    }
    const pose = poseOfEstimate(camFromOdom);
    const step = last ? between(last.pose, pose) : null;
    /** @type {Sighting} */
    const now = {
      time, run, image, pose,
      isPreliminary: state === "preliminary",
      keyframes: keyframesOf(keyframes),
      way: last && step ? last.way + length(step.translation) : 0,
      turn: last && step ? last.turn + length(step.rotation) : 0,
      depth: medianDepth(points),
    };
    this.newest = now;
    for (const each of this.doubted ? [...this.known, this.doubted] : this.known) each.pose = correctedPose(each.sighting, now) ?? each.pose;
    this.update();
    return now;
  }

  /**
   * Takes the answer for an image; returns whether it places the camera. `now`: the time of the moment, from which the correction is eased in.
   * @param {Answer} answer  @param {Sighting | null} sighting of that image  @param {number} now
   */
  take(answer, sighting, now) {
    const { newest } = this;
    if (!answer.pose || !SEEN.has(answer.state) || !sighting || sighting.run !== newest?.run) return false;
    // A pose that the service has from this odometry and earlier answers is no new evidence; and nothing can be weighed without a depth.
    if (answer.source === "registration" || !(answer.depth > 0)) return false;
    const known = this.knownOf(answer, sighting, newest);
    const wasGuess = !sighting.isPreliminary && this.known.every((each) => each.sighting.isPreliminary);
    const shown = this.fit && !wasGuess && this.poseOf(newest, now);
    const isExpected = this.fit ? this.fits(known, this.known) : (answer.confidence ?? 1) >= SURE;
    if (isExpected) this.known.push(known);
    else if (this.doubted && this.fits(known, [this.doubted])) this.known = [this.doubted, known];
    else {
      this.doubted = known;
      return false;
    }
    this.doubted = null;
    this.depth = known.depth;
    if (wasGuess) this.known = this.known.filter((each) => !each.sighting.isPreliminary);
    this.known.sort((a, b) => a.sighting.time - b.sighting.time);
    if (this.known.length > MOST_ANSWERS) this.known.shift();
    this.update();
    this.correction = null;
    const raw = this.rawPoseOf(newest);
    if (!shown || !raw) return true;
    const motion = between(raw, shown);
    if (length(motion.rotation) < ELSEWHERE.angle && length(motion.translation) < ELSEWHERE.share * this.depth) this.correction = { motion, since: now };
    return true;
  }

  /**
   * Where the camera was in the map, and what is known about that; null where it is not known. `age`: seconds since the last image for which an answer has placed
   * it. `sigma`: of the position, map units. `drift`: what of that the odometry has added since the answers. `depth`: of what was seen then, map units.
   * @param {Sighting | null} sighting  @param {number} now
   */
  poseOf(sighting, now) {
    const raw = sighting && this.rawPoseOf(sighting);
    if (!raw) return null;
    const left = this.correction ? 1 - Math.min(1, Math.max(0, (now - this.correction.since) / EASE)) : 0;
    const pose = this.correction && left > 0 ? moved(raw, this.correction.motion, left * left * (3 - 2 * left)) : raw;
    const { scale, middle, sigma, drift } = /** @type {Similarity} */ (this.fit);
    const far = scale * length(minus(sighting.pose.position, middle));
    const spread = (position, rotation) => Math.hypot(position, far * sigma.scale, far * rotation);
    const age = now - this.known[this.known.length - 1].sighting.time;
    return { ...pose, age, sigma: spread(sigma.position, sigma.rotation), drift: spread(drift.position, drift.rotation), depth: this.depth };
  }

  /** @param {Answer} answer  @param {Sighting} sighting  @param {Sighting} newest  @returns {Known} */
  knownOf({ pose, covariance, unit, depth }, sighting, newest) {
    const sigma = (first) => Math.sqrt(covariance ? (covariance[7 * first] + covariance[7 * first + 7] + covariance[7 * first + 14]) / 3 : 0);
    const guess = sighting.depth > 0 ? depth / sighting.depth : depth;
    return {
      sighting,
      pose: correctedPose(sighting, newest) ?? sighting.pose,
      inMap: /** @type {WirePose} */ (pose),
      position: Math.hypot(sigma(0), LEAST_POSITION * depth),
      rotation: Math.hypot(sigma(3), LEAST_POSITION),
      unit: unit ?? guess,
      unitSigma: unit ? UNIT : GUESS,
      depth,
    };
  }

  // The standard deviations with which an answer tells where another image is, without what it has in common with others; `far`: what the way adds.
  spread(known, newest, scale) {
    const { sighting } = known;
    const way = Math.abs(newest.way - sighting.way), turn = Math.abs(newest.turn - sighting.turn);
    const isGuess = newest.isPreliminary || sighting.isPreliminary;
    const far = (isGuess ? PRELIMINARY : WAY) * scale * way;
    return {
      far,
      position: Math.hypot(OWN * known.position, far, newest === sighting ? 0 : DEPTH * known.depth),
      rotation: Math.hypot(OWN * known.rotation, LEAST_TURN + TURN * turn, isGuess ? far / known.depth : 0),
    };
  }

  update() {
    this.fit = this.newest && this.known.length > 0 ? this.fitTo(this.known, this.newest) : null;
  }

  /**
   * By all answers: the scale by how far the camera has moved between them, then rotation and position by those of images near `newest` most.
   * @param {Known[]} known  @param {Sighting} newest  @returns {Similarity}
   */
  fitTo(known, newest) {
    const reference = known[known.length - 1];
    const rotation = this.rotationOf(known, newest, reference);
    const scale = this.scaleOf(known, newest, rotation.value);
    const at = new Mean();
    let drift = 0;
    for (const each of known) {
      const { position, far } = this.spread(each, newest, scale.value);
      at.add(each.pose.position, each.inMap.position, position ** -2);
      drift += far * position ** -2;
    }
    return {
      scale: scale.value, rotation: rotation.value, middle: at.from, position: at.to,
      sigma: { position: Math.hypot(at.weight ** -0.5, reference.position), rotation: Math.hypot(rotation.sigma, reference.rotation), scale: scale.sigma / scale.value },
      drift: { position: drift / at.weight, rotation: rotation.sigma },
    };
  }

  /** @param {Known[]} known  @param {Sighting} newest  @param {Known} reference */
  rotationOf(known, newest, reference) {
    const turnOf = ({ inMap, pose }) => multiply(inMap.rotation, conjugate(pose.rotation));
    const r = turnOf(reference);
    const sum = [0, 0, 0, 0];
    let total = 0;
    for (const each of known) {
      const turn = turnOf(each);
      const weight = this.spread(each, newest, each.unit).rotation ** -2;
      const sign = turn[0] * r[0] + turn[1] * r[1] + turn[2] * r[2] + turn[3] * r[3] < 0 ? -1 : 1; // both signs are one rotation
      for (let k = 0; k < 4; ++k) sum[k] += sign * weight * turn[k];
      total += weight;
    }
    return { value: normalized(sum), sigma: total ** -0.5 };
  }

  // The units that the service tells, and what the way between the answers says. It drifts slowly, so that old answers count, too.
  scaleOf(known, newest, rotation) {
    const best = Math.min(...known.map(({ unitSigma }) => unitSigma));
    const told = known.filter(({ unitSigma }) => unitSigma === best);
    const unit = told.reduce((sum, each) => sum + each.unit, 0) / told.length;
    const prior = (unit * best) ** -2 * Math.min(told.length, MOST_UNITS);
    const useful = known.filter(({ sighting }) => sighting.isPreliminary === newest.isPreliminary);
    const weightOf = ({ sighting, position }) => Math.exp((sighting.time - newest.time) / SCALE_SECONDS) / Math.hypot(OWN * position, DEPTH * this.depth) ** 2;
    const mean = new Mean();
    for (const each of useful) mean.add(each.pose.position, each.inMap.position, weightOf(each));
    let [top, bottom] = [unit * prior, prior];
    for (const each of useful) {
      const weight = weightOf(each);
      const from = rotate(rotation, minus(each.pose.position, mean.from));
      top += weight * dot(from, minus(each.inMap.position, mean.to));
      bottom += weight * dot(from, from);
    }
    const value = Math.max(top / bottom, unit / 4); // whatever the answers say, lengths are positive
    return { value, sigma: Math.hypot(bottom ** -0.5, SCALE * value) };
  }

  /** @param {WirePose} pose in the odometry's frame  @param {Similarity} fit  @returns {WirePose} */
  inMap(pose, { scale, rotation, middle, position }) {
    return { position: add(position, rotate(rotation, minus(pose.position, middle)), scale), rotation: normalized(multiply(rotation, pose.rotation)) };
  }

  /** @param {Sighting} sighting */
  rawPoseOf(sighting) {
    if (!this.fit || sighting.run !== this.newest?.run) return null;
    return this.inMap(sighting === this.newest ? sighting.pose : (correctedPose(sighting, this.newest) ?? sighting.pose), this.fit);
  }

  // Whether an answer tells of the same place as others. @param {Known} known  @param {Known[]} others
  fits({ sighting, pose, inMap, position, rotation }, others) {
    const fit = this.fitTo(others, sighting);
    const off = between(this.inMap(pose, fit), inMap);
    const far = fit.scale * length(minus(pose.position, fit.middle));
    return length(off.translation) < OUTLIER * Math.hypot(position, fit.sigma.position, far * fit.sigma.scale, far * fit.sigma.rotation) &&
      length(off.rotation) < OUTLIER * Math.hypot(rotation, fit.sigma.rotation);
  }
}
