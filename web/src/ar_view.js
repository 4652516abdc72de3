// Augmented reality: content stands on the map's anchors in the camera's image, behind what the map knows to be before it.
import { DirectionalLight, Group, Matrix4, PerspectiveCamera, Quaternion, Raycaster, Scene, Vector3, WebGLRenderer } from "three";
import { AnchorsLayer } from "./anchors_layer.js";
import { lightAround } from "./content.js";
import { objectAt, paintImage } from "./image_area.js";
import { OccludersLayer } from "./occluders_layer.js";
import { onceAFrame } from "./once_a_frame.js";

// From the axes of images (x right, y down, z forward) to those of three.js.
const FLIP = new Quaternion(1, 0, 0, 0);
const NO_POSE = { lost: "lost: content comes back when the camera is found", initializing: "initializing: content comes when there is a map" };

export class ArView {
  // `upright` turns the map's up to that of the page (light comes from there).
  constructor(element, store, content, upright) {
    this.name = "AR";
    this.element = element;
    this.store = store;
    this.upright = upright;
    this.invalidate = onceAFrame(() => this.draw());
    this.image = document.createElement("canvas");
    this.note = document.createElement("div");
    this.note.className = "note pill";
    this.note.hidden = true;
    this.caption = document.createElement("div");
    this.caption.className = "caption";
    element.append(this.image, this.note, this.caption);
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
    this.isPlacing = false;
    this.area = null;
    this.size = ""; // that the overlay was made for
    this.extent = null; // of all that is drawn
    for (const part of ["map", "frame", "anchors", "status", "restart"]) store.addEventListener(part, () => this.update(part));
    new ResizeObserver(() => this.invalidate()).observe(element);
    addEventListener("resize", () => this.invalidate()); // another screen: other pixels, the same size
    element.addEventListener("click", (event) => this.click(event));
  }

  get frame() {
    return this.store.chosen ?? this.store.frame;
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

  draw() {
    if (this.element.clientWidth === 0 || this.element.clientHeight === 0) return;
    const { frame } = this;
    this.shown = frame; // what a click is on
    const { context, area } = paintImage(this.image, this.element, frame);
    this.area = area;
    this.isShowing = Boolean(frame?.pose);
    this.element.dataset.showing = this.isShowing;
    this.element.classList.toggle("empty", !frame);
    this.caption.textContent = frame ? `frame ${frame.frame}` : this.store.status.live ? "waiting for the first image" : "choose a moment on the timeline";
    this.note.hidden = !frame || this.isShowing;
    this.note.textContent = NO_POSE[frame?.state] ?? "no pose";
    this.note.dataset.state = frame?.state ?? "";
    this.render();
    if (this.isShowing && !frame.bitmap) this.paintLandmarks(context);
  }

  render() {
    if (!this.renderer) {
      if (!this.isShowing) return;
      this.renderer = new WebGLRenderer({ antialias: true, alpha: true, preserveDrawingBuffer: true });
      this.renderer.domElement.className = "overlay";
      this.image.after(this.renderer.domElement);
      lightAround(this.scene, this.renderer, 0.45);
    }
    const { renderer, area, element } = this;
    const [width, height] = [element.clientWidth, element.clientHeight];
    const size = [width, height, Math.min(devicePixelRatio, 2)];
    if (size.join() !== this.size) {
      this.size = size.join();
      renderer.setDrawingBufferSize(...size);
    }
    // All of it: the image before may have been of another shape.
    renderer.setScissorTest(false);
    renderer.clear();
    if (!this.isShowing) return this.anchors.labels.hide();
    this.occluders.arrange();
    this.world.quaternion.copy(this.upright);
    this.aim(this.shown.pose, this.shown.camera, width, height);
    renderer.setScissorTest(true);
    renderer.setScissor(area.offset[0], area.offset[1], area.camera.width * area.scale, area.camera.height * area.scale);
    renderer.render(this.scene, this.camera);
    this.anchors.placeLabels();
  }

  // The true camera, of the whole element: its image is the part that the area takes.
  aim(pose, { fx, fy, cx, cy }, width, height) {
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

  // Without an image, what there is to go by.
  paintLandmarks(context) {
    const { landmarks } = this.store;
    const { pose, camera: { fx, fy, cx, cy } } = this.shown;
    const camFromMap = new Matrix4().makeRotationFromQuaternion(new Quaternion().fromArray(pose)).setPosition(pose[4], pose[5], pose[6]).invert();
    const point = new Vector3();
    const side = 1.6 / this.area.scale;
    const corner = 0.5 - side / 2;
    context.fillStyle = "rgba(200, 210, 222, .5)";
    for (let i = 0; i < landmarks.count; ++i) {
      const { x, y, z } = point.fromArray(landmarks.positions, 3 * i).applyMatrix4(camFromMap);
      if (z > 0) context.fillRect((fx * x) / z + cx + corner, (fy * y) / z + cy + corner, side, side);
    }
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

  // From the camera through a pixel, in the map's frame.
  rayThrough([u, v]) {
    const { pose, camera } = this.shown;
    const direction = new Vector3((u - camera.cx) / camera.fx, (v - camera.cy) / camera.fy, 1).normalize().applyQuaternion(new Quaternion().fromArray(pose));
    return { origin: new Vector3().fromArray(pose, 4), direction };
  }

  click(event) {
    if (!this.shown || event.target.closest(".labels")) return;
    const rect = this.element.getBoundingClientRect();
    const pixel = this.area.toPixel(event.clientX - rect.left, event.clientY - rect.top);
    if (this.isPlacing) this.place(pixel, event.shiftKey);
    else this.pick(pixel);
  }

  place(pixel, neverOnObject) {
    if (!this.isShowing || !this.area.contains(pixel)) return;
    const { origin, direction } = this.rayThrough(pixel);
    const object = neverOnObject ? null : objectAt(this.shown, pixel);
    this.onPlace?.({ origin: origin.toArray(), direction: direction.toArray(), ...(object === null ? {} : { object }) });
  }

  pick(pixel) {
    let anchor = null;
    if (this.isShowing) {
      const { origin, direction } = this.rayThrough(pixel);
      this.raycaster.set(origin.applyQuaternion(this.world.quaternion), direction.applyQuaternion(this.world.quaternion));
      anchor = this.anchors.pick(this.raycaster, this.occluders.hiding());
    }
    this.onPickAnchor?.(anchor);
    if (anchor === null) this.onPick?.(objectAt(this.shown, pixel));
  }

  setPlacing(on) {
    this.isPlacing = on;
    this.element.classList.toggle("measuring", on);
  }
}
