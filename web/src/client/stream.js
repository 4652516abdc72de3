// Cameras over a WebSocket: followed in a map, or making a new one.
/** @import { Anchor, Camera, Detection, Vector } from "./api" */
/** @import { ServiceMessage, Request } from "../messages" */
import { packImage } from "../device/framing.js";
import { ServiceError } from "./service_error.js";

/**
 * What is sent with an image; each may be missing.
 * @typedef {object} ImageFacts
 * @property {number} [time] when it was taken: seconds of any clock that ascends; now unless given
 * @property {Camera} [camera] that of the stream unless given
 * @property {Vector} [gravity] m/s2, in the camera's axes (x right, y down, z forward), pointing down
 * @property {[number, number, number, number][]} [angular_velocity] rows of time, x, y, z in rad/s about these axes, best those of the last second
 * @property {[number, number, number, number, number, number, number][]} [imu] instead: rows of time, wx, wy, wz, ax, ay, az along the IMU's axes, rad/s and m/s2 with gravity
 * @property {{ position: Vector, rotation: number[] }} [cam_from_imu] how the IMU lies to the camera, metres and x y z w, with each image; as the camera unless given
 * @property {Detection[]} [detections]
 * @property {object} [motion] what the odometry of the device tells
 */

/**
 * A connection of a camera. Each message of the service (docs/service.md) is an event of its type, whose `data` is the message: "pose", "anchors",
 * "map", "progress", "error". "close" comes at the end.
 */
export class Stream extends EventTarget {
  /** @type {any} the first message of the service, which tells what is in the map */ hello = null;
  /** @type {Promise<void>} */ opened;
  isClosed = false;
  ids = 0;

  /** Client.track and Client.record open it. @param {import("./client.js").Client} client  @param {string} map  @param {"track" | "record"} kind  @param {{ camera?: Camera }} [options] */
  constructor(client, map, kind, { camera = "auto" } = {}) {
    super();
    this.camera = camera;
    if (!client.WebSocket) throw new TypeError("no WebSocket: Node has one from version 22 on; give another one to the client, as that of the package ws");
    const { url, protocols } = client.socketOf(map, kind);
    this.socket = new client.WebSocket(url, protocols);
    this.socket.binaryType = "arraybuffer";
    this.socket.addEventListener("message", ({ data }) => this.take(JSON.parse(data)));
    this.socket.addEventListener("close", ({ code, reason }) => this.end(code, reason));
    this.socket.addEventListener("error", () => this.end(1006, "")); // Node 20 tells nothing more of a connection that failed
    this.opened = this.waitFor("hello").then(
      (hello) => void (this.hello = hello),
      async (error) => {
        throw (await client.problemOf(map, kind)) ?? error;
      },
    );
  }

  /**
   * Sends a JPEG file; returns the id that its pose will have. While one image is worked at, the service keeps only the newest of those that come.
   * @param {Uint8Array} jpeg  @param {ImageFacts} [facts]
   */
  sendImage(jpeg, { time = performance.now() / 1000, camera = this.camera, ...facts } = {}) {
    const id = this.ids++;
    this.sendRaw(packImage({ type: "image", id, time, camera, ...facts }, jpeg));
    return id;
  }

  /** Sends a message that is no image: of type "place", "anchor" or "finish". @param {Request} message */
  send(message) {
    this.sendRaw(JSON.stringify(message));
  }

  /** @param {any} data */
  sendRaw(data) {
    if (this.isClosed) throw new ServiceError(null, "the stream is closed");
    this.socket.send(data);
  }

  /**
   * The next message of one of these types that comes after this call. Rejects with a ServiceError where an "error" that is not among them comes first,
   * or the end of the stream.
   * @param {string[]} types  @returns {Promise<any>}
   */
  waitFor(...types) {
    return new Promise((resolve, reject) => {
      const ends = [...new Set([...types, "error", "close"])];
      const take = (/** @type {any} */ { type, data }) => {
        for (const each of ends) this.removeEventListener(each, take);
        if (types.includes(type)) resolve(data);
        else reject(new ServiceError(null, type === "close" ? data.reason || "the server ended the connection" : data.message));
      };
      for (const each of ends) this.addEventListener(each, take);
    });
  }

  close() {
    this.socket.close();
  }

  /** @param {ServiceMessage} message */
  take(message) {
    this.note(message);
    this.dispatchEvent(new MessageEvent(message.type, { data: message }));
  }

  /** @param {number} code  @param {string} reason */
  end(code, reason) {
    if (this.isClosed) return;
    this.isClosed = true;
    this.dispatchEvent(new MessageEvent("close", { data: { code, reason } }));
  }

  /** For what a kind of stream remembers of messages. @param {any} message */
  note(message) {
    void message;
  }
}

/** A camera that is followed in a map. */
export class Track extends Stream {
  /** @type {Map<string, Anchor>} those of the map by name, up to date */ anchors = new Map();

  /** @param {any} message */
  note({ type, anchors = [], removed = [] }) {
    if (type === "hello" || type === "map") this.anchors.clear();
    for (const name of removed) this.anchors.delete(name);
    for (const anchor of anchors) this.anchors.set(anchor.name, anchor);
  }
}

/** A camera that makes a new map. A stream that ends without `finish` leaves nothing. */
export class Record extends Stream {
  /** Saves the map. Rejects with a ServiceError where there is none yet. @returns {Promise<{ map: string, digest: string }>} */
  finish() {
    const saved = this.waitFor("saved");
    this.send({ type: "finish" });
    return saved;
  }
}
