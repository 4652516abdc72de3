/** @import { ArSession } from "../ar/session.js" */
/** @import { Lens, Pixel } from "../messages" */
import { Box3, CanvasTexture, Group, LinearFilter, Matrix4, Quaternion, Raycaster, Sphere, Vector3 } from "three";
import { AnchorsLayer } from "../anchors_layer.js";
import { Backdrop } from "../camera/backdrop.js";
import { MapState, poseArray } from "../camera/map_state.js";
import { Content } from "../content.js";
import { guessedCamera } from "../device/lens.js";
import { ImageArea } from "../image_area.js";
import { OccludersLayer } from "../occluders_layer.js";
import { FLIP, rayThrough, setProjection } from "../projection.js";

const DEPTH_RATIO = 5000; // of the far plane to the near one
const FIRST = -1e6; // render order of the picture
const UP = new Vector3(0, 1, 0);

/**
 * Where a tap meets what the camera sees. `position` and `normal` are in the layer's frame, `distance` is from the camera.
 * @typedef {{ position: Vector3, normal: Vector3 | null, distance: number }} Hit
 */

/**
 * Content in the picture of the device's camera, as one object of any scene of three.js. Its frame has y up; what is added to it stands where it was
 * added while the camera moves. The picture is drawn behind all else, as a mesh beside the layer. With a service, the content of the map's anchors
 * stands in it too, hidden by the map's objects that are before it.
 *
 * Call `update` before each drawing. While no pose is known, the layer is not visible. Where the odometry begins anew, or the map is replaced, nothing
 * is known of where content was: that of `place` is removed, and the layer dispatches "restart".
 */
export class ArLayer extends Group {
  /** @type {ImageArea | null} of the picture on the canvas, as it was drawn last */ area = null;
  /** The map, with a service. */ store = new MapState();
  /** In the map's or the odometry's frame. */ world = new Group();
  element = document.createElement("div"); // AnchorsLayer writes names there: they are in no page
  #texture = Object.assign(new CanvasTexture(document.createElement("canvas")), { minFilter: LinearFilter, generateMipmaps: false });
  #backdrop = new Backdrop();
  #upright = new Quaternion(); // from the world's frame to the layer's
  #knowsUp = false;
  /** @type {"map" | "odometry" | null} */ #drawn = null; // the world that content stands in
  /** @type {Group} */ #placed = new Group();
  #raycaster = new Raycaster();

  /**
   * @param {ArSession} session
   * @param {{ content?: import("../anchors_layer.js").OwnContent }} [options] content: what stands on an anchor, of size 1 and with y up; where it gives
   *   nothing, the model that the service has for it
   */
  constructor(session, { content } = {}) {
    super();
    this.session = session;
    this.add(this.world, this.#placed);
    this.content = new Content(this.store);
    this.occluders = new OccludersLayer(this);
    this.anchors = new AnchorsLayer(this, this.content, { shadows: true, own: content });
    const { mesh, uniforms } = this.#backdrop;
    uniforms.map.value = this.#texture;
    mesh.renderOrder = FIRST;
    mesh.visible = false;
    this.addEventListener("added", () => this.parent?.add(mesh));
    this.addEventListener("removed", () => mesh.removeFromParent());
    this.#listen();
  }

  #listen() {
    const { tracker } = this.session;
    tracker.addEventListener("run", () => this.#restart());
    for (const type of ["hello", "map"]) tracker.addEventListener(type, (/** @type {any} */ { detail }) => this.#enterMap(detail));
    tracker.addEventListener("map", () => this.#restart());
    tracker.addEventListener("anchors", (/** @type {any} */ { detail }) => this.store.edit(detail));
    for (const part of ["restart", "map", "anchors"]) {
      this.store.addEventListener(part, () => {
        this.occluders.update(part);
        this.anchors.update(part);
      });
    }
    if (tracker.map) this.#enterMap(tracker.map); // the service was faster
  }

  // What AnchorsLayer asks of a view: this one is drawn all the time, and without names.
  invalidate() {}
  isHidden = () => false;
  toPage = () => null;

  /** @param {import("../messages").MapMessage} message */
  #enterMap(message) {
    const { client } = this.session;
    if (client) this.content.loader.setRequestHeader(client.headers);
    this.store.enter({ ...message, models: message.models?.map(({ name, url }) => ({ name, url: `${client?.base ?? ""}${url}` })) });
  }

  #restart() {
    this.#drawn = null;
    this.#placed.clear();
    this.dispatchEvent(/** @type {any} */ ({ type: "restart" }));
  }

  /**
   * To be called before each drawing: takes the last image over, and sets the camera of three.js to that of the image.
   * @param {import("three").Camera} camera  @param {HTMLCanvasElement} canvas that is drawn on
   */
  update(camera, canvas) {
    const { tracked, picture } = this.session;
    const { clientWidth: width, clientHeight: height } = canvas;
    this.visible = Boolean(tracked?.pose);
    if (!tracked || !picture || width === 0 || height === 0) return;
    this.#showPicture(picture, canvas);
    if (!tracked.pose) return;
    if (tracked.world !== this.#drawn) this.#enter(tracked.world);
    this.occluders.arrange();
    this.#aim(camera, tracked.pose);
    const far = this.#extent(camera);
    setProjection(camera, /** @type {Lens} */ (this.area?.camera), /** @type {ImageArea} */ (this.area), { width, height, near: far / DEPTH_RATIO, far });
  }

  /** @param {HTMLCanvasElement} picture  @param {HTMLCanvasElement} canvas */
  #showPicture(picture, canvas) {
    const texture = this.#texture;
    if (texture.image !== picture) {
      if (texture.image.width !== picture.width || texture.image.height !== picture.height) texture.dispose(); // its memory has a size
      texture.image = picture;
      texture.needsUpdate = true;
    }
    this.#backdrop.mesh.visible = true;
    this.area = new ImageArea(canvas, this.session.tracked?.camera ?? guessedCamera(picture.width, picture.height), { fills: true });
    this.#backdrop.cover(this.area, canvas.clientHeight, canvas.width / canvas.clientWidth);
  }

  /** Begins in a world: its up is that of the map, that of gravity, or that of a camera held upright. @param {"map" | "odometry" | null} world */
  #enter(world) {
    if (this.#drawn) this.#restart();
    this.#drawn = world;
    const { up } = this.session.tracker;
    this.#knowsUp = world === "map" || Boolean(up);
    if (world === "map") this.#upright.copy(this.store.upright);
    else this.#upright.setFromUnitVectors(new Vector3(...(up ?? [0, -1, 0])), UP);
    this.world.quaternion.copy(this.#upright);
  }

  /** @param {import("three").Camera} camera  @param {{ position: ArrayLike<number>, rotation: ArrayLike<number> }} pose */
  #aim(camera, { position, rotation }) {
    const at = new Matrix4().compose(
      new Vector3().fromArray(position).applyQuaternion(this.#upright),
      this.#upright.clone().multiply(new Quaternion().fromArray(rotation)).multiply(FLIP),
      new Vector3(1, 1, 1),
    );
    this.updateWorldMatrix(true, false);
    at.premultiply(this.matrixWorld);
    if (camera.parent) {
      camera.parent.updateWorldMatrix(true, false);
      at.premultiply(camera.parent.matrixWorld.clone().invert());
    }
    at.decompose(camera.position, camera.quaternion, camera.scale);
    camera.updateMatrixWorld(true);
  }

  /** How far from the camera content is at most. @param {import("three").Camera} camera */
  #extent(camera) {
    const ball = new Box3().setFromObject(this).getBoundingSphere(new Sphere());
    return ball.isEmpty() ? 1 : ball.center.distanceTo(camera.getWorldPosition(new Vector3())) + ball.radius;
  }

  /** @param {number} x  @param {number} y  @returns {Pixel | null} */
  #pixelAt(x, y) {
    const pixel = this.visible ? this.area?.toPixel(x, y) : null;
    return pixel && this.area?.contains(pixel) ? pixel : null;
  }

  /**
   * Where the camera's ray through a point of the canvas meets what it sees; null where nothing is known there.
   * @param {number} x CSS pixels from the canvas's left  @param {number} y from its top  @returns {Hit | null}
   */
  hit(x, y) {
    const pixel = this.#pixelAt(x, y);
    const hit = pixel && this.session.tracker.hit(...pixel);
    const pose = this.session.tracked?.pose;
    if (!hit || !pose) return null;
    const [position, normal] = [hit.position, hit.normal].map((v) => (v ? new Vector3().fromArray(v).applyQuaternion(this.#upright) : null));
    return { position: /** @type {Vector3} */ (position), normal, distance: new Vector3().fromArray(hit.position).distanceTo(new Vector3().fromArray(pose.position)) };
  }

  /**
   * The ray through a point of the canvas in the map's frame, as the service takes it to place an anchor; null where the camera is not in a map.
   * @param {number} x  @param {number} y  @returns {{ origin: import("../client/api").Vector, direction: import("../client/api").Vector } | null}
   */
  ray(x, y) {
    const pixel = this.#pixelAt(x, y);
    const tracked = this.session.tracked;
    if (!pixel || !tracked?.pose || tracked.world !== "map") return null;
    const { origin, direction } = rayThrough(pixel, poseArray(/** @type {any} */ (tracked.pose)), /** @type {Lens} */ (this.area?.camera));
    return { origin: origin.toArray(), direction: direction.toArray() };
  }

  /** The name of the anchor whose content is seen at a point of the canvas; null where there is none. @param {number} x  @param {number} y */
  anchorAt(x, y) {
    const pixel = this.#pixelAt(x, y);
    const pose = this.session.tracked?.pose;
    if (!pixel || !pose) return null;
    const { origin, direction } = rayThrough(pixel, poseArray(/** @type {any} */ (pose)), /** @type {Lens} */ (this.area?.camera));
    this.updateWorldMatrix(true, true);
    this.#raycaster.set(origin.applyMatrix4(this.world.matrixWorld), direction.transformDirection(this.world.matrixWorld));
    return this.anchors.pick(this.#raycaster, this.occluders.hiding());
  }

  /**
   * Puts an object where a hit is: upright where up is known, as in a map or by gravity, or else on the surface; its front (+z) is turned to the camera.
   * It is removed when the odometry begins anew.
   * @template {import("three").Object3D} T  @param {T} object  @param {Hit} hit  @returns {T}
   */
  place(object, { position, normal }) {
    const eye = new Vector3().fromArray(this.session.tracked?.pose?.position ?? [0, 0, 0]).applyQuaternion(this.#upright);
    const y = (!this.#knowsUp && normal) || UP;
    const x = new Vector3().crossVectors(y, eye.sub(position)).normalize();
    object.position.copy(position);
    object.quaternion.setFromRotationMatrix(new Matrix4().makeBasis(x, y, new Vector3().crossVectors(x, y)));
    this.#placed.add(object);
    return object;
  }

  /** Frees what is in the graphics card's memory. */
  dispose() {
    this.removeFromParent();
    this.#texture.dispose();
    this.content.forget();
  }
}
