// Everything about one object: how it looks, where from it was seen, how well it is known.
import { classColor, labelOf, short } from "./palette.js";
import { el } from "./dom.js";

export class ObjectPanel {
  constructor(element, store, { onClose }) {
    this.element = element;
    this.store = store;
    this.onClose = onClose;
    this.id = null;
    store.addEventListener("detail", () => this.draw());
  }

  open(id) {
    this.id = id;
    this.element.hidden = id === null;
  }

  draw() {
    const { detail } = this.store;
    if (!detail || detail.object.id !== this.id) return;
    this.urls?.forEach((url) => URL.revokeObjectURL(url));
    this.urls = detail.crops.map((crop) => crop.url);
    const { object } = detail;
    const { unit } = this.store;
    const sigma = (i) => Math.sqrt(Math.max(0, detail.covariance[8 * i]));
    const known = detail.covariance.some((v) => v !== 0);
    const axes = object.half_axes.map((a) => short(2 * a, 2)).join(" \u00d7 ");
    const rows = [
      ["class", object.category],
      ["observations", `${object.observations}${object.mapped ? "" : " (candidate)"}`],
      ["last seen", `frame ${object.last_seen_frame}`],
      ["mean score", object.score > 0 ? object.score.toFixed(2) : "\u2013"],
      ["mean IoU", object.mean_iou > 0 ? object.mean_iou.toFixed(2) : "\u2013"],
      ["detection rate", detail.observations.length > 0 ? detail.detection_rate.toFixed(2) : "\u2013"],
      ["landmarks on it", detail.landmarks],
      ["centre", object.center.map((x) => short(x)).join(", ")],
      ["diameters", `${axes} ${unit}`],
      ["\u03c3 centre", known ? `${[0, 1, 2].map((i) => short(sigma(i), 2)).join(", ")} ${unit}` : "\u2013"],
      ["\u03c3 size", known ? `${[3, 4, 5].map((i) => `${(100 * sigma(i)).toFixed(0)} %`).join(", ")}` : "\u2013"],
      ["\u03c3 yaw", known && sigma(6) > 0 ? `${((sigma(6) * 180) / Math.PI).toFixed(1)}\u00b0` : "\u2013"],
    ];
    this.element.style.setProperty("--color", classColor(object.category_id, 70));
    this.element.replaceChildren(
      el("header", {}, el("h2", {}, `${labelOf(object)} ${object.id}`), el("button", { className: "close", title: "Close (Esc)", onclick: () => this.onClose() }, "\u00d7")),
      detail.crops.length > 0
        ? el("div", { className: "crops" }, ...detail.crops.map((crop) => el("figure", {}, el("img", { src: crop.url, alt: "" }), el("figcaption", {}, crop.frame))))
        : el("p", { className: "muted" }, this.store.status.live ? "no pictures yet" : "pictures: open the map with --images"),
      el("dl", {}, ...rows.flatMap(([name, value]) => [el("dt", {}, name), el("dd", {}, String(value))])),
      el("div", { className: "charts" }, figure("history: score by frame", this.history(detail)), figure("seen from (top view)", this.compass(detail))),
    );
  }

  history({ observations }) {
    const canvas = chart(150, 74);
    if (observations.length === 0) return canvas;
    const context = canvas.getContext("2d");
    const first = observations[0].frame;
    const span = Math.max(1, observations.at(-1).frame - first);
    for (const o of observations) {
      context.fillStyle = o.truncated ? "#6b7683" : getComputedStyle(this.element).getPropertyValue("--color");
      context.fillRect(4 + ((o.frame - first) / span) * 140, 64 - 58 * o.score, 2.5, 2.5);
    }
    context.fillStyle = "#8b96a3";
    context.font = "9px system-ui, sans-serif";
    context.fillText(first, 2, 73);
    context.textAlign = "right";
    context.fillText(observations.at(-1).frame, 148, 73);
    context.fillStyle = "#2a333d";
    context.fillRect(0, 64.5, 150, 1);
    return canvas;
  }

  // Directions to the cameras, looked at along the map's up.
  compass({ object, observations }) {
    const canvas = chart(150, 74);
    const context = canvas.getContext("2d");
    context.translate(75, 37);
    context.strokeStyle = "#2a333d";
    context.beginPath();
    context.arc(0, 0, 34, 0, 2 * Math.PI);
    context.moveTo(-34, 0);
    context.lineTo(34, 0);
    context.moveTo(0, -34);
    context.lineTo(0, 34);
    context.stroke();
    const color = getComputedStyle(this.element).getPropertyValue("--color");
    context.strokeStyle = color;
    context.globalAlpha = 0.35;
    for (const o of observations) {
      if (!o.camera) continue;
      const [x, , z] = this.upright(o.camera.map((c, i) => c - object.center[i]));
      const length = Math.hypot(x, z) || 1;
      context.beginPath();
      context.moveTo((8 * x) / length, (8 * z) / length);
      context.lineTo((33 * x) / length, (33 * z) / length);
      context.stroke();
    }
    context.globalAlpha = 1;
    context.fillStyle = color;
    context.beginPath();
    context.arc(0, 0, 4, 0, 2 * Math.PI);
    context.fill();
    return canvas;
  }
}

function chart(width, height) {
  const canvas = document.createElement("canvas");
  const dpr = Math.min(devicePixelRatio, 2);
  canvas.width = width * dpr;
  canvas.height = height * dpr;
  canvas.style.width = `${width}px`;
  canvas.style.height = `${height}px`;
  canvas.getContext("2d").scale(dpr, dpr);
  return canvas;
}

function figure(caption, content) {
  return el("figure", {}, content, el("figcaption", {}, caption));
}
