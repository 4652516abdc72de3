/** @import { ImageHeader, Request, ServiceMessage } from "../messages" */
import { Link } from "../link.js";
import { packImage } from "./framing.js";
import { Pacer } from "./pacer.js";

const SILENCE = 15000; // ms after which a connection that is open is considered lost

/** Images to the service and its messages, by a WebSocket that opens again. Events: "link" (its state has changed), "message" (its detail: the message). */
export class Stream extends EventTarget {
  pacer = new Pacer();
  ids = 0; // of images
  #isPacking = false;

  /** @param {{ url: string, protocols: string[], comesBack?: boolean }} address */
  constructor(address) {
    super();
    this.link = new Link({ ...address, onMessage: (message) => this.take(message), onState: (state) => this.follow(state) });
  }

  follow(state) {
    if (state === "waiting") this.pacer.reset();
    queueMicrotask(() => this.dispatchEvent(new CustomEvent("link", { detail: state }))); // the first time `link` is not set yet
  }

  /** @param {ServiceMessage} message */
  take(message) {
    if (message.type === "pose") this.pacer.answered(message.id);
    this.dispatchEvent(new CustomEvent("message", { detail: message }));
  }

  /** Whether an image is to be sent now. @param {number} interval  @param {number} [slow]  both as of Pacer.maySend */
  isDue(interval, slow) {
    const now = performance.now();
    const isDue = this.pacer.maySend(now, interval, slow);
    // A network that is gone says nothing: what was sent may still be on its way, then nothing more can be sent.
    if (this.link.state === "open" && this.pacer.last > this.link.heard && now - this.link.heard > SILENCE) this.link.restart();
    return isDue && !this.#isPacking && this.link.isFree;
  }

  /** Reserves the number of an image that will be sent once it is encoded. */
  begin() {
    const id = ++this.ids;
    this.pacer.sent(id, performance.now());
    return id;
  }

  /**
   * Sends an image once it is encoded: until then no other is due, since it could overtake this one.
   * @param {Promise<{ header: ImageHeader, body: Uint8Array }>} image body: the image as JPEG, or its key points
   */
  async sendImage(image) {
    this.#isPacking = true;
    try {
      const { header, body } = await image;
      this.link.sendBytes(packImage({ type: "image", ...header }, body));
    } finally {
      this.#isPacking = false;
    }
  }

  /** An image that was begun is not sent. @param {number} id */
  giveUp(id) {
    this.pacer.givenUp(id);
  }

  /** @param {Request} message */
  send(message) {
    this.link.send(message);
  }

  end() {
    this.link.end();
  }
}
