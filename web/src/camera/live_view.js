import { Vector3, WebGLRenderer } from "three";
import { ArScene } from "../ar_scene.js";
import { lightAround } from "../content.js";
import { ImageArea } from "../image_area.js";
import { Labels } from "../labels.js";
import { classColor, labelOf } from "../palette.js";
import { guessedCamera } from "../device/lens.js";
import { Backdrop } from "./backdrop.js";
import { poseArray } from "./map_state.js";

/** Content in the live picture, drawn with the pose of the image that is shown. */
export class LiveView extends ArScene {
  /** @type {import("./session.js").Session | null} */ session = null;
  isPlacing = false;
  isOnObjects = false; // content is placed on the tops of objects
  /** @type {import("../device/device_tracker.js").Tracked | null} */ tracked = null; // the image that is shown
  size = ""; // of the canvas

  /** @param {HTMLElement} element  @param {import("./map_state.js").MapState} state  @param {import("../content.js").Content} content  @param {import("./video_source.js").VideoSource} source */
  constructor(element, state, content, source) {
    super(element, state, content, state.upright);
    this.source = source;
    this.renderer = new WebGLRenderer({ antialias: true });
    this.renderer.autoClear = false;
    this.canvas = this.renderer.domElement;
    element.prepend(this.canvas);
    lightAround(this.scene, this.renderer, 0.45);
    this.backdrop = new Backdrop();
    this.names = new Labels(element, "object", () => {});
    for (const part of ["map", "anchors", "restart"]) state.addEventListener(part, () => this.update(part));
    new ResizeObserver(() => this.invalidate()).observe(element);
    this.canvas.addEventListener("click", (event) => this.click(event));
  }

  update(part) {
    super.update(part);
    if (part === "map") this.names.set(this.store.mappedObjects().map((o) => ({ key: o.id, text: labelOf(o), color: classColor(o.category_id, 70) })));
  }

  // Takes the image on a canvas, which is shown when its pose is known.
  take(canvas) {
    this.backdrop.take(this.renderer, canvas);
  }

  // Shows the image that was taken last. @param {import("../device/device_tracker.js").Tracked} tracked
  show(tracked) {
    this.tracked = tracked;
    this.backdrop.change();
    this.draw();
  }

  draw() {
    const { element, renderer, session, tracked } = this;
    const [width, height] = [element.clientWidth, element.clientHeight];
    if (!session || !tracked || !this.source.isOpen || width === 0 || height === 0) return;
    const ratio = Math.min(devicePixelRatio, 2);
    const size = [width, height, ratio];
    if (size.join() !== this.size) {
      this.size = size.join();
      renderer.setDrawingBufferSize(width, height, ratio);
    }
    // While the lens is unknown the picture is shown with a guess, and no content.
    const camera = tracked.camera ?? guessedCamera(session.size.width, session.size.height);
    const pose = tracked.pose && poseArray(tracked.pose);
    this.shown = pose ? { pose, camera } : null;
    this.isShowing = Boolean(pose);
    element.dataset.showing = String(this.isShowing);
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
    this.names.place((id) => {
      const object = objects.get(id);
      return object && this.toPage(new Vector3(...object.center));
    }, null, taken);
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
