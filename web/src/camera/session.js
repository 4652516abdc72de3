/** @import { Answer, Lens, Progress, ServiceMessage } from "../messages" */
import { sentSize } from "./intrinsics.js";
import { Link } from "../link.js";
import { poseArray } from "./map_state.js";
import { MotionFilter } from "./motion.js";
import { packImage } from "./framing.js";
import { Pacer } from "./pacer.js";

const SILENCE_MS = 15000; // after which a connection that is open is considered lost

/** A camera in a map ("track"), or one that makes a map ("record"): sends images, takes answers. Events: "link", "answer", "progress", "saved", "said" (its detail: a text for a person). */
export class Session extends EventTarget {
  pacer = new Pacer();
  motion = new MotionFilter();
  ids = 0; // of images
  /** @type {Answer | null} */ answer = null; // the last
  /** @type {Lens | null} */ camera = null;
  /** @type {Lens | "auto"} */ asked = "auto"; // the lens that the last image was sent with
  /** @type {number | null} */ delay = null; // seconds from image to answer, smoothed
  /** @type {Progress | null} */ progress = null;
  isEncoding = false;
  isFinishing = false;
  /** @type {string | null} */ why = null; // why there is no connection

  /**
   * @param {{ service: import("../service.js").Service, state: import("./map_state.js").MapState, source: import("./video_source.js").VideoSource,
   *   gravity: import("./gravity.js").GravitySensor, gyroscope: import("./gyroscope.js").Gyroscope, cameras: import("./intrinsics.js").KnownCameras }} parts
   * @param {string} map  @param {"track" | "record"} kind
   */
  constructor({ service, state, source, gravity, gyroscope, cameras }, map, kind) {
    super();
    this.service = service;
    this.state = state;
    this.source = source;
    this.gravity = gravity;
    this.gyroscope = gyroscope;
    this.cameras = cameras;
    this.map = map;
    this.kind = kind;
    this.link = new Link({ ...service.socketOf(map, kind), comesBack: kind === "track", onMessage: (message) => this.take(message), onState: (now) => this.follow(now) });
  }

  follow(now) {
    if (now === "waiting") {
      this.pacer.reset();
      this.answer = this.delay = null;
      this.service.whyNot(this.map, this.kind).then((why) => {
        this.why = why;
        this.tell("link");
      });
    }
    if (now === "open") {
      this.why = null;
      this.motion.reset();
    }
    this.tell("link");
  }

  /** @param {ServiceMessage} message */
  take(message) {
    if (message.type === "hello" || message.type === "map") {
      this.state.enter(message);
      if (message.type === "map") {
        this.motion.reset();
        this.say("the map was replaced");
      }
    } else if (message.type === "anchors") this.state.edit(message);
    else if (message.type === "pose") this.takePose(message);
    else if (message.type === "progress") {
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

  /** @param {Answer} message */
  takePose(message) {
    const now = performance.now();
    this.pacer.answered(message.id, now);
    const delay = now / 1000 - message.time;
    this.delay = this.delay === null ? delay : 0.9 * this.delay + 0.1 * delay;
    this.answer = message;
    if (message.camera) this.takeCamera(message.camera, Boolean(message.pose));
    if (message.pose) this.motion.add(poseArray(message.pose), message.time, message.depth);
    else this.motion.reset();
    this.tell("answer");
  }

  // Intrinsics that were found for an unknown camera are remembered, unless the picture was turned since the image was sent.
  takeCamera(camera, hasPose) {
    const size = this.sentSize;
    if (camera.width !== size.width || camera.height !== size.height) return;
    this.camera = camera;
    const { lens } = this.source;
    if (hasPose && this.asked === "auto" && !this.cameras.recall(lens, size)) this.cameras.remember(lens, camera);
  }

  get sentSize() {
    const { width, height } = this.source.size;
    return sentSize(width, height);
  }

  // To be called for each image of the camera: sends it if it is time for one.
  async offer(time) {
    const now = performance.now();
    if (this.isFinishing || this.isEncoding || document.hidden) return;
    const maySend = this.pacer.maySend(now);
    // Checked although what was sent may still be on its way: a network that is gone says nothing.
    if (!maySend && this.link.state === "open" && now - this.link.heard > SILENCE_MS) return void this.link.restart();
    if (!maySend || !this.link.isFree) return;
    this.isEncoding = true;
    try {
      const size = this.sentSize;
      const gravity = this.gravity.read(this.source.isFront);
      const jpeg = await this.source.jpeg(size);
      if (!this.link.isFree) return;
      const id = ++this.ids;
      this.asked = this.cameras.recall(this.source.lens, size) ?? "auto";
      const rates = this.gyroscope.read(this.source.isFront);
      const sensors = { ...(gravity && { gravity }), ...(rates.length > 0 && { angular_velocity: rates }) };
      this.link.sendBytes(packImage({ type: "image", id, time, camera: this.asked, ...sensors }, jpeg));
      this.pacer.sent(id, now);
    } finally {
      this.isEncoding = false;
    }
  }

  finish() {
    this.isFinishing = true;
    this.link.send({ type: "finish" });
  }

  end() {
    this.link.end();
  }

  say(text) {
    this.dispatchEvent(new CustomEvent("said", { detail: text }));
  }

  tell(part) {
    this.dispatchEvent(new Event(part));
  }
}
