// A client of the service (docs/service.md) for browsers and Node: requests, and streams over a WebSocket (stream.js).
/** @import { Anchor, AnchorEdit, AnchorRequest, Anchors, Camera, Image, Localized, Map as MapSummary, Mode, StoredMap } from "./api" */
import { ServiceError } from "./service_error.js";
import { Record, Track } from "./stream.js";

/** Whether it has only the characters that a WebSocket's subprotocol may have. @param {string} token */
export const isToken = (token) => /^[A-Za-z0-9._~-]+$/.test(token);
const BASE64_PART = 0x8000; // bytes: String.fromCharCode takes no more at once everywhere

/** @typedef {Uint8Array<ArrayBuffer> | ArrayBuffer | Blob} Bytes of a JPEG or PNG file */
/** @typedef {Bytes | (Omit<Image, "image"> & { image?: Bytes })} LocalizeImage */
/**
 * @typedef {object} ClientOptions
 * @property {string} [token] that the service wants
 * @property {number} [retries] how often a request is repeated that was answered with 503, after the time that the answer says; 0
 * @property {number} [timeout] seconds after which a request without an answer ends; 60
 * @property {typeof WebSocket} [WebSocket] for streams, where there is no global one: Node before version 22
 */

/** @param {Bytes} bytes */
async function base64(bytes) {
  const buffer = bytes instanceof Blob ? await bytes.arrayBuffer() : bytes;
  if (!(buffer instanceof ArrayBuffer || buffer instanceof Uint8Array)) throw new TypeError(`image: ${bytes}, expected the bytes of a JPEG or PNG file`);
  const array = new Uint8Array(buffer);
  let text = "";
  for (let i = 0; i < array.length; i += BASE64_PART) text += String.fromCharCode(...array.subarray(i, i + BASE64_PART));
  return btoa(text);
}

const isBytes = (image) => image instanceof Uint8Array || image instanceof ArrayBuffer || image instanceof Blob;

/** The service at an address. All its methods reject with a ServiceError where the service refuses or does not answer. */
export class Client {
  /**
   * Throws a TypeError for an address or a token that cannot be.
   * @param {string | URL} url http://HOST:PORT or https://HOST:PORT, also with a path before /v1
   * @param {ClientOptions} [options]
   */
  constructor(url, { token = "", retries = 0, timeout = 60, WebSocket = globalThis.WebSocket } = {}) {
    const { protocol, search, hash, origin, pathname } = addressOf(url);
    if (!/^https?:$/.test(protocol) || search || hash) throw new TypeError(`${url}: expected http://HOST:PORT or https://HOST:PORT`);
    if (token && !isToken(token)) throw new TypeError("the token: expected letters, digits and -._~");
    this.base = origin + pathname.replace(/\/+$/, "");
    this.token = token;
    this.retries = retries;
    this.timeout = timeout;
    this.WebSocket = WebSocket;
  }

  /** Of each request, and of each for a model. @returns {{ [name: string]: string }} */
  get headers() {
    return this.token ? { Authorization: `Bearer ${this.token}` } : {};
  }

  /** @param {string} map  @param {string[]} parts */
  pathOf(map, ...parts) {
    return ["/v1/maps", ...[map, ...parts].map(encodeURIComponent)].join("/");
  }

  /** Address and subprotocols of a WebSocket. A browser sends no headers of ours with it: a subprotocol carries the token. @param {string} path */
  socket(path) {
    return { url: this.base.replace(/^http/, "ws") + path, protocols: this.token ? ["oaslam", `oaslam.token.${this.token}`] : ["oaslam"] };
  }

  /** @param {string} map  @param {"track" | "record"} kind */
  socketOf(map, kind) {
    return this.socket(this.pathOf(map, kind));
  }

  /** @returns {Promise<StoredMap[]>} */
  async maps() {
    return (await this.json("GET", "/v1/maps")).maps;
  }

  /** What is in a map. @param {string} name  @returns {Promise<MapSummary>} */
  map(name) {
    return this.json("GET", this.pathOf(name));
  }

  /** Stores a map file, in place of the map of that name if there is one. @param {string} name  @param {Bytes} file  @returns {Promise<StoredMap>} */
  uploadMap(name, file) {
    return this.json("PUT", this.pathOf(name), file, "application/octet-stream");
  }

  /** Removes a map with its anchors. @param {string} name  @returns {Promise<void>} */
  async deleteMap(name) {
    await this.json("DELETE", this.pathOf(name));
  }

  /**
   * Where images were taken: a result for each, found or not.
   * @param {string} map
   * @param {LocalizeImage[]} images bytes of files, or what is known of an image besides
   * @param {{ camera?: Camera, mode?: Mode }} [options] camera: of the images that say none; "auto" unless given. mode: what may find them
   * @returns {Promise<Localized>}
   */
  async localize(map, images, { camera, mode } = {}) {
    if (!Array.isArray(images)) throw new TypeError("images: expected a list of images");
    const entries = await Promise.all(images.map(async (each) => {
      const { image, ...rest } = /** @type {Exclude<LocalizeImage, Bytes>} */ (isBytes(each) ? { image: each } : each);
      return { ...(camera && { camera }), ...rest, ...(image && { image: await base64(image) }) };
    }));
    return this.json("POST", this.pathOf(map, "localize"), { images: entries, ...(mode && { mode }) });
  }

  /**
   * The anchors of a map; those edited after a version, and the names of those removed, if one is given.
   * @param {string} map  @param {number} [since]  @returns {Promise<Anchors>}
   */
  anchors(map, since) {
    return this.json("GET", this.pathOf(map, "anchors") + (since === undefined ? "" : `?since=${since}`));
  }

  /** Places an anchor at a pose, or where the ray from `origin` along `direction` meets the map (the object of that id). @param {string} map  @param {AnchorRequest} anchor  @returns {Promise<Anchor>} */
  placeAnchor(map, anchor) {
    return this.json("POST", this.pathOf(map, "anchors"), anchor);
  }

  /** Changes what is given of an anchor: its `name`, `model`, `size`, `pose`, or by how much it is to `turn`. @param {string} map  @param {string} name  @param {AnchorEdit} edit  @returns {Promise<Anchor>} */
  editAnchor(map, name, edit) {
    return this.json("PATCH", this.pathOf(map, "anchors", name), edit);
  }

  /** @param {string} map  @param {string} name  @returns {Promise<void>} */
  async deleteAnchor(map, name) {
    await this.json("DELETE", this.pathOf(map, "anchors", name));
  }

  /** Counters, in Prometheus' text format. @returns {Promise<string>} */
  async metrics() {
    return (await this.ask("GET", "/metrics")).text();
  }

  /** Opens a stream for a camera that is followed in a map. @param {string} map  @param {{ camera?: Camera }} [options]  @returns {Promise<Track>} */
  track(map, options) {
    return this.open(new Track(this, map, "track", options));
  }

  /** Opens a stream for a camera that makes a new map of this name. @param {string} map  @param {{ camera?: Camera }} [options]  @returns {Promise<Record>} */
  record(map, options) {
    return this.open(new Record(this, map, "record", options));
  }

  /** @template {Track | Record} T  @param {T} stream  @returns {Promise<T>} */
  async open(stream) {
    await stream.opened;
    return stream;
  }

  /** @param {string} method  @param {string} path  @param {any} [body]  @param {string} [type] of the body: JSON unless given */
  async json(method, path, body, type = "application/json") {
    const response = await this.ask(method, path, body && (type === "application/json" ? JSON.stringify(body) : body), body && type);
    try {
      return await response.json();
    } catch {
      throw new ServiceError(null, `${this.base}: is no localization service: its answer is no JSON`);
    }
  }

  /** @param {string} method  @param {string} path  @param {BodyInit} [body]  @param {string} [type]  @returns {Promise<Response>} */
  async ask(method, path, body, type) {
    for (let i = 0; ; ++i) {
      try {
        return await this.askOnce(method, path, body, type);
      } catch (error) {
        if (!(error instanceof ServiceError) || error.retryAfter === null || i >= this.retries) throw error;
        await new Promise((resolve) => setTimeout(resolve, 1000 * /** @type {number} */ (error.retryAfter)));
      }
    }
  }

  /** @param {string} method  @param {string} path  @param {BodyInit} [body]  @param {string} [type]  @returns {Promise<Response>} */
  async askOnce(method, path, body, type) {
    const headers = { ...this.headers, ...(type && { "Content-Type": type }) };
    let response;
    try {
      response = await fetch(this.base + path, { method, headers, body, signal: AbortSignal.timeout(1000 * this.timeout) });
    } catch (error) {
      throw ServiceError.unreachable(this.base, error);
    }
    if (!response.ok) throw await ServiceError.ofResponse(response);
    return response;
  }

  /**
   * Why a connection to a map fails, as an error for a person; null where nothing is wrong with it now.
   * @param {string} map  @param {"track" | "record"} kind  @returns {Promise<ServiceError | null>}
   */
  async problemOf(map, kind) {
    try {
      await (kind === "record" ? this.maps() : this.map(map));
      return null;
    } catch (error) {
      return /** @type {ServiceError} */ (error);
    }
  }
}

/** @param {string | URL} url */
function addressOf(url) {
  try {
    return new URL(url);
  } catch {
    throw new TypeError(`${url}: expected http://HOST:PORT or https://HOST:PORT`);
  }
}
