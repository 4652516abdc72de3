// Gravity in the axes of the camera's picture: x right, y down, z forward.
//
// The axes of a device are those of its screen in its natural position: x right, y up, z out of the screen. They do not turn with the picture on the
// screen: screen.orientation.angle tells by how much the device is turned counterclockwise, and the picture clockwise.
const G = 9.81; // m/s2
const RADIAN = Math.PI / 180;

// From the angles of DeviceOrientationEvent, in degrees: the device is turned by alpha about z, then by beta about its own x, then by gamma about its
// own y (W3C). The third row of that rotation is up in the device's axes. The angles mean the same on all systems.
/** @returns {import("../messages").Triple} */
export function gravityOfOrientation(beta, gamma) {
  const [b, c] = [beta * RADIAN, gamma * RADIAN];
  return [G * Math.cos(b) * Math.sin(c), -G * Math.sin(b), -G * Math.cos(b) * Math.cos(c)];
}

// From DeviceMotionEvent.accelerationIncludingGravity, which points up while the device is at rest, but down with WebKit (iOS).
/** @returns {import("../messages").Triple} */
export function gravityOfMotion({ x, y, z }, isWebKit) {
  const sign = isWebKit ? 1 : -1;
  return [sign * x, sign * y, sign * z];
}

// What an accelerometer measures, from the same: the force that holds the device against gravity.
/** @returns {import("../messages").Triple} */
export function forceOfMotion(acceleration, isWebKit) {
  const [x, y, z] = gravityOfMotion(acceleration, isWebKit);
  return [-x, -y, -z];
}

/** Whether the browser is one of Apple's. Its requestPermission does not tell: Chromium has it, too. */
export const isWebKit = () => navigator.vendor.startsWith("Apple");

// From the device's axes to those of the picture of a camera on its back, or with `isFront` beside its screen, where the screen is turned by `angle` degrees.
/** @returns {import("../messages").Triple} */
export function toPicture([x, y, z], angle, isFront = false) {
  const [cos, sin] = [Math.cos(angle * RADIAN), Math.sin(angle * RADIAN)];
  const right = x * cos - y * sin;
  const up = x * sin + y * cos;
  return isFront ? [-right, -up, z] : [right, -up, -z];
}

const FRESH_MS = 200;

/** Listens to the sensors, where there are any and the page may use them. */
export class GravitySensor {
  /** @type {{ gravity: import("../messages").Triple, source: "orientation" | "motion", at: number } | null} */ last = null;

  // To be called while a tap is handled: only then does iOS ask the user. `signal` ends it.
  /** @param {AbortSignal} [signal] */
  async start(signal) {
    /** @type {any[]} */
    const kinds = [globalThis.DeviceOrientationEvent, globalThis.DeviceMotionEvent];
    const isApple = isWebKit();
    const asked = kinds.map((kind) => kind?.requestPermission?.().catch(() => "denied"));
    addEventListener("deviceorientation", ({ beta, gamma }) => {
      if (beta !== null && gamma !== null) this.take(gravityOfOrientation(beta, gamma), "orientation");
    }, { signal });
    addEventListener("devicemotion", ({ accelerationIncludingGravity: a }) => {
      if (a && a.x !== null) this.take(gravityOfMotion(a, isApple), "motion");
    }, { signal });
    await Promise.all(asked);
  }

  // The orientation is preferred: the acceleration has that of the hand in it.
  take(gravity, source) {
    const now = performance.now();
    if (source === "motion" && this.last?.source === "orientation" && now - this.last.at < FRESH_MS) return;
    this.last = { gravity, source, at: now };
  }

  /** Gravity in the picture's axes; null where it is not known. @returns {import("../messages").Triple | null} */
  read(isFront) {
    if (!this.last || performance.now() - this.last.at > FRESH_MS) return null;
    return toPicture(this.last.gravity, screen.orientation?.angle ?? globalThis.orientation ?? 0, isFront);
  }
}
