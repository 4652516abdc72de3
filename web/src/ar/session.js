/** @import { DeviceTracker } from "../device/device_tracker.js" */
import { GravitySensor } from "../camera/gravity.js";
import { Gyroscope } from "../camera/gyroscope.js";
import { sentSize } from "../camera/intrinsics.js";
import { VideoSource } from "../camera/video_source.js";
import { DeviceTracker as Tracker } from "../device/device_tracker.js";

const QUALITY = 0.7; // of JPEG
const REASONS = {
  NotAllowedError: "it is not allowed: the browser's settings of this page allow it",
  NotFoundError: "this device has none that the browser knows",
  OverconstrainedError: "this device has none that the browser knows",
  NotReadableError: "another program has it",
  AbortError: "another program has it",
};

/** @typedef {{ canvas: HTMLCanvasElement, context: CanvasRenderingContext2D }} Picture */

/** @param {CanvasRenderingContext2DSettings} settings @returns {Picture} */
function newPicture(settings) {
  const canvas = document.createElement("canvas");
  return { canvas, context: /** @type {CanvasRenderingContext2D} */ (canvas.getContext("2d", { alpha: false, ...settings })) };
}

/** @param {Picture} picture  @param {HTMLVideoElement} video  @param {{ width: number, height: number }} size */
function draw({ canvas, context }, video, { width, height }) {
  if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, { width, height });
  context.drawImage(video, 0, 0, width, height);
}

/**
 * The device's camera and how it moves: opens the camera and the sensors, and has each image followed by a DeviceTracker. Of images that come while
 * one is followed the newest is taken. Events: "tracked", after each image; "error", whose `error` ended the session.
 */
export class ArSession extends EventTarget {
  /** @type {Awaited<ReturnType<DeviceTracker["process"]>> | null} of the last image */ tracked = null;
  /** @type {HTMLCanvasElement | null} that image, in the camera's size */ picture = null;
  /** @type {import("../messages").Triple | null} at that image, in the camera's axes; null where the device does not tell */ gravity = null;
  #ended = new AbortController();
  #isBusy = false;
  #gravity = new GravitySensor();
  #gyroscope = new Gyroscope();
  #pictures = [newPicture({}), newPicture({})]; // the one that is shown, and the one that is followed
  #small = newPicture({ willReadFrequently: true });
  /** @type {VideoSource} */ #source;

  /**
   * To be called while a tap or a click is handled: only then does iOS ask whether the page may use the sensors. Rejects with an Error that says why
   * there is no camera.
   * @param {ConstructorParameters<typeof Tracker>[0] & { parent?: HTMLElement }} [options] of the DeviceTracker; `parent`: what the hidden video
   *   element becomes a part of, document.body unless given
   */
  static async start({ parent = document.body, ...options } = {}) {
    const session = new ArSession(new Tracker(options), parent);
    try {
      await session.#open();
    } catch (error) {
      session.stop();
      throw error;
    }
    return session;
  }

  /** ArSession.start makes it. @param {DeviceTracker} tracker  @param {HTMLElement} parent */
  constructor(tracker, parent) {
    super();
    this.tracker = tracker;
    const video = Object.assign(document.createElement("video"), { muted: true, playsInline: true });
    // iOS gives no images of a video that is in no page, or not displayed.
    Object.assign(video.style, { position: "fixed", left: "0", top: "0", width: "1px", height: "1px", opacity: "0", pointerEvents: "none" });
    parent.append(video);
    this.#source = new VideoSource(video, { onFrame: (time) => this.#follow(time), onEnded: () => this.#fail(new Error("the camera: it was taken away")) });
  }

  async #open() {
    if (!globalThis.isSecureContext || !navigator.mediaDevices) throw new Error("the camera: browsers give it only to pages over https, or from http://localhost");
    const { signal } = this.#ended;
    const sensors = this.#gravity.start(signal);
    this.#gyroscope.start(signal);
    const camera = this.#source.open().catch((error) => {
      throw new Error(`the camera: ${REASONS[error.name] ?? error.message}`, { cause: error });
    });
    await Promise.all([sensors, camera]);
  }

  /** @param {number} time */
  async #follow(time) {
    if (this.#isBusy || document.hidden) return;
    this.#isBusy = true;
    try {
      const { video, size, isFront } = this.#source;
      const small = sentSize(size.width, size.height);
      const next = this.#pictures[1];
      draw(next, video, size);
      draw(this.#small, video, small);
      const image = this.#small.context.getImageData(0, 0, small.width, small.height);
      const gravity = this.#gravity.read(isFront);
      const tracked = await this.tracker.process({ image, time, gyroscope: this.#gyroscope.read(isFront), ...(gravity && { gravity }), jpeg: () => this.#jpeg() });
      if (this.isStopped) return;
      this.gravity = gravity;
      this.tracked = tracked;
      this.picture = next.canvas;
      this.#pictures.reverse();
      this.dispatchEvent(new Event("tracked"));
    } catch (error) {
      this.#fail(error);
    } finally {
      this.#isBusy = false;
    }
  }

  /** The image that is followed, as the bytes of a JPEG. */
  async #jpeg() {
    /** @type {Blob | null} */
    const blob = await new Promise((resolve) => this.#small.canvas.toBlob(resolve, "image/jpeg", QUALITY));
    return new Uint8Array((await blob?.arrayBuffer()) ?? []);
  }

  /** @param {any} error */
  #fail(error) {
    if (this.isStopped) return;
    this.stop();
    this.dispatchEvent(new ErrorEvent("error", { error, message: error.message }));
  }

  get isStopped() {
    return this.#ended.signal.aborted;
  }

  /** Closes the camera and ends the tracker. The session cannot be used any more. */
  stop() {
    this.#ended.abort();
    this.#source.close();
    this.#source.video.remove();
    this.tracker.delete();
  }
}
