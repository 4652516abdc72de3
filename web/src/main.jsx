import { render } from "preact";
import { Vector3 } from "three";
import { AnchorEdits } from "./anchor_edits.js";
import { ArView } from "./ar_view.js";
import { Controls, PlaceBar, pressShortcut, Tools } from "./bars.jsx";
import { batched } from "./batched.js";
import { Content } from "./content.js";
import { decode } from "./decode.js";
import { Header, nameOf } from "./header.jsx";
import { ImageView } from "./image_view.js";
import { Link } from "./link.js";
import { LAYERS, Lists } from "./lists.jsx";
import { MapView } from "./map_view.js";
import { ObjectPanel } from "./object_panel.jsx";
import { Service } from "./service.js";
import { Store } from "./store.js";
import { Timeline } from "./timeline.js";
import { News, Toast } from "./toast.jsx";

const $ = (id) => /** @type {HTMLElement} */ (document.getElementById(id));
const store = new Store();
const service = new Service(location);
const content = new Content(store, service.base);
content.loader.setRequestHeader(service.headers);
const mapView = new MapView($("map"), store, content);
const imageView = new ImageView($("image"), store);
const arView = new ArView($("ar"), store, content, mapView.world.quaternion);
const picture = new ImageView($("picture"), store);
const views = { Map: mapView, Image: imageView, AR: arView };

// What the panels show beside the store; after a change they are drawn anew.
const ui = {
  view: "Map",
  object: /** @type {number | null} */ (null),
  detail: /** @type {import("./store.js").Detail | null} */ (null), // of that object, when it has come
  anchor: /** @type {string | null} */ (null),
  layers: Object.fromEntries(LAYERS.map(({ id, off }) => [id, !off])),
};
const draw = batched(drawPanels, queueMicrotask);
const news = new News(draw);
function set(changes) {
  Object.assign(ui, changes);
  draw();
}

const connection = new Link({
  ...service.socket("/ws"),
  decode,
  onMessage: async (message) => {
    try {
      await store.take(message);
    } finally {
      connection.send({ type: "ack" }); // for the next message
    }
  },
  onState: () => draw(),
});
addEventListener("online", () => connection.hurry());
const edits = new AnchorEdits(store, (message) => connection.send(message));

function drawPanels() {
  const { status, models, mayEdit } = store;
  const { view, detail, anchor } = ui;
  document.title = status.title ? `${nameOf(status.title)} \u2013 OA-SLAM` : "OA-SLAM";
  Object.assign(document.body.dataset, { view, live: status.live, object: ui.object ?? "", anchor: anchor ?? "" });
  render(<Header store={store} link={connection.state} views={Object.keys(views)} view={view} onView={openView} />, /** @type {Element} */ (document.querySelector("header")));
  const mayPlace = mayEdit && models.length > 0 && view === "AR";
  if (!mayPlace) arView.setPlacing(false);
  const hint = view === "Map" && mapView.measure.isOn ? "click two landmarks or objects"
    : arView.isPlacing ? "click on an object, or on a surface; shift-click: never an object" : "";
  render(<>
    {view === "Map" && <Tools map={mapView} onChange={draw} />}
    {mayPlace && <PlaceBar edits={edits} models={models} isPlacing={arView.isPlacing} onPlace={() => setPlacing(!arView.isPlacing)} />}
    {store.mayCommand && status.live && <Controls status={status} hasMap={store.map.keyframes > 0} onCommand={command} />}
    <div id="hint">{hint}</div>
    <Toast news={news} />
  </>, $("over"));
  render(<>
    {detail && <ObjectPanel detail={detail} unit={store.unit} isLive={status.live} upright={upright} onClose={() => pick(null)} />}
    <Lists store={store} edits={edits} layers={ui.layers} anchor={anchor} onLayer={setLayer} onPick={pick} onPickAnchor={pickAnchor} onEvent={goTo} />
  </>, $("side"));
}
for (const part of ["map", "frame", "notes", "restart", "status", "events", "anchors"]) store.addEventListener(part, draw);

function openView(name) {
  for (const [other, { element }] of Object.entries(views)) element.hidden = other !== name;
  views[name].invalidate();
  set({ view: name });
}

function setLayer(id, on) {
  ui.layers[id] = on;
  const { layers } = ui;
  for (const name of ["landmarks", "objects", "anchors", "keyframes", "path", "camera"]) mapView.layers[name].setVisible(layers[name]);
  mapView.layers.labels.setVisible(layers.objects && layers.labels);
  mapView.layers.objects.candidates.visible = layers.candidates;
  mapView.layers.keyframes.edges.visible = layers.covisibility;
  mapView.layers.path.setTruthVisible(layers.groundtruth);
  mapView.setGridVisible(layers.grid);
  arView.anchors.setVisible(layers.content);
  arView.anchors.named = layers.names;
  arView.occluders.setOccluding(layers.occlusion);
  arView.occluders.outlines.visible = layers.outlines;
  for (const view of [imageView, picture]) Object.assign(view.layers, { keypoints: layers.keypoints, boxes: layers.boxes, ellipses: layers.ellipses });
  for (const view of [mapView, imageView, arView, picture]) view.invalidate();
  draw();
}

function command(name, on) {
  connection.send({ type: "command", name, on });
}

const upright = (v) => new Vector3(...v).applyQuaternion(mapView.world.quaternion).toArray();

function pick(id) {
  mapView.layers.objects.select(id);
  for (const view of [imageView, picture]) {
    view.selected = id;
    view.invalidate();
  }
  set(id === null ? { object: null, detail: null } : { object: id });
  if (id !== null) connection.send({ type: "object", id });
}
mapView.onPick = imageView.onPick = arView.onPick = picture.onPick = pick;
store.addEventListener("detail", () => {
  if (store.detail?.object.id === ui.object) set({ detail: store.detail });
});
// The panel of an object stays up to date.
let asked = 0;
store.addEventListener("map", () => {
  if (ui.object === null || performance.now() - asked < 1000) return;
  asked = performance.now();
  if (store.objects.has(ui.object)) connection.send({ type: "object", id: ui.object });
  else pick(null);
});

function pickAnchor(name) {
  mapView.layers.anchors.select(name);
  arView.anchors.select(name);
  set({ anchor: name });
}
mapView.onPickAnchor = arView.onPickAnchor = pickAnchor;

store.addEventListener("anchors", () => {
  const now = edits.follow(ui.anchor);
  if (now !== ui.anchor) pickAnchor(now);
});

function setPlacing(on) {
  arView.setPlacing(on);
  draw();
}
arView.onPlace = (where) => {
  edits.place(where);
  setPlacing(false);
};

// A moment of a saved run: the camera there, and the picture of the nearest keyframe.
/** @type {number | null} */
let wanted = null; // the keyframe that was asked for last
function goTo(frame) {
  if (store.status.live || frame === undefined) return;
  const place = store.path.frames.subarray(0, store.path.size).indexOf(frame);
  const away = (keyframe) => Math.abs(keyframe.frame - frame);
  const nearest = [...store.keyframes.values()].sort((a, b) => away(a) - away(b))[0];
  const isNear = nearest && away(nearest) <= 5;
  mapView.layers.camera.goTo(isNear || place < 0 ? null : place);
  if (nearest && nearest.id !== wanted) {
    wanted = nearest.id;
    connection.send({ type: "keyframe", id: nearest.id });
  }
  if (mapView.follow) mapView.followCamera();
  mapView.invalidate();
}
// A saved run opens in its middle. Its pictures may come later than the map.
store.addEventListener("map", () => {
  if (store.status.live || store.keyframes.size === 0) return;
  const { chosen } = store;
  if (!chosen && !store.frame) goTo(store.notes[store.notes.length >> 1]?.frame ?? 0);
  else if (chosen && !chosen.bitmap) askingPicture ??= setTimeout(askPicture, 500);
});
let askingPicture;
function askPicture() {
  askingPicture = undefined;
  if (wanted !== null && store.chosen && !store.chosen.bitmap) connection.send({ type: "keyframe", id: wanted });
}
const timeline = new Timeline($("timeline"), store, { onChoose: goTo });

// Events of the camera and of content are also shown over the view; not those of before the page was opened.
let said;
store.addEventListener("events", () => {
  const event = store.events.findLast(({ kind }) => ["lost", "relocalized", "objects", "loop", "reset", "anchor"].includes(kind));
  if (!event || event === said || !(store.status.live || event.kind === "anchor")) return;
  said = event;
  if (store.updates === 1) return;
  if (event.kind === "anchor") edits.others = null; // what was to be placed was refused
  news.say(event.kind === "anchor" ? event.text : `frame ${event.frame}: ${event.kind} ${event.text}`, event.kind);
});
store.addEventListener("restart", () => {
  pick(null);
  wanted = edits.others = null;
  timeline.now = undefined;
});

function escape() {
  if (arView.isPlacing) return setPlacing(false);
  pick(null);
  pickAnchor(null);
}
// A click with the mouse leaves the focus to the page. A button that has it was reached by keyboard: space is for that button.
addEventListener("click", ({ detail }) => detail > 0 && document.activeElement instanceof HTMLButtonElement && document.activeElement.blur());
addEventListener("keydown", (event) => {
  const { tagName } = /** @type {HTMLElement} */ (event.target);
  if (event.ctrlKey || event.metaKey || event.altKey || tagName === "INPUT") return;
  if (event.key === "Escape") return escape();
  if (tagName === "SELECT" || (tagName === "BUTTON" && event.key === " ")) return;
  if (pressShortcut(event.key)) event.preventDefault();
});

openView("Map");
Object.assign(window, { oaslam: { store, connection, mapView, imageView, arView, picture, pick, pickAnchor } });
