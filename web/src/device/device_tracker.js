/** @import { Answer, ImageHeader, Lens, Request, ServiceMessage, Triple, WirePose } from "../messages" */
import { editedAnchors } from "../edited_anchors.js";
import { OdometryWorker } from "../odometry/odometry_worker.js";
import { samplesHeader } from "./framing.js";
import { guessedCamera, rayOf, scaledCamera } from "./lens.js";
import { motionOf, Place } from "./place.js";
import { add, rotate } from "./rigid.js";
import { Stream } from "./stream.js";
import { surfaceAt } from "./surface.js";

/**
 * What is known of an image. `state`: "starting" (the lens is not known yet, or the odometry is being loaded), or that of the odometry. `pose`: camera to world,
 * with OpenCV's axes, where it is good enough to draw with. `world`: what it is in. `age`: seconds since the image by which the service placed the camera last.
 * `sigma`: of the position, and `depth` of what is seen, in the unit of the world. `metresPerUnit`: the length of the unit of the world "odometry", as the
 * accelerations tell it by now; null while they do not, and in a map. `points`: x and y in pixels and inverse depth (in the odometry's unit) each.
 * @typedef {object} Tracked
 * @property {number} time
 * @property {"starting" | import("../odometry/oaslam_odometry.js").State} state
 * @property {Lens | null} camera
 * @property {WirePose | null} pose
 * @property {"map" | "odometry" | null} world
 * @property {number | null} age
 * @property {number | null} sigma
 * @property {number | null} depth
 * @property {number | null} metresPerUnit
 * @property {Float32Array} points
 */

const SURE = 500; // ms between images while the place is sure
const SLOW = { sure: 1000, unsure: 300 }; // ms after which the next image is sent although the last is not answered
// The error that the odometry may have added to the position since the last answers, as a share of the depth. Below APPEARS content is shown; above GOES it is
// hidden again. While the motion is preliminary it is hidden above APPEARS.
const APPEARS = 0.01, GOES = 0.1;
const UNSURE = 0.006; // share of the depth from which on an answer is asked for at once
const OTHER_LENS = 0.02; // share by which the focal length must be off for the odometry to begin anew
const NO_POINTS = new Float32Array(0);
const FEATURES = 1000; // key points of an image that is shared as these
const FORGOTTEN = 100; // images after which an answer is not waited for any more

/**
 * A camera that is followed on the device itself. With a service it is placed in a map there, by one or two images a second; without one its world is what the
 * odometry sees. Events: "anchors", "map", "hello", "pose", "error" (messages of the service, as `detail`), "link" (the state of the connection), "run" (the
 * odometry began anew), "camera" (the lens was found, or a better one), "problem" (a text: there is no odometry).
 */
export class DeviceTracker extends EventTarget {
  /** @type {Stream | null} */ stream = null;
  /** @type {Lens | null} */ camera = null; // of the images
  place = new Place();
  /** @type {Answer | null} */ answer = null; // the last
  /** @type {import("../messages").MapMessage | null} */ map = null; // as the service has told it by now, for those who come later
  /** @type {string | null} */ problem = null; // why there is no odometry
  isPaused = false; // nothing is sent

  /** @type {OdometryWorker | null} */ #odometry = null;
  #isLensAsked = false; // of the service
  #lensSince = 0; // images up to this id may have had another one
  /** @type {Lens | null} */ #begun = null; // the lens of the odometry
  /** @type {Promise<void> | null} */ #beginning = null;
  #runs = 0; // of the odometries before this one
  #run = -1;
  /** @type {Map<number, import("./place.js").Sighting | null>} */ #sent = new Map(); // images on their way, by id
  #isShown = false;
  #isSure = false; // of the place
  /** @type {Tracked | null} */ last = null; // what the last image told
  #lastDigest = "";
  #size = { width: 0, height: 0 }; // of the images

  /**
   * @param {object} options
   * @param {{ url: string, map?: string, token?: string } | null} [options.service] its address, https://..., or with `protocols` that of a stream, wss://...
   * @param {"images" | "features"} [options.share] what of an image leaves the device
   * @param {Lens | null} [options.camera] its lens, where it is known, for images of any size
   * @param {URL | string | WebAssembly.Module} [options.wasm]
   * @param {URL | string | (() => Worker)} [options.worker]
   */
  constructor({ service = null, share = "images", camera = null, wasm, worker }) {
    super();
    this.share = share;
    this.given = camera; // for images of any size
    this.#isLensAsked = !camera;
    this.wasm = wasm;
    this.worker = worker;
    if (service) this.#connect(service);
  }

  #connect({ url, map = "", token = "" }) {
    const address = `${url.replace(/^http/, "ws").replace(/\/$/, "")}/v1/maps/${encodeURIComponent(map)}/track`;
    this.stream = new Stream({ url: address, protocols: token ? ["oaslam", `oaslam.token.${token}`] : ["oaslam"] });
    this.stream.addEventListener("message", (/** @type {any} */ { detail }) => this.#take(detail));
    this.stream.addEventListener("link", (/** @type {any} */ { detail }) => {
      if (detail === "waiting") this.#lostLink();
      this.#tell("link", detail);
    });
  }

  // Another connection begins with a guess of the lens: what is known by now is better.
  #lostLink() {
    this.answer = null;
    if (this.camera) this.#isLensAsked = false;
  }

  /** The world's direction up; null where it is not known. */
  /** @type {Triple | null} */ up = null;

  /** Sets the lens, for images of any size of its shape; null: the service is asked for it. @param {Lens | null} camera */
  setCamera(camera) {
    this.given = camera;
    this.camera = null;
    this.#isLensAsked = !camera;
    this.#lensSince = this.stream?.ids ?? 0;
  }

  /**
   * Follows the camera with its next image. One image at a time: a caller that has newer ones leaves out the old ones. `gyroscope`: rows of time, x, y, z, in
   * rad/s about the camera's axes, or of an IMU, as for Odometry.process. `gravity`: in these axes. `jpeg`: encodes this image; called before the promise is
   * settled, where it is to be sent.
   * @param {{ image: ImageData, time: number, gyroscope?: number[][], gravity?: Triple | null, jpeg?: () => Promise<Uint8Array> }} given
   * @returns {Promise<Tracked>}
   */
  async process({ image, time, gyroscope = [], gravity = null, jpeg }) {
    this.#size = { width: image.width, height: image.height };
    this.#fitCamera(image.width, image.height);
    const estimate = await this.#follow(image, time, gyroscope);
    const isBlind = !estimate || !estimate.camFromOdom;
    const sighting = estimate && this.place.see(estimate, time);
    if (estimate && estimate.run !== this.#run) {
      const isFirst = this.#run < 0;
      this.#run = estimate.run;
      if (!isFirst) this.#begunAnew();
    }
    const down = estimate?.gravity ?? gravity; // without the acceleration of the hand
    if (sighting && down) this.#learnUp(sighting, down);
    /** @type {Tracked} */
    const tracked = {
      time, camera: this.camera, state: estimate?.state ?? "starting", pose: null, world: null, age: null, sigma: null, depth: null, metresPerUnit: null,
      points: estimate?.points ?? NO_POINTS,
    };
    if (!isBlind && this.stream) this.#placeInMap(tracked, sighting);
    else if (!isBlind && sighting) Object.assign(tracked, { pose: sighting.pose, world: "odometry", depth: sighting.depth, metresPerUnit: estimate.metresPerUnit });
    this.last = tracked;
    if (this.stream && !this.isPaused) this.#offer({ estimate, sighting, time, gyroscope, gravity, jpeg });
    return tracked;
  }

  // The lens as it is for images of this size.
  #fitCamera(width, height) {
    const { camera, given } = this;
    if (camera && camera.width === width && camera.height === height) return;
    const isSameShape = given && Math.abs((given.width * height) / (given.height * width) - 1) < 0.01;
    const isAsked = this.stream && this.share === "images";
    this.camera = isSameShape ? scaledCamera(/** @type {Lens} */ (given), width, height) : isAsked ? null : guessedCamera(width, height);
    if (!this.camera) this.#isLensAsked = true;
  }

  // What the odometry tells of the image; null where there is none yet.
  async #follow(image, time, gyroscope) {
    const { camera } = this;
    const begun = this.#begun;
    const isOther = camera && begun && (camera.width !== begun.width || camera.height !== begun.height || Math.abs(camera.fx / begun.fx - 1) > OTHER_LENS);
    if (isOther) this.#end();
    if (camera && !this.#begun) this.#begin(camera);
    if (!this.#odometry || this.#beginning) return null;
    try {
      const estimate = await this.#odometry.process(image, time, gyroscope);
      return { ...estimate, run: estimate.run + this.#runs };
    } catch (error) {
      if (this.#odometry) this.#failed(error);
      return null;
    }
  }

  #begin(camera) {
    this.#begun = camera;
    const worker = typeof this.worker === "function" ? this.worker() : this.worker;
    this.#beginning = OdometryWorker.create({ camera, wasm: this.wasm, worker }).then((odometry) => {
      if (this.#begun === camera) this.#odometry = odometry;
      else odometry.delete();
    }, (error) => this.#failed(error)).finally(() => (this.#beginning = null));
  }

  #failed(error) {
    this.problem = error.message;
    this.#odometry?.delete();
    this.#odometry = null;
    this.#tell("problem", error.message);
  }

  #end() {
    this.#odometry?.delete();
    this.#odometry = this.#begun = null;
    this.#runs = this.#run + 1; // a number is that of one run
  }

  #begunAnew() {
    this.#isShown = false;
    this.up = null;
    this.#tell("run", { run: this.#run });
  }

  // Up is against gravity, in the world: the newest images count most.
  #learnUp({ pose }, gravity) {
    if (this.stream) return;
    const [x, y, z] = rotate(pose.rotation, gravity);
    const length = Math.hypot(x, y, z);
    if (length < 1) return; // in free fall, or the sensor says nothing
    const next = add(this.up ?? [0, 0, 0], [-x / length, -y / length, -z / length], this.up ? 0.02 : 1);
    const scale = 1 / Math.hypot(...next);
    this.up = [next[0] * scale, next[1] * scale, next[2] * scale];
  }

  #placeInMap(tracked, sighting) {
    const placed = this.place.poseOf(sighting, tracked.time);
    if (!placed) return void (this.#isShown = false);
    const { position, rotation, age, sigma, drift, depth } = placed;
    this.#isSure = drift < UNSURE * depth;
    this.#isShown = drift < (this.#isShown && !sighting.isPreliminary ? GOES : APPEARS) * depth;
    Object.assign(tracked, { age, sigma, depth });
    if (this.#isShown) Object.assign(tracked, { pose: { position, rotation }, world: "map" });
  }

  // Sends the image where it is time for one.
  async #offer({ estimate, sighting, time, gyroscope, gravity, jpeg }) {
    const stream = /** @type {Stream} */ (this.stream);
    const { pose, state } = /** @type {Tracked} */ (this.last);
    const isSure = pose && state !== "uncertain" && state !== "inertial" && this.#isSure;
    if (!stream.isDue(isSure ? SURE : 0, isSure ? SLOW.sure : SLOW.unsure)) return;
    const sharesFeatures = this.share === "features" && this.#odometry;
    if (this.share === "features" ? !sharesFeatures || !estimate : !jpeg) return;
    const id = stream.begin();
    const motion = estimate && motionOf(estimate);
    this.#sent.set(id, motion && sighting);
    for (const old of this.#sent.keys()) if (old < id - FORGOTTEN) this.#sent.delete(old);
    /** @type {ImageHeader} */
    const header = {
      id, time, camera: this.#isLensAsked && !sharesFeatures ? "auto" : (this.camera ?? "auto"),
      ...(estimate && { motion }), ...(gravity && { gravity }), ...(!estimate && samplesHeader(gyroscope)),
    };
    const encoded = sharesFeatures
      ? sharesFeatures.features(FEATURES).then(({ bytes, ...features }) => ({ header: { ...header, features }, body: bytes }))
      : /** @type {() => Promise<Uint8Array>} */ (jpeg)().then((body) => ({ header, body }));
    try {
      await stream.sendImage(encoded);
    } catch (error) {
      if (sharesFeatures && sharesFeatures !== this.#odometry) return stream.giveUp(id); // the images have another size by now
      this.#tell("problem", /** @type {Error} */ (error).message);
    }
  }

  /** @param {ServiceMessage} message */
  #take(message) {
    if (message.type === "pose") this.#takePose(message);
    else if (message.type === "hello" || message.type === "map") {
      const { digest = "" } = message;
      if (message.type === "map" || digest !== this.#lastDigest) this.place.reset();
      this.#lastDigest = digest;
    }
    this.#keepMap(message);
    this.#tell(message.type, message);
  }

  /** @param {ServiceMessage} message */
  #keepMap(message) {
    if (message.type === "hello" || message.type === "map") this.map = message;
    else if (message.type === "anchors" && this.map) this.map = { ...this.map, anchors: editedAnchors(this.map.anchors ?? [], message) };
  }

  /** @param {Answer} message */
  #takePose(message) {
    this.answer = message;
    const sighting = this.#sent.get(message.id) ?? null;
    this.#sent.delete(message.id);
    if (message.camera && message.id > this.#lensSince) this.#takeCamera(message.camera);
    this.place.take(message, sighting, this.last?.time ?? 0);
  }

  // A lens that was asked for becomes better with the first answers. Not if the image has been turned since.
  #takeCamera(camera) {
    if (!this.#isLensAsked || this.share !== "images" || camera.width !== this.#size.width || camera.height !== this.#size.height || this.camera?.fx === camera.fx) return;
    this.camera = this.given = camera;
    this.#tell("camera", camera);
  }

  /**
   * Where the ray of a pixel of the last image meets what the odometry sees: the point and the surface's normal, in the world of its pose. Null where that is
   * not known.
   * @param {number} x  @param {number} y  @returns {{ position: Triple, normal: Triple } | null}
   */
  hit(x, y) {
    return this.camera ? this.hitAlong(rayOf(this.camera, [x, y])) : null;
  }

  /** The same for a ray in the camera's axes, with z = 1. @param {Triple} ray */
  hitAlong(ray) {
    const { pose, points, camera, world } = this.last ?? {};
    if (!pose || !camera || !points) return null;
    const found = surfaceAt(ray, points, camera);
    if (!found) return null;
    const depth = found.depth * (world === "map" ? (this.place.fit?.scale ?? 1) : 1);
    return { position: add(pose.position, rotate(pose.rotation, ray), depth), normal: rotate(pose.rotation, found.normal) };
  }

  /** To the service. @param {Request} message */
  send(message) {
    this.stream?.send(message);
  }

  /** Ends the connection and the odometry. */
  end() {
    this.stream?.end();
    this.#end();
  }

  #tell(type, detail) {
    this.dispatchEvent(new CustomEvent(type, { detail }));
  }
}
