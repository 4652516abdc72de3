// The odometry in a worker, so that a page stays fluid while it works.
/** @typedef {import("./oaslam_odometry.js").Camera} Camera @typedef {import("./oaslam_odometry.js").Estimate} Estimate @typedef {import("./oaslam_odometry.js").Features} Features */

/** As Odometry, with promises: calls are made in the order in which they were asked for. */
export class OdometryWorker {
  /** @type {Worker} */ #worker;
  /** @type {{ resolve: (result: any) => void, reject: (error: Error) => void }[]} */ #waiting = [];
  /** @type {ArrayBuffer | null} */ #buffer = null; // of an image, which goes to the worker and comes back

  /**
   * Starts a worker, and begins there. Rejects as Odometry.create does.
   * @param {object} options
   * @param {Camera} options.camera
   * @param {number} [options.seed] of the random samples: a whole number
   * @param {URL | string | WebAssembly.Module} [options.wasm] by default oaslam_odometry.wasm beside the worker
   * @param {URL | string | Worker} [options.worker] by default odometry_thread.js beside this file
   * @returns {Promise<OdometryWorker>}
   */
  static async create({ camera, seed, wasm, worker }) {
    const made = new OdometryWorker();
    made.#start(worker instanceof Worker ? worker : worker ? new Worker(worker, { type: "module" }) : new Worker(new URL("./odometry_thread.js", import.meta.url), { type: "module" }));
    try {
      await made.#call("create", { camera, seed, ...(wasm && { wasm: wasm instanceof WebAssembly.Module ? wasm : new URL(wasm, location.href).href }) });
    } catch (error) {
      made.delete();
      throw error;
    }
    return made;
  }

  /** @param {Worker} worker */
  #start(worker) {
    this.#worker = worker;
    worker.onmessage = ({ data: { result, error, buffer } }) => {
      if (buffer) this.#buffer = buffer;
      const { resolve, reject } = /** @type {any} */ (this.#waiting.shift());
      if (error === undefined) resolve(result);
      else reject(new Error(error));
    };
    worker.onerror = (event) => {
      event.preventDefault?.();
      this.#fail(new Error(`odometry: the worker does not run: ${event.message ?? "it was not loaded"}`));
    };
  }

  /** @param {string} call  @param {any} given  @param {Transferable[]} [moved]  @returns {Promise<any>} */
  #call(call, given, moved = []) {
    if (!this.#worker) return Promise.reject(new Error("odometry: was deleted"));
    return new Promise((resolve, reject) => {
      this.#waiting.push({ resolve, reject });
      this.#worker.postMessage({ call, given }, moved);
    });
  }

  #fail(/** @type {Error} */ error) {
    for (const { reject } of this.#waiting.splice(0)) reject(error);
  }

  /**
   * The pose of the next image; rejects as Odometry.process throws. The estimate is a copy, which stays. A bitmap is moved to the worker, and closed there.
   * @param {ImageData | ImageBitmap} image of the camera's size
   * @param {number} time seconds; ascends
   * @param {number[][]} [samples] of a gyroscope or an IMU, as for Odometry.process
   * @returns {Promise<Estimate>}
   */
  process(image, time, samples) {
    const { width, height } = image;
    if (globalThis.ImageBitmap && image instanceof ImageBitmap) return this.#call("process", { bitmap: image, time, samples }, [image]);
    const { data } = /** @type {ImageData} */ (image);
    const copy = new Uint8ClampedArray(this.#buffer?.byteLength === data.length ? this.#buffer : new ArrayBuffer(data.length));
    this.#buffer = null;
    copy.set(data);
    return this.#call("process", { data: copy, width, height, time, samples }, [copy.buffer]);
  }

  /** Key points of the last image. @param {number} [count] about how many  @returns {Promise<Features>} */
  features(count) {
    return this.#call("features", { count });
  }

  /** Ends the worker; a second call does nothing. */
  delete() {
    this.#worker?.terminate();
    // @ts-ignore: nothing is called any more
    this.#worker = null;
    this.#fail(new Error("odometry: was deleted"));
  }
}
