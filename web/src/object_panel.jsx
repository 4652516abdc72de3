import { useLayoutEffect, useRef } from "preact/hooks";
import { contextOf } from "./image_area.js";
import { classColor, labelOf, short } from "./palette.js";

const SIZE = { width: 150, height: 74 }; // of a chart
const NONE = "\u2013";

/**
 * Everything about one object: how it looks, from where it was seen, how accurately it is known. `upright` turns a direction of the map so that up is +y.
 * @param {{ detail: import("./store.js").Detail, unit: string, isLive: boolean, upright: (v: number[]) => number[], onClose: () => void }} props
 */
export function ObjectPanel({ detail, unit, isLive, upright, onClose }) {
  const { object, crops, covariance } = detail;
  const color = classColor(object.category_id, 70);
  const sigma = (i) => Math.sqrt(Math.max(0, covariance[8 * i]));
  const isKnown = covariance.some((v) => v !== 0);
  const share = (value, isGiven) => (isGiven ? value.toFixed(2) : NONE);
  const rows = {
    "class": object.category,
    "observations": `${object.observations}${object.mapped ? "" : " (candidate)"}`,
    "last seen": `frame ${object.last_seen_frame}`,
    "mean score": share(object.score, object.score > 0),
    "mean IoU": share(object.mean_iou, object.mean_iou > 0),
    "detection rate": share(detail.detection_rate, detail.observations.length > 0),
    "landmarks on it": detail.landmarks,
    "centre": object.center.map((x) => short(x)).join(", "),
    "diameters": `${object.half_axes.map((a) => short(2 * a, 2)).join(" \u00d7 ")} ${unit}`,
    "\u03c3 centre": isKnown ? `${[0, 1, 2].map((i) => short(sigma(i), 2)).join(", ")} ${unit}` : NONE,
    "\u03c3 size": isKnown ? [3, 4, 5].map((i) => `${(100 * sigma(i)).toFixed(0)} %`).join(", ") : NONE,
    "\u03c3 yaw": isKnown && sigma(6) > 0 ? `${((sigma(6) * 180) / Math.PI).toFixed(1)}\u00b0` : NONE,
  };
  return (
    <section id="panel" style={{ "--color": color }}>
      <header>
        <h2>{labelOf(object)} {object.id}</h2>
        <button class="close" title="Close (Esc)" onClick={onClose}>{"\u00d7"}</button>
      </header>
      {crops.length > 0
        ? <div class="crops">{crops.map(({ frame, url }) => <figure key={frame}><img src={url} alt="" /><figcaption>{frame}</figcaption></figure>)}</div>
        : <p class="muted">{isLive ? "no pictures yet" : "pictures: open the map with --images"}</p>}
      <dl>{Object.entries(rows).map(([name, value]) => [<dt key={name}>{name}</dt>, <dd key={`${name} value`}>{value}</dd>])}</dl>
      <div class="charts">
        <Chart detail={detail} caption="history: score by frame" draw={(context) => drawHistory(context, detail, color)} />
        <Chart detail={detail} caption="seen from (top view)" draw={(context) => drawCompass(context, detail, color, upright)} />
      </div>
    </section>
  );
}

function Chart({ detail, caption, draw }) {
  const canvas = useRef(/** @type {HTMLCanvasElement | null} */ (null));
  useLayoutEffect(() => {
    const dpr = Math.min(devicePixelRatio, 2);
    const element = Object.assign(/** @type {HTMLCanvasElement} */ (canvas.current), { width: SIZE.width * dpr, height: SIZE.height * dpr });
    const context = contextOf(element);
    context.scale(dpr, dpr);
    draw(context);
  }, [detail]);
  return <figure><canvas ref={canvas} style={SIZE} /><figcaption>{caption}</figcaption></figure>;
}

function drawHistory(context, { observations }, color) {
  if (observations.length === 0) return;
  const [first, last] = [observations[0].frame, observations.at(-1).frame];
  for (const { frame, score, truncated } of observations) {
    context.fillStyle = truncated ? "#6b7683" : color;
    context.fillRect(4 + ((frame - first) / Math.max(1, last - first)) * 140, 64 - 58 * score, 2.5, 2.5);
  }
  context.fillStyle = "#8b96a3";
  context.font = "9px system-ui, sans-serif";
  context.fillText(first, 2, 73);
  context.textAlign = "right";
  context.fillText(last, 148, 73);
  context.fillStyle = "#2a333d";
  context.fillRect(0, 64.5, 150, 1);
}

// Directions to the cameras that saw the object, seen along the map's vertical.
function drawCompass(context, { object, observations }, color, upright) {
  context.translate(75, 37);
  context.strokeStyle = "#2a333d";
  context.beginPath();
  context.arc(0, 0, 34, 0, 2 * Math.PI);
  context.moveTo(-34, 0);
  context.lineTo(34, 0);
  context.moveTo(0, -34);
  context.lineTo(0, 34);
  context.stroke();
  context.strokeStyle = color;
  context.globalAlpha = 0.35;
  for (const { camera } of observations) {
    if (!camera) continue;
    const [x, , z] = upright(camera.map((c, i) => c - object.center[i]));
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
}
