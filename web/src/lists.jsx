// The sidebar's lists: layers, objects, anchors, events.
import { useMemo, useState } from "preact/hooks";
import { AnchorList } from "./anchor_list.jsx";
import { classColor, COLORS, labelOf, MARKS, STATE_COLORS } from "./palette.js";

const OBJECT = "#d98cc4";
const GRID = "#26303a";
// `off`: not shown at first.
export const LAYERS = [
  { group: "Map", id: "landmarks", label: "Landmarks", color: "#8f9bab" },
  { id: "objects", label: "Objects", color: OBJECT },
  { id: "labels", label: "Object names", color: OBJECT },
  { id: "anchors", label: "Anchors", color: COLORS.anchor },
  { id: "candidates", label: "Candidate objects", color: "#6b5f78", off: true },
  { id: "keyframes", label: "Keyframes", color: COLORS.keyframe },
  { id: "covisibility", label: "Covisibility", color: COLORS.covisible, off: true },
  { id: "path", label: "Trajectory", color: COLORS.path },
  { id: "groundtruth", label: "Ground truth", color: COLORS.groundtruth },
  { id: "camera", label: "Camera", color: STATE_COLORS.tracking },
  { id: "grid", label: "Grid", color: GRID },
  { group: "Image", id: "keypoints", label: "Key points", color: "#7ee0a8" },
  { id: "boxes", label: "Detections", color: "#c9b8ff" },
  { id: "ellipses", label: "Projected objects", color: OBJECT },
  { group: "Augmented reality", id: "content", label: "Content", color: COLORS.anchor },
  { id: "names", label: "Names", color: COLORS.anchor },
  { id: "occlusion", label: "Occlusion", color: GRID },
  { id: "outlines", label: "Object outlines", color: OBJECT, off: true },
];
const EVENT_COLORS = { ...MARKS, object: "#8b96a3", anchor: COLORS.anchor, map: STATE_COLORS.tracking };
const MAX_EVENTS = 200; // that are listed, the newest first

/**
 * `layers` tells which are on. `anchor` is the name of the selected one.
 * @param {{ store: import("./store.js").Store, edits: import("./anchor_edits.js").AnchorEdits, layers: Record<string, boolean>, anchor: string | null,
 *   onLayer: (id: string, on: boolean) => void, onPick: (id: number) => void, onPickAnchor: (name: string) => void, onEvent: (frame?: number) => void }} props
 */
export function Lists({ store, edits, layers, anchor, onLayer, onPick, onPickAnchor, onEvent }) {
  const [open, setOpen] = useState("Layers");
  const { events } = store;
  const objects = store.mappedObjects();
  const counts = { Layers: 0, Objects: objects.length, Anchors: store.anchors.length, Events: events.length };
  return (
    <section id="lists">
      <nav id="tabs">
        {Object.entries(counts).map(([name, count]) => (
          <button key={name} data-tab={name} aria-selected={name === open} onClick={() => setOpen(name)}>{count > 0 ? `${name} ${count}` : name}</button>
        ))}
      </nav>
      <div id="tab-body">
        {open === "Layers" && <Layers layers={layers} onLayer={onLayer} />}
        {open === "Objects" && <div class="list"><Objects objects={objects} onPick={onPick} /></div>}
        {open === "Anchors" && <div class="list"><AnchorList store={store} edits={edits} selected={anchor} onPick={onPickAnchor} /></div>}
        {open === "Events" && <div class="list"><Events events={events} onEvent={onEvent} /></div>}
      </div>
    </section>
  );
}

function Layers({ layers, onLayer }) {
  return (
    <div class="layers">
      {LAYERS.map(({ id, label, color, group }) => [
        group && <h3 key={group}>{group}</h3>,
        <label key={id}>
          <input type="checkbox" checked={layers[id]} data-layer={id} onChange={({ currentTarget }) => onLayer(id, currentTarget.checked)} />
          <i style={{ background: color }} />
          {label}
        </label>,
      ])}
    </div>
  );
}

function Objects({ objects, onPick }) {
  if (objects.length === 0) return <p class="muted">no objects in the map</p>;
  return objects.sort((a, b) => a.id - b.id).map((o) => (
    <button key={o.id} class="row" data-object={o.id} style={{ "--color": classColor(o.category_id) }} onClick={() => onPick(o.id)}>
      <i />
      <span>{labelOf(o)} {o.id}</span>
      <span class="muted">{`seen ${o.observations}\u00d7`}</span>
    </button>
  ));
}

function Events({ events, onEvent }) {
  const row = (event, i) => (
    <button key={i} class="row event" style={{ "--color": EVENT_COLORS[event.kind] ?? "#8b96a3" }} onClick={() => onEvent(event.frame)}>
      <span class="muted frame">{event.frame}</span>
      <i />
      <span><b>{event.kind}</b> {event.text}</span>
    </button>
  );
  const first = Math.max(0, events.length - MAX_EVENTS);
  return useMemo(() => events.slice(first).map((event, i) => row(event, first + i)).reverse(), [events, events.length]);
}
