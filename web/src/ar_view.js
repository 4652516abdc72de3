/** @import { Frame, Store } from "./store.js" */
import { Matrix4, Quaternion, Vector3, WebGLRenderer } from "three";
import { ArScene } from "./ar_scene.js";
import { lightAround } from "./content.js";
import { objectAt, paintImage } from "./image_area.js";

const NO_POSE = { lost: "lost: content comes back when the camera is found", initializing: "initializing: content comes when there is a map" };

/** Augmented reality in the image of a frame, as the program sends it. */
export class ArView extends ArScene {
  /** @param {HTMLElement} element  @param {Store} store  @param {import("./content.js").Content} content  @param {import("three").Quaternion} upright */
  constructor(element, store, content, upright) {
    super(element, store, content, upright);
    this.viewer = store;
    this.image = document.createElement("canvas");
    this.note = document.createElement("div");
    this.note.className = "note pill";
    this.note.hidden = true;
    this.caption = document.createElement("div");
    this.caption.className = "caption";
    element.prepend(this.image, this.note, this.caption);
    this.isPlacing = false;
    /** @type {WebGLRenderer | undefined} */
    this.renderer = undefined;
    this.size = ""; // of the overlay
    for (const part of ["map", "frame", "anchors", "status", "restart"]) store.addEventListener(part, () => this.update(part));
    new ResizeObserver(() => this.invalidate()).observe(element);
    addEventListener("resize", () => this.invalidate()); // a screen with other pixels leaves the element's size
    element.addEventListener("click", (event) => this.click(event));
  }

  get frame() {
    return this.viewer.chosen ?? this.viewer.frame;
  }

  draw() {
    if (this.element.clientWidth === 0 || this.element.clientHeight === 0) return;
    const { frame } = this;
    this.clicked = frame; // what a click is on
    this.shown = frame?.pose ? { pose: frame.pose, camera: frame.camera } : null;
    const { context, area } = paintImage(this.image, this.element, frame);
    if (area) this.area = area;
    this.isShowing = this.shown !== null;
    this.element.dataset.showing = String(this.isShowing);
    this.element.classList.toggle("empty", !frame);
    this.caption.textContent = frame ? `frame ${frame.frame}` : this.viewer.status.live ? "waiting for the first image" : "choose a moment on the timeline";
    this.note.hidden = !frame || this.isShowing;
    this.note.textContent = (frame && NO_POSE[frame.state]) ?? "no pose";
    this.note.dataset.state = frame?.state ?? "";
    this.render(this.shown);
    if (this.shown && !frame?.bitmap) this.paintLandmarks(context, this.shown);
  }

  /** @param {import("./ar_scene.js").Shown | null} shown */
  render(shown) {
    if (!this.renderer) {
      if (!shown) return;
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
      renderer.setDrawingBufferSize(width, height, Math.min(devicePixelRatio, 2));
    }
    // The whole overlay: the last image may have had another shape.
    renderer.setScissorTest(false);
    renderer.clear();
    if (!shown) return this.anchors.labels.hide();
    this.aim(shown.pose, shown.camera, width, height);
    renderer.setScissorTest(true);
    renderer.setScissor(area.offset[0], area.offset[1], area.camera.width * area.scale, area.camera.height * area.scale);
    renderer.render(this.scene, this.camera);
    this.anchors.placeLabels();
  }

  // To see something where there is no image.
  paintLandmarks(context, { pose, camera: { fx, fy, cx, cy } }) {
    const { landmarks } = this.viewer;
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

  click(event) {
    const frame = this.clicked;
    if (!frame || event.target.closest(".labels")) return;
    const pixel = this.pixelUnder(event);
    if (this.isPlacing) this.place(frame, pixel, event.shiftKey);
    else this.pick(frame, pixel);
  }

  /** @param {Frame} frame */
  place(frame, pixel, neverOnObject) {
    if (this.isShowing && this.area.contains(pixel)) this.askToPlace(pixel, neverOnObject ? null : objectAt(frame, pixel));
  }

  /** @param {Frame} frame */
  pick(frame, pixel) {
    const anchor = this.anchorAt(pixel);
    this.onPickAnchor?.(anchor);
    if (anchor === null) this.onPick?.(objectAt(frame, pixel));
  }

  setPlacing(on) {
    this.isPlacing = on;
    this.element.classList.toggle("measuring", on);
  }
}
