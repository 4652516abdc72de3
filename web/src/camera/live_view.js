// Content in the live picture. What is drawn belongs to the image that is shown: its pose is foretold from those of images before.
import { Vector3, WebGLRenderer } from "three";
import { ArScene } from "../ar_scene.js";
import { lightAround } from "../content.js";
import { ImageArea } from "../image_area.js";
import { Labels } from "../labels.js";
import { classColor, labelOf } from "../palette.js";
import { Backdrop } from "./backdrop.js";

export class LiveView extends ArScene {
  constructor(element, state, content, source) {
    super(element, state, content, state.upright);
    this.source = source;
    this.session = null;
    this.isPlacing = false;
    this.time = 0; // of the image that is shown
    this.shown = null;
    this.renderer = new WebGLRenderer({ antialias: true });
    this.renderer.autoClear = false;
    this.canvas = this.renderer.domElement;
    element.prepend(this.canvas);
    lightAround(this.scene, this.renderer, 0.45);
    this.backdrop = new Backdrop(source.video);
    this.names = new Labels(element, "object", () => {});
    for (const part of ["map", "anchors", "restart"]) state.addEventListener(part, () => this.update(part));
    new ResizeObserver(() => this.invalidate()).observe(element);
    this.canvas.addEventListener("click", (event) => this.click(event));
  }

  update(part) {
    super.update(part);
    if (part === "map") this.names.set(this.store.mappedObjects().map((o) => ({ key: o.id, text: labelOf(o), color: classColor(o.category_id, 70) })));
  }

  // The image of a moment is on the video element now.
  show(time) {
    this.time = time;
    this.draw();
  }

  get intrinsics() {
    const { width, height } = this.session.sentSize;
    const { camera } = this.session;
    if (camera?.width === width && camera.height === height) return camera;
    return { width, height, fx: width, fy: width, cx: (width - 1) / 2, cy: (height - 1) / 2 }; // nothing is drawn by it
  }

  draw() {
    const { element, renderer, session } = this;
    const [width, height] = [element.clientWidth, element.clientHeight];
    if (!session || !this.source.isOpen || width === 0 || height === 0) return;
    const ratio = Math.min(devicePixelRatio, 2);
    const size = [width, height, ratio];
    if (size.join() !== this.size) {
      this.size = size.join();
      renderer.setDrawingBufferSize(...size);
    }
    const camera = this.intrinsics;
    const pose = session.camera === camera ? session.motion.show(this.time) : null;
    this.shown = pose ? { pose, camera } : null;
    this.isShowing = Boolean(pose);
    element.dataset.showing = this.isShowing;
    this.area = new ImageArea(element, camera, { fills: true });
    renderer.setScissorTest(false);
    renderer.clear();
    this.backdrop.render(renderer, this.area, height, ratio);
    if (!pose) {
      this.anchors.labels.hide();
      this.names.hide();
      return;
    }
    this.aim(pose, camera, width, height);
    const { offset, scale } = this.area;
    renderer.setScissorTest(true);
    renderer.setScissor(offset[0], offset[1], camera.width * scale, camera.height * scale);
    renderer.render(this.scene, this.camera);
    this.placeNames(this.anchors.placeLabels());
  }

  placeNames(taken) {
    if (!this.occluders.outlines.visible) return this.names.hide();
    const { objects } = this.store;
    this.names.place((id) => objects.has(id) && this.toPage(new Vector3(...objects.get(id).center)), null, taken);
  }

  showObjects(on) {
    this.occluders.outlines.visible = on;
    this.invalidate();
  }

  click(event) {
    if (!this.isShowing) return;
    const pixel = this.pixelUnder(event);
    if (!this.area.contains(pixel)) return;
    if (!this.isPlacing) return this.onPickAnchor?.(this.anchorAt(pixel));
    const { origin, direction } = this.rayThrough(pixel);
    this.askToPlace(pixel, this.isOnObjects ? this.occluders.objectOn(origin, direction) : null);
  }
}
