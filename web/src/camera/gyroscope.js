// How fast the device turns, about the axes of the camera's picture: x right, y down, z forward.
import { toPicture } from "./gravity.js";

const RADIAN = Math.PI / 180;
const KEPT = 1; // seconds: each image carries those of the last second, since the service drops images of which it has newer ones

/** Keeps what the gyroscope said last, where there is one and the page may use it. */
export class Gyroscope {
  /** @type {[number, import("../messages").Triple][]} */ samples = []; // seconds on the clock of performance.now(), degrees per second about the device's axes

  // GravitySensor.start asks the user for the same events. `signal` ends it.
  /** @param {AbortSignal} [signal] */
  start(signal) {
    addEventListener("devicemotion", ({ timeStamp, rotationRate: rate }) => {
      if (rate && rate.alpha !== null) this.take(timeStamp / 1000, rate);
    }, { signal });
  }

  // Browsers agree that alpha is about x, beta about y and gamma about z (w3c/deviceorientation, issue 44), other than in the angles of an orientation.
  take(time, { alpha, beta, gamma }) {
    if (this.samples.length > 0 && !(time > this.samples[this.samples.length - 1][0])) return;
    this.samples.push([time, [alpha, beta, gamma]]);
    while (this.samples[0][0] < time - KEPT) this.samples.shift();
  }

  // Rows of time and rad/s, as the service wants them.
  /** @returns {[number, number, number, number][]} */
  read(isFront, angle = screen.orientation?.angle ?? globalThis.orientation ?? 0) {
    return this.samples.map(([time, rate]) => {
      const [x, y, z] = toPicture(rate, angle, isFront);
      return [time, RADIAN * x, RADIAN * y, RADIAN * z];
    });
  }
}
