// A camera in a map, or one that makes a map: images go, answers come.
import { sentSize } from "./intrinsics.js";
import { Link } from "./link.js";
import { poseArray } from "./map_state.js";
import { MotionFilter } from "./motion.js";
import { packImage } from "./framing.js";
import { Pacer } from "./pacer.js";

const SILENCE_MS = 15000; // of a connection that is as good as lost

export class Session extends EventTarget {
  // `kind`: "track" or "record". Events: "link", "answer", "progress", "saved", "said" (with `text`).
  constructor({ service, state, source, gravity, cameras }, map, kind) {
    super();
    Object.assign(this, { service, state, source, gravity, cameras, map, kind });
    this.pacer = new Pacer();
    this.motion = new MotionFilter();
    this.ids = 0;
    this.answer = null; // the last
    this.camera = null; // its intrinsics
    this.delay = null; // seconds from image to answer, smoothed
    this.progress = null;
    this.isFinishing = false;
    this.why = null; // there is no connection
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
      this.isFinishing = false; // a map that could not be saved goes on
      this.say(message.message);
      this.tell("answer");
    }
  }

  takePose(message) {
    const now = performance.now();
    this.pacer.answered(message.id, now);
    const delay = now / 1000 - message.time;
    this.delay = this.delay === null ? delay : 0.9 * this.delay + 0.1 * delay;
    this.answer = message;
    if (message.camera) this.takeCamera(message);
    if (message.pose) this.motion.add(poseArray(message.pose), message.time, message.depth);
    else this.motion.reset();
    this.tell("answer");
  }

  // What was found for a camera that was unknown is kept, unless the picture has been turned since.
  takeCamera({ camera, pose }) {
    const size = this.sentSize;
    if (camera.width !== size.width || camera.height !== size.height) return;
    this.camera = camera;
    const { lens } = this.source;
    if (pose && this.asked === "auto" && !this.cameras.recall(lens, size)) this.cameras.remember(lens, camera);
  }

  get sentSize() {
    const { width, height } = this.source.size;
    return sentSize(width, height);
  }

  // A new image is there; it is sent if it is time for one.
  async offer(time) {
    const now = performance.now();
    if (this.isFinishing || this.isEncoding || document.hidden) return;
    const maySend = this.pacer.maySend(now);
    // Also where what was sent is still on its way: the network may be gone without a word.
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
      this.link.sendBytes(packImage({ type: "image", id, time, camera: this.asked, ...(gravity ? { gravity } : {}) }, jpeg));
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
    this.dispatchEvent(Object.assign(new Event("said"), { text }));
  }

  tell(part) {
    this.dispatchEvent(new Event(part));
  }
}
