/** @import { Anchor, Lens, MapObject, Model, Pixel, Place, Pose } from "./messages" */
import { DirectionalLight, Group, PerspectiveCamera, Raycaster, Scene, Vector3 } from "three";
import { AnchorsLayer } from "./anchors_layer.js";
import { OccludersLayer } from "./occluders_layer.js";
import { onceAFrame } from "./batched.js";
import { FLIP, rayThrough, setProjection } from "./projection.js";

/** @typedef {{ pose: Pose, camera: Lens }} Shown */
/** @typedef {EventTarget & { anchors: Anchor[], models: Model[], objects: Map<number, MapObject>, mappedObjects: () => MapObject[] }} MapContent */

/**
 * Virtual content in the image of a camera: on the map's anchors, and hidden by the objects that are before it. A view that shows an image extends it:
 * it draws, and sets `shown` and `area`.
 */
export class ArScene {
  /** @type {((id: number | null) => void) | undefined} */ onPick;
  /** @type {((name: string | null) => void) | undefined} */ onPickAnchor;
  /** @type {((where: Place) => void) | undefined} */ onPlace;
  /** @type {Shown | null} */ shown = null; // what was drawn last
  /** @type {import("./image_area.js").ImageArea} */ area; // of its image, on the element
  /** @type {{ middle: Vector3, radius: number } | null} */ extent = null; // of all content and objects
  isShowing = false;

  /**
   * `upright` turns the map's up to that of the page, where the light comes from.
   * @param {HTMLElement} element  @param {MapContent} store  @param {import("./content.js").Content} content  @param {import("three").Quaternion} upright
   */
  constructor(element, store, content, upright) {
    this.element = element;
    this.store = store;
    this.upright = upright;
    this.invalidate = onceAFrame(() => this.draw());
    this.scene = new Scene();
    this.world = new Group();
    this.scene.add(this.world);
    this.camera = new PerspectiveCamera();
    this.world.add(this.camera);
    const sun = new DirectionalLight("#ffffff", 1.2);
    sun.position.set(0.5, 2, 1);
    this.scene.add(sun);
    this.occluders = new OccludersLayer(this);
    this.anchors = new AnchorsLayer(this, content, { shadows: true });
    this.raycaster = new Raycaster();
  }

  draw() {
    throw new Error("the view that extends this draws");
  }

  // The number of contents that are drawn: those in front of the camera.
  get count() {
    if (!this.isShowing || !this.anchors.group.visible) return 0;
    return [...this.anchors.shapes.values()].filter((shape) => this.project(shape.position)).length;
  }

  update(part) {
    this.occluders.update(part);
    this.anchors.update(part);
    if (part !== "frame" && part !== "status") this.extent = null;
    this.invalidate();
  }

  /** Sets the drawing camera to that of the image: `area` is then the image's part of the element. @param {Pose} pose  @param {Lens} lens */
  aim(pose, lens, width, height) {
    this.occluders.arrange();
    this.world.quaternion.copy(this.upright);
    this.camera.position.fromArray(pose, 4);
    this.camera.quaternion.fromArray(pose).multiply(FLIP);
    const [near, far] = this.depthRange();
    setProjection(this.camera, lens, this.area, { width, height, near, far });
    this.world.updateMatrixWorld(true);
  }

  // Near and far planes around all that is drawn, whatever the map's unit is.
  depthRange() {
    this.extent ??= this.measureExtent();
    const far = Math.max(this.camera.position.distanceTo(this.extent.middle) + this.extent.radius, 1e-6);
    return [far / 5000, far];
  }

  measureExtent() {
    const { store } = this;
    const all = store.anchors.map(({ pose, size }) => ({ at: new Vector3().fromArray(pose, 4), reach: 2 * size }));
    for (const { center, half_axes } of store.mappedObjects()) all.push({ at: new Vector3(...center), reach: Math.max(...half_axes) });
    const middle = new Vector3();
    for (const { at } of all) middle.addScaledVector(at, 1 / all.length);
    return { middle, radius: Math.max(0, ...all.map(({ at, reach }) => at.distanceTo(middle) + reach)) };
  }

  /** A point of the map, from -1 to 1 over the element as it was drawn last; null behind the camera. @param {Vector3} point */
  project(point) {
    const p = point.clone().applyMatrix4(this.world.matrixWorld).applyMatrix4(this.camera.matrixWorldInverse);
    return p.z < 0 ? p.applyMatrix4(this.camera.projectionMatrix) : null;
  }

  // Whether the line of sight from the camera to a point of the map passes an object that hides it.
  isHidden(point) {
    return this.occluders.isBetween(this.camera.position, point);
  }

  // A point of the map on the element, with its depth; null where it is not in the image.
  toPage(point) {
    const p = this.project(point);
    if (!p) return null;
    const at = { x: ((p.x + 1) / 2) * this.element.clientWidth, y: ((1 - p.y) / 2) * this.element.clientHeight, depth: p.z };
    return this.area.contains(this.area.toPixel(at.x, at.y)) ? at : null;
  }

  // A point of the map in the image, in pixels; null behind the camera.
  pixelIn(point) {
    const p = this.project(point);
    return p && this.area.toPixel(((p.x + 1) / 2) * this.element.clientWidth, ((1 - p.y) / 2) * this.element.clientHeight);
  }

  // Where an anchor's origin is in the window; null where it is not drawn.
  pixelOf(name) {
    const shape = this.isShowing ? this.anchors.shapes.get(name) : null;
    const pixel = shape && this.pixelIn(shape.position);
    if (!pixel) return null;
    const rect = this.element.getBoundingClientRect();
    const { x, y } = this.area.toElement(pixel);
    return { x: rect.left + x, y: rect.top + y };
  }

  // The pixel under a pointer event.
  pixelUnder(event) {
    const rect = this.element.getBoundingClientRect();
    return this.area.toPixel(event.clientX - rect.left, event.clientY - rect.top);
  }

  /** The ray from the camera through a pixel, in the map's frame. @param {Pixel} pixel */
  rayThrough(pixel) {
    const { pose, camera } = /** @type {Shown} */ (this.shown);
    return rayThrough(pixel, pose, camera);
  }

  /** The name of the anchor whose content is seen at a pixel; null where there is none. @param {Pixel} pixel @returns {string | null} */
  anchorAt(pixel) {
    if (!this.isShowing) return null;
    const { origin, direction } = this.rayThrough(pixel);
    this.raycaster.set(origin.applyQuaternion(this.world.quaternion), direction.applyQuaternion(this.world.quaternion));
    return this.anchors.pick(this.raycaster, this.occluders.hiding());
  }

  /** Asks for content at a pixel: on top of `object`, or on the surface there where that is null. @param {Pixel} pixel  @param {number | null} object */
  askToPlace(pixel, object) {
    const { origin, direction } = this.rayThrough(pixel);
    this.onPlace?.({ origin: origin.toArray(), direction: direction.toArray(), ...(object === null ? {} : { object }) });
  }
}
