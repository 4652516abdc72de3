// How fast the device turns and is accelerated, along the axes of the camera's picture: x right, y down, z forward.
import { forceOfMotion, isWebKit, toPicture } from "./gravity.js";

const RADIAN = Math.PI / 180;
const KEPT = 1; // seconds: each image carries those of the last second, since the service drops images of which it has newer ones

/** Keeps what the gyroscope said last, and the accelerometer beside it, where there are any and the page may use them. */
export class Gyroscope {
  // Seconds on the clock of performance.now(), degrees per second and m/s2 along the device's axes.
  /** @type {[number, import("../messages").Triple, import("../messages").Triple | null][]} */ samples = [];

  // GravitySensor.start asks the user for the same events. `signal` ends it.
  /** @param {AbortSignal} [signal] */
  start(signal) {
    const isApple = isWebKit();
    addEventListener("devicemotion", ({ timeStamp, rotationRate: rate, accelerationIncludingGravity: a }) => {
      if (rate && rate.alpha !== null) this.take(timeStamp / 1000, rate, a && a.x !== null ? forceOfMotion(a, isApple) : null);
    }, { signal });
  }

  // Browsers agree that alpha is about x, beta about y and gamma about z (w3c/deviceorientation, issue 44), other than in the angles of an orientation.
  /** @param {number} time  @param {any} rate  @param {import("../messages").Triple | null} [force] */
  take(time, { alpha, beta, gamma }, force = null) {
    if (this.samples.length > 0 && !(time > this.samples[this.samples.length - 1][0])) return;
    this.samples.push([time, [alpha, beta, gamma], force]);
    while (this.samples[0][0] < time - KEPT) this.samples.shift();
  }

  // Rows of time and rad/s, and m/s2 where all have an acceleration, as the odometry and the service want them.
  /** @returns {number[][]} */
  read(isFront, angle = screen.orientation?.angle ?? globalThis.orientation ?? 0) {
    const haveForce = this.samples.every(([, , force]) => force);
    return this.samples.map(([time, rate, force]) => {
      const [x, y, z] = toPicture(rate, angle, isFront);
      const row = [time, RADIAN * x, RADIAN * y, RADIAN * z];
      return haveForce && force ? [...row, ...toPicture(force, angle, isFront)] : row;
    });
  }
}
