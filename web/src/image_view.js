import { objectAt, paintImage } from "./image_area.js";
import { onceAFrame } from "./batched.js";
import { classColor, labelOf } from "./palette.js";

const TAU = 2 * Math.PI;

/** The camera's image with what the tracker sees in it: key points, boxes, projected ellipsoids. */
export class ImageView {
  /** @type {((id: number | null) => void) | undefined} */ onPick;
  /** @type {number | null} */ selected = null;
  /** @type {import("./image_area.js").ImageArea} */ area;
  px = 1; // size of a pixel of the page, in pixels of the image

  /** @param {HTMLElement} element  @param {import("./store.js").Store} store */
  constructor(element, store) {
    this.element = element;
    this.store = store;
    this.layers = { keypoints: true, boxes: true, ellipses: true };
    this.invalidate = onceAFrame(() => this.draw());
    this.canvas = document.createElement("canvas");
    this.caption = document.createElement("div");
    this.caption.className = "caption";
    element.append(this.canvas, this.caption);
    for (const part of ["frame", "restart", "status"]) store.addEventListener(part, () => this.invalidate());
    new ResizeObserver(() => this.invalidate()).observe(element);
    this.canvas.addEventListener("click", (event) => this.click(event));
  }

  get frame() {
    return this.store.chosen ?? this.store.frame;
  }

  draw() {
    if (this.element.clientWidth === 0 || this.element.clientHeight === 0) return;
    const { frame } = this;
    this.element.classList.toggle("empty", !frame);
    this.caption.textContent = frame ? captionOf(frame) : this.store.status.live ? "waiting for the first image" : "choose a moment on the timeline";
    const { context, area } = paintImage(this.canvas, this.element, frame);
    if (!frame || !area) return;
    this.area = area;
    this.px = 1 / area.scale;
    if (this.layers.keypoints) this.drawKeypoints(context, frame);
    if (this.layers.ellipses) this.drawEllipses(context, frame);
    if (this.layers.boxes) this.drawBoxes(context, frame);
    this.drawLabels(context, frame);
  }

  drawKeypoints(context, frame) {
    const size = 2.2 * this.px;
    for (const matched of [false, true]) {
      context.fillStyle = matched ? "#7ee0a8" : "rgba(215, 221, 228, .38)";
      const side = matched ? size * 1.25 : size;
      for (let i = 0; i < frame.px.length / 2; ++i)
        if (frame.isMatched(i) === matched) context.fillRect(frame.px[2 * i] + 0.5 - side / 2, frame.px[2 * i + 1] + 0.5 - side / 2, side, side);
    }
  }

  drawEllipses(context, frame) {
    for (const e of frame.ellipses) {
      context.beginPath();
      context.ellipse(e.center[0] + 0.5, e.center[1] + 0.5, e.half_axes[0], e.half_axes[1], e.angle, 0, TAU);
      context.strokeStyle = classColor(e.category_id);
      context.lineWidth = (e.object === this.selected ? 3.5 : 1.8) * this.px;
      context.stroke();
    }
  }

  drawBoxes(context, frame) {
    for (const d of frame.detections) {
      context.strokeStyle = classColor(d.category_id, 78);
      context.lineWidth = this.px;
      context.setLineDash(d.object === undefined ? [3 * this.px, 3 * this.px] : []);
      context.strokeRect(d.box[0], d.box[1], d.box[2] - d.box[0], d.box[3] - d.box[1]);
    }
    context.setLineDash([]);
  }

  // A label for each object: at its box where it is detected, else at its ellipse. One that would cover another is left out.
  drawLabels(context, frame) {
    const isLarge = this.element.clientWidth > 500;
    const height = (isLarge ? 15 : 12) * this.px;
    context.font = `${(isLarge ? 12 : 10) * this.px}px system-ui, sans-serif`;
    context.textBaseline = "middle";
    const placed = [];
    const put = (x, y, text, category) => {
      const width = context.measureText(text).width + 6 * this.px;
      const left = Math.max(0, Math.min(x, frame.camera.width - width));
      const top = Math.max(0, Math.min(y - height, frame.camera.height - height));
      if (placed.some((p) => left < p.left + p.width && p.left < left + width && top < p.top + height && p.top < top + height)) return;
      placed.push({ left, top, width });
      context.fillStyle = "rgba(10, 13, 17, .72)";
      context.fillRect(left, top, width, height);
      context.fillStyle = classColor(category, 76);
      context.fillText(text, left + 3 * this.px, top + height / 2);
    };
    const named = new Set();
    if (this.layers.boxes)
      for (const d of frame.detections) {
        const object = d.object === undefined ? undefined : this.store.objects.get(d.object);
        const name = object ? `${labelOf(object)} ${object.id}` : d.category;
        put(d.box[0], d.box[1], isLarge ? `${name}  ${d.score.toFixed(2)}` : name, d.category_id);
        named.add(d.object);
      }
    if (this.layers.ellipses)
      for (const e of frame.ellipses)
        if (!named.has(e.object)) put(e.center[0] - 20 * this.px, e.center[1] + height / 2, `${e.label} ${e.object}`, e.category_id);
  }

  click(event) {
    const { frame } = this;
    if (frame) this.onPick?.(objectAt(frame, this.area.toPixel(event.offsetX, event.offsetY)));
  }
}

function captionOf(frame) {
  const parts = [frame.keyframe === undefined ? `frame ${frame.frame}` : `keyframe ${frame.keyframe}, frame ${frame.frame}`];
  parts.push(`${frame.inliers} of ${frame.px.length / 2} points`);
  if (frame.ms.total > 0 && frame.keyframe === undefined)
    parts.push(`${frame.ms.total.toFixed(1)} ms: features ${frame.ms.features.toFixed(1)}, tracking ${frame.ms.track.toFixed(1)}, objects ${frame.ms.objects.toFixed(1)}`);
  if (frame.detections.length > 0) parts.push(`${frame.detections.length} boxes`);
  return parts.join(" \u00b7 ");
}
