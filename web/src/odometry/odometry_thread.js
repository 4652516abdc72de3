// The odometry in a worker, for odometry_worker.js: one answer for each message, in their order.
import { Odometry } from "./oaslam_odometry.js";

/** @type {Odometry | null} */ let odometry = null;
/** @type {OffscreenCanvasRenderingContext2D | null} */ let context = null;
const image = { width: 0, height: 0, data: new Uint8ClampedArray(0) }; // as an ImageData

// The pixels of a bitmap.
function pixelsOf(bitmap) {
  const { width, height } = bitmap;
  if (!context || context.canvas.width !== width || context.canvas.height !== height) {
    context = new OffscreenCanvas(width, height).getContext("2d", { alpha: false, willReadFrequently: true });
  }
  const drawn = /** @type {OffscreenCanvasRenderingContext2D} */ (context);
  drawn.drawImage(bitmap, 0, 0);
  bitmap.close();
  return drawn.getImageData(0, 0, width, height);
}

// A copy: the estimate itself lies in the module's memory.
function copyOf(estimate) {
  const { camFromOdom } = estimate;
  return {
    ...estimate,
    camFromOdom: camFromOdom && { rotation: camFromOdom.rotation.slice(), translation: camFromOdom.translation.slice() },
    covariance: estimate.covariance.slice(), points: estimate.points.slice(), keyframes: estimate.keyframes.slice(),
    gravity: estimate.gravity && estimate.gravity.slice(),
  };
}

const CALLS = {
  async create(options) {
    odometry = await Odometry.create(options);
  },
  process({ bitmap, width, height, data, time, samples }) {
    const given = bitmap ? pixelsOf(bitmap) : Object.assign(image, { width, height, data });
    return copyOf(/** @type {Odometry} */ (odometry).process(/** @type {ImageData} */ (given), time, samples));
  },
  features({ count }) {
    const features = /** @type {Odometry} */ (odometry).features(count);
    return { ...features, bytes: features.bytes.slice() };
  },
};

addEventListener("message", async ({ data: { call, given } }) => {
  /** @type {Transferable[]} */
  const moved = given.data ? [given.data.buffer] : []; // back to the page, which uses the buffer again
  try {
    const result = await CALLS[call](given);
    if (result?.bytes) moved.push(result.bytes.buffer);
    postMessage({ result, buffer: given.data?.buffer }, { transfer: moved });
  } catch (error) {
    postMessage({ error: error instanceof Error ? error.message : String(error), buffer: given.data?.buffer }, { transfer: moved });
  }
});
