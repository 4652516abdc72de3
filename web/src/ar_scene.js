// Virtual content in the image of a camera: on the map's anchors, behind what the map knows to be before it. What shows an image is a view that extends this.
import { DirectionalLight, Group, PerspectiveCamera, Quaternion, Raycaster, Scene, Vector3 } from "three";
import { AnchorsLayer } from "./anchors_layer.js";
import { OccludersLayer } from "./occluders_layer.js";
import { onceAFrame } from "./once_a_frame.js";

// From the axes of images (x right, y down, z forward) to those of three.js.
const FLIP = new Quaternion(1, 0, 0, 0);

export class ArScene {
  // `upright` turns the map's up to that of the page (light comes from there). A view has: draw(), `shown` (pose and camera of what is drawn), and
  // `area`, an ImageArea of it.
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
    this.isShowing = false;
    this.area = null;
    this.extent = null; // of all that is drawn
  }

  // Contents that are drawn: those before the camera.
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

  // The true camera, of the whole element: its image is the part that the area takes.
  aim(pose, { fx, fy, cx, cy }, width, height) {
    this.occluders.arrange();
    this.world.quaternion.copy(this.upright);
    this.camera.position.fromArray(pose, 4);
    this.camera.quaternion.fromArray(pose).multiply(FLIP);
    const { scale } = this.area;
    const principal = this.area.toElement([cx, cy]);
    const [near, far] = this.depthRange();
    this.camera.projectionMatrix.set(
      (2 * fx * scale) / width, 0, 1 - (2 * principal.x) / width, 0,
      0, (2 * fy * scale) / height, (2 * principal.y) / height - 1, 0,
      0, 0, -(far + near) / (far - near), (-2 * far * near) / (far - near),
      0, 0, -1, 0);
    this.camera.projectionMatrixInverse.copy(this.camera.projectionMatrix).invert();
    this.world.updateMatrixWorld(true);
  }

  // Around all that is drawn, whatever a map's unit is.
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

  // A point of the map, from -1 to 1 over the element as it was drawn last; null behind the camera.
  project(point) {
    const p = point.clone().applyMatrix4(this.world.matrixWorld).applyMatrix4(this.camera.matrixWorldInverse);
    return p.z < 0 ? p.applyMatrix4(this.camera.projectionMatrix) : null;
  }

  // Whether the line of sight from the camera to a point of the map passes an object that hides it.
  isHidden(point) {
    return this.occluders.isBetween(this.camera.position, point);
  }

  // On the element, with its depth; null where it is not in the image.
  toPage(point) {
    const p = this.project(point);
    if (!p) return null;
    const at = { x: ((p.x + 1) / 2) * this.element.clientWidth, y: ((1 - p.y) / 2) * this.element.clientHeight, depth: p.z };
    return this.area.contains(this.area.toPixel(at.x, at.y)) ? at : null;
  }

  // In the image, in pixels with integer centres; null behind the camera.
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

  // From the camera through a pixel, in the map's frame.
  rayThrough([u, v]) {
    const { pose, camera } = this.shown;
    const direction = new Vector3((u - camera.cx) / camera.fx, (v - camera.cy) / camera.fy, 1).normalize().applyQuaternion(new Quaternion().fromArray(pose));
    return { origin: new Vector3().fromArray(pose, 4), direction };
  }

  // The name of the anchor whose content is seen at a pixel; null where there is none.
  anchorAt(pixel) {
    if (!this.isShowing) return null;
    const { origin, direction } = this.rayThrough(pixel);
    this.raycaster.set(origin.applyQuaternion(this.world.quaternion), direction.applyQuaternion(this.world.quaternion));
    return this.anchors.pick(this.raycaster, this.occluders.hiding());
  }

  // What stands at a pixel is to be on top of `object`, unless that is null.
  askToPlace(pixel, object) {
    const { origin, direction } = this.rayThrough(pixel);
    this.onPlace?.({ origin: origin.toArray(), direction: direction.toArray(), ...(object === null ? {} : { object }) });
  }
}
