/** @import { Answer, Lens, Progress, ServiceMessage } from "../messages" */
/** @import { Tracked } from "../device/device_tracker.js" */
import { DeviceTracker } from "../device/device_tracker.js";
import { samplesHeader } from "../device/framing.js";
import { Stream } from "../device/stream.js";
import { sentSize } from "./intrinsics.js";
import { LocalMap } from "./local_map.js";
import { moduleOf, odometryThread } from "./odometry_files.js";

const RECORD_INTERVAL = 60; // ms between images of a new map while the answer is on its way
const NO_POINTS = new Float32Array(0);

/**
 * A camera in a map ("track"), one that makes a map ("record"), or one without a map and a server ("alone"). Events: "link", "answer", "progress", "saved",
 * "said" (its detail: a text for a person).
 */
export class Session extends EventTarget {
  /** @type {DeviceTracker | null} */ tracker = null; // none in a recording: the server needs all images
  /** @type {Stream | null} */ stream = null; // none without a server
  /** @type {LocalMap | null} */ local = null; // what stands where there is no map
  /** @type {Answer | null} */ answer = null; // the last
  /** @type {Tracked | null} */ tracked = null; // the last image
  /** @type {Progress | null} */ progress = null;
  isFinishing = false;
  /** @type {string | null} */ why = null; // why there is no connection
  lensKey = ""; // of the lens that the tracker was told

  /**
   * @param {{ service: import("../service.js").Service, state: import("./map_state.js").MapState, source: import("./video_source.js").VideoSource,
   *   gravity: import("./gravity.js").GravitySensor, gyroscope: import("./gyroscope.js").Gyroscope, cameras: import("./intrinsics.js").KnownCameras }} parts
   * @param {string} map  @param {"track" | "record" | "alone"} kind  @param {{ share?: "images" | "features" }} [options]
   */
  constructor({ service, state, source, gravity, gyroscope, cameras }, map, kind, { share = "images" } = {}) {
    super();
    this.service = service;
    this.state = state;
    this.source = source;
    this.gravity = gravity;
    this.gyroscope = gyroscope;
    this.cameras = cameras;
    this.map = map;
    this.kind = kind;
    if (kind === "record") this.stream = new Stream({ ...service.socketOf(map, kind), comesBack: false });
    else this.follow(kind === "track" ? { url: service.base, map, token: service.token } : null, share, moduleOf(service));
    this.stream?.addEventListener("link", (/** @type {any} */ { detail }) => this.takeLink(detail));
    this.stream?.addEventListener("message", (/** @type {any} */ { detail }) => this.take(detail));
  }

  follow(service, share, wasm) {
    const tracker = new DeviceTracker({ service, share, wasm, worker: odometryThread });
    this.tracker = tracker;
    this.stream = tracker.stream;
    tracker.addEventListener("camera", (/** @type {any} */ { detail }) => this.cameras.remember(this.source.lens, detail));
    tracker.addEventListener("problem", (/** @type {any} */ { detail }) => this.say(detail));
    if (service) return;
    this.local = new LocalMap(this.state, tracker);
    tracker.addEventListener("run", () => this.local?.clear() && this.say("the camera lost its way: what was placed is gone"));
  }

  takeLink(now) {
    if (now === "waiting") {
      this.answer = null;
      this.service.whyNot(this.map, this.kind).then((why) => {
        this.why = why;
        this.tell("link");
      });
    }
    if (now === "open") this.why = null;
    this.tell("link");
  }

  /** @param {ServiceMessage} message */
  take(message) {
    if (message.type === "hello" || message.type === "map") {
      this.state.enter(message);
      if (message.type === "map") this.say("the map was replaced");
    } else if (message.type === "anchors") this.state.edit(message);
    else if (message.type === "pose") {
      this.answer = message;
      this.tell("answer");
    } else if (message.type === "progress") {
      this.progress = message;
      this.tell("progress");
    } else if (message.type === "saved") {
      this.map = message.map ?? this.map;
      this.tell("saved");
    } else if (message.type === "error") {
      this.isFinishing = false; // the recording goes on if its map could not be saved
      this.say(message.message);
      this.tell("answer");
    }
  }

  // Of the images that are tracked and sent.
  get size() {
    const { width, height } = this.source.size;
    return sentSize(width, height);
  }

  /** What the browser knows of the lens. @returns {Lens | null} */
  get knownLens() {
    return this.cameras.recall(this.source.lens, this.size);
  }

  /** Follows the camera with the image that was taken last. @param {ImageData} image  @param {number} time  @returns {Promise<Tracked>} */
  async process(image, time) {
    const gravity = this.gravity.read(this.source.isFront);
    const gyroscope = this.gyroscope.read(this.source.isFront);
    const jpeg = () => this.source.jpeg();
    if (!this.tracker) this.record({ time, gravity, gyroscope, jpeg });
    else {
      const { label, deviceId, width, height } = this.source.lens;
      const key = [label, deviceId, width, height].join();
      if (key !== this.lensKey) this.tracker.setCamera(this.knownLens);
      this.lensKey = key;
    }
    this.tracked = (await this.tracker?.process({ image, time, gravity, gyroscope, jpeg })) ??
      { time, state: "starting", camera: null, pose: null, world: null, age: null, sigma: null, depth: null, metresPerUnit: null, points: NO_POINTS };
    return this.tracked;
  }

  // Sends an image of a new map, if it is time for one.
  record({ time, gravity, gyroscope, jpeg }) {
    const stream = /** @type {Stream} */ (this.stream);
    if (this.isFinishing || !stream.isDue(0, RECORD_INTERVAL)) return;
    const id = stream.begin();
    const camera = this.knownLens ?? "auto";
    const header = { id, time, camera, ...(gravity && { gravity }), ...samplesHeader(gyroscope) };
    stream.sendImage(jpeg().then((body) => ({ header, body })));
  }

  /** An edit of the anchors. @param {import("../messages").Request} message */
  send(message) {
    if (this.local) this.local.edit(message);
    else this.stream?.send(message);
  }

  finish() {
    this.isFinishing = true;
    this.stream?.send({ type: "finish" });
  }

  end() {
    this.tracker?.end();
    this.stream?.end();
  }

  say(text) {
    this.dispatchEvent(new CustomEvent("said", { detail: text }));
  }

  tell(part) {
    this.dispatchEvent(new Event(part));
  }
}
