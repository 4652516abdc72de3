/** @import { DeviceTracker } from "../device/device_tracker.js" */
import { GravitySensor } from "../camera/gravity.js";
import { Gyroscope } from "../camera/gyroscope.js";
import { sentSize } from "../camera/intrinsics.js";
import { VideoSource } from "../camera/video_source.js";
import { Client } from "../client/client.js";
import { DeviceTracker as Tracker } from "../device/device_tracker.js";

const REASONS = {
  NotAllowedError: "it is not allowed: the browser's settings of this page allow it",
  NotFoundError: "this device has none that the browser knows",
  OverconstrainedError: "this device has none that the browser knows",
  NotReadableError: "another program has it",
  AbortError: "another program has it",
};

/** @returns {HTMLCanvasElement} */
function newCanvas() {
  return document.createElement("canvas");
}

/** @param {HTMLCanvasElement} canvas  @param {HTMLCanvasElement} from */
function copyTo(canvas, from) {
  const { width, height } = from;
  if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, { width, height });
  canvas.getContext("2d", { alpha: false })?.drawImage(from, 0, 0);
  return canvas;
}

/**
 * The device's camera and how it moves: opens the camera and the sensors, and has each image followed by a DeviceTracker. Of images that come while
 * one is followed the newest is taken. Events: "tracked", after each image; "error", whose `error` ended the session.
 */
export class ArSession extends EventTarget {
  /** @type {Awaited<ReturnType<DeviceTracker["process"]>> | null} of the last image */ tracked = null;
  /** @type {HTMLCanvasElement | null} that image, in the camera's size */ picture = null;
  #ended = new AbortController();
  #isBusy = false;
  #gravity = new GravitySensor();
  #gyroscope = new Gyroscope();
  #pictures = [newCanvas(), newCanvas()]; // the one that is shown, and the one that is followed
  /** @type {VideoSource} */ #source;

  /**
   * To be called while a tap or a click is handled: only then does iOS ask whether the page may use the sensors. Rejects with an Error that says why
   * there is no camera, and with a ServiceError where the service does not have the map.
   * @param {ConstructorParameters<typeof Tracker>[0] & { parent?: HTMLElement }} [options] of the DeviceTracker; `parent`: what the hidden video
   *   element becomes a part of, document.body unless given
   */
  static async start({ parent = document.body, ...options } = {}) {
    const { service } = options;
    const client = service ? new Client(service.url, { token: service.token }) : null;
    const session = new ArSession(new Tracker(options), parent, client, service?.map ?? "");
    try {
      await session.#open();
    } catch (error) {
      session.stop();
      throw error;
    }
    return session;
  }

  /** ArSession.start makes it. @param {DeviceTracker} tracker  @param {HTMLElement} parent  @param {Client | null} client of the service, if there is one  @param {string} map */
  constructor(tracker, parent, client, map) {
    super();
    this.tracker = tracker;
    this.client = client;
    this.map = map;
    const video = Object.assign(document.createElement("video"), { muted: true, playsInline: true });
    // iOS gives no images of a video that is in no page, or not displayed.
    Object.assign(video.style, { position: "fixed", left: "0", top: "0", width: "1px", height: "1px", opacity: "0", pointerEvents: "none" });
    parent.append(video);
    tracker.addEventListener("problem", (/** @type {any} */ { detail }) => this.#fail(new Error(detail)));
    this.#source = new VideoSource(video, { onFrame: (time) => this.#follow(time), onEnded: () => this.#reopen() });
    document.addEventListener("visibilitychange", () => this.#reopen(), { signal: this.#ended.signal });
  }

  async #open() {
    if (!globalThis.isSecureContext || !navigator.mediaDevices) throw new Error("the camera: browsers give it only to pages over https, or from http://localhost");
    const { signal } = this.#ended;
    const sensors = this.#gravity.start(signal);
    this.#gyroscope.start(signal);
    await Promise.all([sensors, this.#openCamera(), this.client?.map(this.map)]);
  }

  async #openCamera() {
    try {
      await this.#source.open();
    } catch (/** @type {any} */ error) {
      throw new Error(`the camera: ${REASONS[error.name] ?? error.message}`, { cause: error });
    }
  }

  // Systems take the camera from pages that are hidden.
  #reopen() {
    if (!document.hidden && !this.isStopped && this.#source.track?.readyState === "ended") this.#openCamera().catch((error) => this.#fail(error));
  }

  /** @param {number} time */
  async #follow(time) {
    if (this.#isBusy || document.hidden) return;
    this.#isBusy = true;
    try {
      const source = this.#source;
      const { size, isFront } = source;
      const { image, canvas } = source.grab(sentSize(size.width, size.height));
      const next = copyTo(this.#pictures[1], canvas);
      const gravity = this.#gravity.read(isFront);
      const tracked = await this.tracker.process({ image, time, gyroscope: this.#gyroscope.read(isFront), gravity, jpeg: () => source.jpeg() });
      if (this.isStopped) return;
      this.tracked = tracked;
      this.picture = next;
      this.#pictures.reverse();
      this.dispatchEvent(new Event("tracked"));
    } catch (error) {
      this.#fail(error);
    } finally {
      this.#isBusy = false;
    }
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
    this.tracker.end();
  }
}
