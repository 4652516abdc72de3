// Visual odometry in a browser, a worker or Node: the C++ of core/oaslam/odometry as WebAssembly (bindings/wasm/, docs/odometry-js.md).

/**
 * A calibrated camera. Pixel centres are at integer coordinates: the centre of the upper left pixel is (0, 0).
 * @typedef {object} Camera
 * @property {number} width pixels
 * @property {number} height pixels
 * @property {number} fx pixels
 * @property {number} fy pixels
 * @property {number} cx pixels
 * @property {number} cy pixels
 * @property {"pinhole" | "fisheye"} [model] pinhole where it is left out
 * @property {number[]} [distortion] pinhole: k1 k2 p1 p2 k3, fisheye: k1 k2 k3 k4; zeros where they are left out
 */

/**
 * preliminary: by the motion that explains the first images best so far; uncertain: may be off by degrees; inertial: the image shows too little, and
 * the accelerations tell the pose, for a second or two; blind: no pose.
 * @typedef {"preliminary" | "tracking" | "uncertain" | "inertial" | "blind"} State
 */

/**
 * x_cam = rotation * x_odom + translation, with the camera's x to the right of the image, y down and z forward.
 * @typedef {object} Pose
 * @property {Float64Array} rotation a unit quaternion: x, y, z, w
 * @property {Float64Array} translation in the odometry's unit
 */

/**
 * What an image told. The object and its arrays are the same for all images: they are valid until the next call.
 * @typedef {object} Estimate
 * @property {State} state
 * @property {number} run counts the interruptions: nothing is known of how poses of different runs lie to each other
 * @property {number} image counted since the run began
 * @property {Pose | null} camFromOdom null where the state is blind
 * @property {Float64Array} covariance 6 x 6, of a small motion of the camera (translation, rotation vector in rad; its axes); zeros while the state is preliminary
 * @property {Float32Array} points x and y in pixels and inverse depth, of each point in the image whose depth is known to a third
 * @property {Float64Array} keyframes of the keyframes that the odometry still corrects, as they are known with this image, 8 numbers each, by image,
 *   ascending: image, position (x, y, z) and rotation (a unit quaternion: x, y, z, w) of the camera in the odometry's frame; none while the state is preliminary
 * @property {boolean} keyframe whether this image is one
 * @property {number} tracked points that were followed into the image
 * @property {number} inliers of them, those that agree with the pose
 * @property {number | null} metresPerUnit the length of the odometry's unit, by the accelerations; null while it is not known
 * @property {number | null} metreSigma its standard deviation, divided by it
 * @property {Float64Array | null} gravity m/s2, along the camera's axes, pointing down, by the accelerations; null while it is not known
 */

/**
 * ORB key points of an image. They are valid until the next call.
 * @typedef {object} Features
 * @property {number} count
 * @property {number} lowest size of a pixel of the pyramid's lowest level, in pixels of the image
 * @property {number} levels of the pyramid
 * @property {number} factor scale between two levels
 * @property {Uint8Array} bytes of all x and y in the image without distortion and the angle in rad (float32, little-endian), then of all the level (a byte), then of
 *   all the descriptors (32 bytes)
 */

/** @type {readonly State[]} */ const STATES = ["preliminary", "tracking", "uncertain", "inertial", "blind"];

// Of OaslamEstimate in bindings/wasm/odometry_js.h: doubles, then 32 bit integers.
const ROTATION = 0, TRANSLATION = 4, COVARIANCE = 7, METRE = 43, GRAVITY = 45, DOUBLES = 48;
const STATE = 0, RUN = 1, IMAGE = 2, KEYFRAME = 3, TRACKED = 4, INLIERS = 5, POINTS = 6, KEYFRAMES = 7, INTEGERS = 8;
const GYROSCOPE = 4, IMU = 7; // numbers of a sample
const LEVELS = 8, FACTOR = 1.2; // of OrbExtractor
const FEATURE_BYTES = 45; // of a key point
const MOST_FEATURES = 10000;
const NONE = new Float64Array(0), NO_POINTS = new Float32Array(0);

/** @type {Map<string, Promise<WebAssembly.Module>>} */ const compiled = new Map();

/** @param {URL} url @returns {Promise<BufferSource>} */
async function read(url) {
  if (url.protocol === "file:") {
    const files = "node:fs/promises"; // a variable, so that bundlers for browsers do not look for it
    return (await import(files)).readFile(url);
  }
  const response = await fetch(url);
  if (!response.ok) throw new Error(`${url}: ${response.status} ${response.statusText}`);
  return response.arrayBuffer();
}

/** @param {URL} url */
function compile(url) {
  let module = compiled.get(url.href);
  if (!module) {
    module = read(url).then((bytes) => WebAssembly.compile(bytes));
    module.catch(() => compiled.delete(url.href)); // the next one asks again
    compiled.set(url.href, module);
  }
  return module;
}

/**
 * Views of arrays of the module that change their length with each image but seldom their place: one for each length, so that an image leaves no garbage.
 * @template T
 */
class Views {
  #at = 0;
  /** @type {T[]} */ #views = []; // by length

  /** @param {ArrayBuffer} buffer  @param {new (buffer: ArrayBuffer, at: number, length: number) => T} kind */
  constructor(buffer, kind) {
    this.buffer = buffer;
    this.kind = kind;
  }

  /** @param {number} at  @param {number} length */
  of(at, length) {
    if (at !== this.#at) this.#views = [];
    this.#at = at;
    return (this.#views[length] ??= new this.kind(this.buffer, at, length));
  }
}

export class Odometry {
  /** @type {any} */ #functions = null; // null: deleted, or broken
  /** @type {WebAssembly.Memory} */ #memory;
  #handle = 0;
  #width = 0;
  #height = 0;
  #at = 0; // of the estimate
  /** @type {Estimate} */ #estimate;
  /** @type {Pose} */ #pose;
  /** @type {Int32Array} */ #integers;
  /** @type {Float64Array} */ #metre;
  /** @type {Float64Array} */ #gravity;
  /** @type {Uint8Array} */ #grey;
  /** @type {Uint8Array | null} */ #rgba = null;
  /** @type {Float64Array} */ #doubles; // all of the memory
  /** @type {Views<Float32Array>} */ #points;
  /** @type {Views<Float64Array>} */ #keyframes;
  #images = 0; // that were processed

  /**
   * Loads the module, once for all, and begins. Rejects with an Error that names key, value and bound of a camera that is refused.
   * @param {object} options
   * @param {Camera} options.camera
   * @param {number} [options.seed] of the random samples: a whole number
   * @param {URL | string | WebAssembly.Module} [options.wasm] by default oaslam_odometry.wasm beside this file
   * @returns {Promise<Odometry>}
   */
  static async create({ camera, seed = 0, wasm = new URL("oaslam_odometry.wasm", import.meta.url) }) {
    if (!Number.isSafeInteger(seed) || seed < 0) throw new Error(`seed: ${seed}, expected a whole number of at least 0`);
    const numbers = ["width", "height", "fx", "fy", "cx", "cy"].map((key) => {
      const value = camera?.[key];
      if (typeof value !== "number") throw new Error(`camera: ${key}: ${value}, expected a number`);
      return value;
    });
    for (const side of ["width", "height"]) {
      if (!Number.isInteger(camera[side])) throw new Error(`camera: ${side}: ${camera[side]}, expected a whole number`);
    }
    const { model = "pinhole", distortion = [] } = camera;
    const most = { pinhole: 5, fisheye: 4 }[model];
    if (!most) throw new Error(`camera: model: ${model}, allowed: pinhole | fisheye`);
    if (distortion.length > most || !distortion.every(Number.isFinite)) throw new Error(`camera: distortion: ${distortion}, expected up to ${most} numbers`);
    const odometry = new Odometry();
    await odometry.#start(wasm instanceof WebAssembly.Module ? wasm : await compile(new URL(wasm, import.meta.url)));
    odometry.#begin(model, numbers, [...distortion, 0, 0, 0, 0, 0].slice(0, 5), seed);
    return odometry;
  }

  /** @param {WebAssembly.Module} module */
  async #start(module) {
    const fail = (/** @type {number} */ text) => {
      throw new Error(this.#text(text));
    };
    const none = () => 0;
    const { exports } = await WebAssembly.instantiate(module, {
      oaslam: { fail },
      env: { emscripten_notify_memory_growth: none },
      wasi_snapshot_preview1: {
        environ_get: none,
        environ_sizes_get: (/** @type {number} */ count, /** @type {number} */ size) => {
          new Uint32Array(this.#memory.buffer)[count / 4] = new Uint32Array(this.#memory.buffer)[size / 4] = 0;
          return 0;
        },
        proc_exit: () => {
          throw new Error("odometry: out of memory");
        },
      },
    });
    this.#functions = exports;
    this.#memory = /** @type {WebAssembly.Memory} */ (exports.memory);
    this.#functions._initialize();
  }

  /** @param {string} model @param {number[]} camera @param {number[]} distortion @param {number} seed */
  #begin(model, camera, distortion, seed) {
    [this.#width, this.#height] = camera;
    this.#handle = this.#functions.oaslam_odometry_new(model === "fisheye" ? 1 : 0, ...camera, ...distortion, seed);
    const problem = this.#problem();
    if (!problem) return;
    this.delete();
    throw new Error(`camera: ${problem}`);
  }

  #text(/** @type {number} */ at) {
    const bytes = new Uint8Array(this.#memory.buffer);
    return new TextDecoder().decode(bytes.slice(at, bytes.indexOf(0, at)));
  }

  #problem() {
    return this.#text(this.#functions.oaslam_odometry_problem(this.#handle));
  }

  /**
   * The pose of the next image. Throws an Error for an image of another size and a time stamp that is not after the one before, which change nothing.
   * @param {Uint8Array | Uint8ClampedArray | ImageData} image width * height grey bytes, or an ImageData of that size
   * @param {number} timeSeconds of the exposure; ascends
   * @param {Iterable<ArrayLike<number>>} [samples] of a gyroscope, which ascend: time in seconds, and rad/s about the camera's x, y and z; those of an
   *   IMU have three numbers more, its acceleration along these axes in m/s2, with gravity: at rest 9.81 away from the ground.
   *   Those that an earlier image had already are ignored. Best are all up to a quarter of a second after the image.
   * @returns {Estimate}
   */
  process(image, timeSeconds, samples) {
    if (!this.#functions) throw new Error("odometry: was deleted");
    const isRgba = this.#take(image);
    const count = samples ? this.#takeSamples(Array.isArray(samples) ? samples : [...samples]) : 0;
    let at = 0;
    try {
      at = this.#functions.oaslam_odometry_process(this.#handle, timeSeconds, isRgba ? 1 : 0, count);
    } catch (error) {
      this.#functions = null; // it ended in the middle
      throw error;
    }
    if (at === 0) throw new Error(`odometry: ${this.#problem()}`);
    ++this.#images;
    return this.#read(at);
  }

  /**
   * Key points of the last image, as the program extracts them: by these a service finds the camera without the image.
   * @param {number} [count] about how many
   * @returns {Features}
   */
  features(count = 1000) {
    if (!this.#functions) throw new Error("odometry: was deleted");
    if (this.#images === 0) throw new Error("odometry: there is no image yet");
    if (!Number.isInteger(count) || count < 1 || count > MOST_FEATURES) throw new Error(`odometry: ${count} key points, expected 1 to ${MOST_FEATURES}`);
    const found = this.#functions.oaslam_odometry_features(this.#handle, count);
    const lowest = this.#functions.oaslam_odometry_lowest_scale(this.#handle);
    return { count: found, lowest, levels: LEVELS, factor: FACTOR, bytes: this.#bytes(this.#functions.oaslam_odometry_feature_bytes(this.#handle), FEATURE_BYTES * found) };
  }

  // Copies the image to where the module reads it; whether that is in colour.
  #take(/** @type {Uint8Array | Uint8ClampedArray | ImageData} */ image) {
    const pixels = this.#width * this.#height;
    const expected = `expected ${this.#width} x ${this.#height}`;
    if (ArrayBuffer.isView(image)) {
      if (image.length !== pixels) throw new Error(`odometry: an image of ${image.length} bytes, ${expected} = ${pixels}`);
      if (this.#grey?.buffer !== this.#memory.buffer) this.#grey = this.#bytes(this.#functions.oaslam_odometry_image(this.#handle), pixels);
      this.#grey.set(image);
      return false;
    }
    if (image?.width !== this.#width || image?.height !== this.#height) throw new Error(`odometry: an image of ${image?.width} x ${image?.height}, ${expected}`);
    if (this.#rgba?.buffer !== this.#memory.buffer) {
      const at = this.#functions.oaslam_odometry_rgba(this.#handle); // may grow the memory
      this.#rgba = this.#bytes(at, 4 * pixels);
    }
    this.#rgba.set(image.data);
    return true;
  }

  /** @param {ArrayLike<number>[]} samples */
  #takeSamples(samples) {
    const columns = samples.length > 0 ? samples[0].length : GYROSCOPE;
    const other = columns === GYROSCOPE || columns === IMU ? samples.findIndex(({ length }) => length !== columns) : 0;
    if (other >= 0) throw new Error(`odometry: sample ${other}: ${samples[other].length} numbers, expected ${GYROSCOPE} in each, or ${IMU} in each`);
    const at = this.#functions.oaslam_odometry_samples(this.#handle, samples.length, columns) / 8;
    if (this.#doubles?.buffer !== this.#memory.buffer) this.#doubles = new Float64Array(this.#memory.buffer);
    for (let i = 0; i < samples.length; ++i) {
      for (let k = 0; k < columns; ++k) this.#doubles[at + columns * i + k] = samples[i][k];
    }
    return samples.length;
  }

  #bytes(/** @type {number} */ at, /** @type {number} */ length) {
    return new Uint8Array(this.#memory.buffer, at, length);
  }

  /** @param {number} at @returns {Estimate} */
  #read(at) {
    const { buffer } = this.#memory;
    if (this.#at !== at || this.#integers.buffer !== buffer) this.#lookAt(at);
    const integers = this.#integers;
    const estimate = this.#estimate;
    estimate.state = STATES[integers[STATE]];
    estimate.run = integers[RUN];
    estimate.image = integers[IMAGE];
    estimate.camFromOdom = estimate.state === "blind" ? null : this.#pose;
    const isMetreKnown = this.#metre[0] > 0;
    estimate.metresPerUnit = isMetreKnown ? this.#metre[0] : null;
    estimate.metreSigma = isMetreKnown ? this.#metre[1] : null;
    estimate.gravity = isMetreKnown ? this.#gravity : null;
    estimate.keyframe = integers[KEYFRAME] !== 0;
    estimate.tracked = integers[TRACKED];
    estimate.inliers = integers[INLIERS];
    estimate.points = this.#points.of(this.#functions.oaslam_odometry_points(this.#handle), 3 * integers[POINTS]);
    estimate.keyframes = this.#keyframes.of(this.#functions.oaslam_odometry_keyframes(this.#handle), 8 * integers[KEYFRAMES]);
    return estimate;
  }

  // Makes the views of the module's memory, at the first image and where the memory has grown.
  #lookAt(/** @type {number} */ at) {
    const doubles = (/** @type {number} */ first, /** @type {number} */ length) => new Float64Array(this.#memory.buffer, at + 8 * first, length);
    this.#at = at;
    this.#integers = new Int32Array(this.#memory.buffer, at + 8 * DOUBLES, INTEGERS);
    this.#pose = { rotation: doubles(ROTATION, 4), translation: doubles(TRANSLATION, 3) };
    this.#estimate = {
      state: "blind", run: 0, image: 0, camFromOdom: null, covariance: doubles(COVARIANCE, 36),
      points: NO_POINTS, keyframes: NONE, keyframe: false, tracked: 0, inliers: 0, metresPerUnit: null, metreSigma: null, gravity: null,
    };
    this.#metre = doubles(METRE, 2);
    this.#gravity = doubles(GRAVITY, 3);
    this.#points = new Views(this.#memory.buffer, Float32Array);
    this.#keyframes = new Views(this.#memory.buffer, Float64Array);
  }

  /** Frees the memory. The last estimate must not be read any more; a second call does nothing. */
  delete() {
    this.#functions?.oaslam_odometry_delete(this.#handle);
    this.#functions = null;
  }
}
