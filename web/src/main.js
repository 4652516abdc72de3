import { Vector3 } from "three";
import { ArView } from "./ar_view.js";
import { Connection, tokenOf } from "./connection.js";
import { Content } from "./content.js";
import { el } from "./dom.js";
import { ImageView } from "./image_view.js";
import { Lists } from "./lists.js";
import { MapView } from "./map_view.js";
import { ObjectPanel } from "./object_panel.js";
import { COLORS, STATE_COLORS } from "./palette.js";
import { Store } from "./store.js";
import { Timeline } from "./timeline.js";

const $ = (id) => document.getElementById(id);
const store = new Store();

// A view fills the stage; others of its kind join here.
const mapElement = el("div", { className: "view" });
const imageElement = el("div", { className: "view image" });
const arElement = el("div", { className: "view image" });
$("stage").prepend(mapElement, imageElement, arElement);
const content = new Content(store);
const token = tokenOf(location.hash);
if (token) content.loader.setRequestHeader({ Authorization: `Bearer ${token}` });
const mapView = new MapView(mapElement, store, content);
const imageView = new ImageView(imageElement, store);
const arView = new ArView(arElement, store, content, mapView.world.quaternion);
const picture = new ImageView($("picture"), store);
const views = {
  Map: { element: mapElement, view: mapView },
  Image: { element: imageElement, view: imageView },
  AR: { element: arElement, view: arView },
};
for (const name of Object.keys(views)) {
  const button = el("button", { role: "tab", onclick: () => openView(name) }, name);
  button.dataset.view = name;
  $("views").append(button);
}

function openView(name) {
  for (const [other, { element, view }] of Object.entries(views)) {
    element.hidden = other !== name;
    if (other === name) view.invalidate();
  }
  for (const button of $("views").children) button.setAttribute("aria-selected", button.dataset.view === name);
  document.body.dataset.view = name;
  showPlace();
  showHint();
}

const connection = new Connection({
  onMessage: (message) => store.take(message),
  onState: (state) => {
    $("link").dataset.state = state;
    showStats();
  },
});

const panel = new ObjectPanel($("panel"), store, { onClose: () => pick(null) });
panel.upright = (v) => new Vector3(...v).applyQuaternion(mapView.world.quaternion).toArray();

function pick(id) {
  mapView.layers.objects.select(id);
  imageView.selected = picture.selected = id;
  imageView.invalidate();
  picture.invalidate();
  panel.open(id);
  document.body.dataset.object = id ?? "";
  if (id !== null) connection.send({ type: "object", id });
}
mapView.onPick = imageView.onPick = arView.onPick = picture.onPick = pick;

function pickAnchor(name) {
  mapView.layers.anchors.select(name);
  arView.anchors.select(name);
  lists.anchors.select(name);
  document.body.dataset.anchor = name ?? "";
}
mapView.onPickAnchor = arView.onPickAnchor = pickAnchor;
let others = null; // the anchors that there were when content was placed
store.addEventListener("anchors", () => {
  const { selected } = lists.anchors;
  const placed = others && store.anchors.find(({ name }) => !others.has(name));
  if (placed) others = null;
  const now = placed?.name ?? lists.anchors.follow(selected);
  if (now !== selected) pickAnchor(now);
});
// What is open stays up to date.
let asked = 0;
store.addEventListener("map", () => {
  if (panel.id === null || performance.now() - asked < 1000) return;
  asked = performance.now();
  if (store.objects.has(panel.id)) connection.send({ type: "object", id: panel.id });
  else pick(null);
});

// A moment of a saved run: the camera there, and the picture of the nearest keyframe.
let wanted = null; // the keyframe that was asked for last
function goTo(frame) {
  if (store.status.live || frame === undefined) return;
  const { path } = store;
  let place = null;
  for (let i = 0; i < path.size; ++i)
    if (place === null || Math.abs(path.frames[i] - frame) < Math.abs(path.frames[place] - frame)) place = i;
  if (place !== null && Math.abs(path.frames[place] - frame) > 0) place = null;
  let nearest = null;
  for (const keyframe of store.keyframes.values()) if (!nearest || Math.abs(keyframe.frame - frame) < Math.abs(nearest.frame - frame)) nearest = keyframe;
  const isNear = nearest && Math.abs(nearest.frame - frame) <= 5;
  mapView.layers.camera.goTo(isNear ? null : place);
  if (nearest && nearest.id !== wanted) {
    wanted = nearest.id;
    connection.send({ type: "keyframe", id: wanted });
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
  if (store.chosen && !store.chosen.bitmap) connection.send({ type: "keyframe", id: wanted });
}
const timeline = new Timeline($("timeline"), store, { onChoose: goTo });

// Layers: in space, in the image, over it.
const LAYERS = [
  { group: "Map", id: "landmarks", label: "Landmarks", color: "#8f9bab", on: true, set: (on) => mapView.show("landmarks", on) },
  { id: "objects", label: "Objects", color: "#d98cc4", on: true, set: (on) => { mapView.show("objects", on); mapView.layers.labels.setVisible(on && isOn("labels")); } },
  { id: "labels", label: "Object names", color: "#d98cc4", on: true, set: (on) => mapView.show("labels", on && isOn("objects")) },
  { id: "anchors", label: "Anchors", color: COLORS.anchor, on: true, set: (on) => mapView.show("anchors", on) },
  { id: "candidates", label: "Candidate objects", color: "#6b5f78", on: false, set: (on) => { mapView.layers.objects.candidates.visible = on; mapView.invalidate(); } },
  { id: "keyframes", label: "Keyframes", color: COLORS.keyframe, on: true, set: (on) => mapView.show("keyframes", on) },
  { id: "covisibility", label: "Covisibility", color: COLORS.covisible, on: false, set: (on) => { mapView.layers.keyframes.edges.visible = on; mapView.invalidate(); } },
  { id: "path", label: "Trajectory", color: COLORS.path, on: true, set: (on) => mapView.show("path", on) },
  { id: "groundtruth", label: "Ground truth", color: COLORS.groundtruth, on: true, set: (on) => mapView.layers.path.setTruthVisible(on) },
  { id: "camera", label: "Camera", color: STATE_COLORS.tracking, on: true, set: (on) => mapView.show("camera", on) },
  { id: "grid", label: "Grid", color: "#26303a", on: true, set: (on) => { if (mapView.grid) mapView.grid.visible = on; mapView.invalidate(); } },
  { group: "Image", id: "keypoints", label: "Key points", color: "#7ee0a8", on: true, set: (on) => showInImages("keypoints", on) },
  { id: "boxes", label: "Detections", color: "#c9b8ff", on: true, set: (on) => showInImages("boxes", on) },
  { id: "ellipses", label: "Projected objects", color: "#d98cc4", on: true, set: (on) => showInImages("ellipses", on) },
  { group: "Augmented reality", id: "content", label: "Content", color: COLORS.anchor, on: true, set: (on) => inAr(() => arView.anchors.setVisible(on)) },
  { id: "names", label: "Names", color: COLORS.anchor, on: true, set: (on) => inAr(() => (arView.anchors.named = on)) },
  { id: "occlusion", label: "Occlusion", color: "#26303a", on: true, set: (on) => inAr(() => arView.occluders.setOccluding(on)) },
  { id: "outlines", label: "Object outlines", color: "#d98cc4", on: false, set: (on) => inAr(() => (arView.occluders.outlines.visible = on)) },
];
function isOn(id) {
  return document.querySelector(`[data-layer=${id}]`).checked;
}
function showInImages(layer, on) {
  imageView.show(layer, on);
  picture.show(layer, on);
}
function inAr(change) {
  change();
  arView.invalidate();
}
const lists = new Lists($("tabs"), $("tab-body"), store, {
  layers: LAYERS,
  onLayer: (id, on) => LAYERS.find((layer) => layer.id === id).set(on),
  onPick: pick,
  onPickAnchor: pickAnchor,
  onEvent: goTo,
  send: (message) => connection.send(message),
});

// Tools of the map view, and commands to a live run.
function tool(parent, label, title, act, key) {
  const button = el("button", { title: key ? `${title} (${key === " " ? "space" : key})` : title, onclick: () => act(button) }, label);
  parent.append(button);
  if (key) keys.set(key, button);
  return button;
}
const keys = new Map();
const toggle = (button, set) => {
  const on = button.getAttribute("aria-pressed") !== "true";
  button.setAttribute("aria-pressed", on);
  set(on);
};
const follow = tool($("tools"), "Follow", "Follow the camera", (button) => toggle(button, (on) => mapView.setFollow(on)), "c");
const endFollow = () => { if (mapView.follow) toggle(follow, (on) => mapView.setFollow(on)); };
tool($("tools"), "Fit", "Show the whole map", () => { endFollow(); mapView.isMoved = false; mapView.fit(); }, "f");
tool($("tools"), "Top", "From above", () => { endFollow(); mapView.top(); }, "t");
tool($("tools"), "Measure", "Distance between two points", (button) => toggle(button, (on) => {
  mapView.measure.set(on);
  showHint();
}), "m");

// Content is placed by a click into the AR view.
const place = tool($("place"), "Place", "Put content into the scene", (button) => toggle(button, (on) => {
  arView.setPlacing(on);
  showHint();
}), "p");
const model = el("select", { title: "What to place", onchange: () => model.blur() }); // keys are for the page again
$("place").append(model);
arView.onPlace = (where) => {
  others = new Set(store.anchors.map(({ name }) => name));
  connection.send({ type: "place", model: model.value, ...where });
  place.click();
};
function showPlace() {
  const { models, mayEdit } = store;
  $("place").hidden = !(mayEdit && models.length > 0 && document.body.dataset.view === "AR");
  if ($("place").hidden && arView.isPlacing) place.click();
  const names = models.map((m) => m.name);
  if (names.join("\n") !== [...model.options].map((o) => o.value).join("\n")) model.replaceChildren(...names.map((name) => el("option", { value: name }, name)));
}
function showHint() {
  const hints = {
    Map: mapView.measure.isOn && "click two landmarks or objects",
    AR: arView.isPlacing && "click on an object, or on a surface; shift-click: never an object",
  };
  $("hint").textContent = hints[document.body.dataset.view] || "";
}

const command = (name, on) => connection.send({ type: "command", name, ...(on === undefined ? {} : { on }) });
const pause = tool($("controls"), "Pause", "Hold the run", () => command("pause", !store.status.paused), " ");
const step = tool($("controls"), "Step", "One image", () => command("step"), "s");
const relocalize = tool($("controls"), "Relocalize", "Give up the pose and look for the camera in the map", () => command("relocalize"));
const mapping = tool($("controls"), "Localization only", "Follow the camera and leave the map as it is", () => command("mapping", !store.status.mapping));
const reset = tool($("controls"), "Reset", "Forget the map", () => command("reset"));
function escape() {
  if (arView.isPlacing) return place.click();
  pick(null);
  pickAnchor(null);
}
// Space is for a button that was reached by keyboard; one that was clicked leaves it to the page.
let reached = null;
addEventListener("focusin", ({ target }) => (reached = target.matches("button:focus-visible") ? target : null));
addEventListener("keydown", (event) => {
  const { tagName } = event.target;
  if (event.ctrlKey || event.metaKey || event.altKey || tagName === "INPUT") return;
  if (event.key === "Escape") return escape();
  if (tagName === "SELECT" || (event.target === reached && event.key === " ")) return;
  const button = keys.get(event.key);
  if (!button || button.closest("[hidden]") || button.disabled) return;
  event.preventDefault();
  button.click();
});

function showStatus() {
  const { status } = store;
  $("title").textContent = status.title.split("/").filter(Boolean).at(-1) ?? "";
  document.title = status.title ? `${status.title.split("/").at(-1)} \u2013 OA-SLAM` : "OA-SLAM";
  $("controls").hidden = !(store.mayCommand && status.live);
  pause.textContent = status.paused ? "Resume" : "Pause";
  pause.setAttribute("aria-pressed", status.paused);
  step.disabled = !status.paused;
  mapping.setAttribute("aria-pressed", !status.mapping);
  mapping.disabled = relocalize.disabled = store.map.keyframes === 0;
  document.body.dataset.live = status.live;
  showPlace();
  showStats();
}

function showStats() {
  const { frame, chosen, status, map } = store;
  const shown = chosen ?? frame;
  const isConnected = $("link").dataset.state === "open";
  const state = status.live ? (shown?.state ?? "waiting") : isConnected || map.keyframes > 0 ? "saved" : "no connection";
  $("state").textContent = status.paused ? `${state} \u00b7 paused` : state;
  $("state").dataset.state = state;
  const stats = [
    ["landmarks", store.landmarks.count],
    ["objects", store.mappedObjects().length],
    ["keyframes", store.keyframes.size],
  ];
  if (map.loops > 0) stats.push(["loops", map.loops]);
  if (status.live && frame) {
    stats.push(["frame", frame.frame], ["points", frame.inliers], ["ms", frame.ms.total.toFixed(1)], ["confidence", frame.confidence.toFixed(2)]);
    if (status.dropped > 0) stats.push(["dropped", status.dropped]);
  } else if (!status.live && store.notes.length > 0) {
    stats.push(["frames", store.notes.length]);
    const times = store.notes.map((n) => n.ms).filter((ms) => ms > 0).sort((a, b) => a - b);
    if (times.length > 0) stats.push(["median ms", times[times.length >> 1].toFixed(1)]);
  }
  $("stats").replaceChildren(...stats.flatMap(([name, value]) => {
    const dd = el("dd", {}, value.toLocaleString?.("en") ?? value);
    dd.dataset.stat = name;
    dd.dataset.value = value;
    return [el("dt", {}, name), dd];
  }));
}
// What happens to the camera is said where one looks.
let said;
let saidUntil;
store.addEventListener("events", () => {
  const event = store.events.findLast((e) => ["lost", "relocalized", "objects", "loop", "reset", "anchor"].includes(e.kind));
  if (!event || event === said || !(store.status.live || event.kind === "anchor")) return;
  said = event;
  if (store.updates === 1) return; // of before the page came
  if (event.kind === "anchor") others = null; // there will be none
  $("toast").textContent = event.kind === "anchor" ? event.text : `frame ${event.frame}: ${event.kind} ${event.text}`;
  $("toast").dataset.state = event.kind;
  $("toast").hidden = false;
  clearTimeout(saidUntil);
  saidUntil = setTimeout(() => ($("toast").hidden = true), 5000);
});
for (const part of ["map", "frame", "notes", "restart"]) store.addEventListener(part, showStats);
store.addEventListener("status", showStatus);
store.addEventListener("map", () => (mapping.disabled = relocalize.disabled = store.map.keyframes === 0));
store.addEventListener("restart", () => { pick(null); wanted = others = null; timeline.now = undefined; });

openView("Map");
showStatus();
window.oaslam = { store, connection, mapView, imageView, arView, picture, lists, pick, pickAnchor };
