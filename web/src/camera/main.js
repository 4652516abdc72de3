import { Content } from "../content.js";
import { el } from "../dom.js";
import { AnchorPanel } from "./anchor_panel.js";
import { GravitySensor } from "./gravity.js";
import { refusal } from "./help.js";
import { KnownCameras } from "./intrinsics.js";
import { LiveView } from "./live_view.js";
import { MapState } from "./map_state.js";
import { Screens } from "./screens.js";
import { Service } from "./service.js";
import { Session } from "./session.js";
import { VideoSource } from "./video_source.js";
import { describe } from "./words.js";

const LEAST_KEYFRAMES = 5; // of a map that the server saves

const $ = (id) => document.getElementById(id);
const service = new Service(location);
const state = new MapState();
const content = new Content(state);
content.loader.setRequestHeader(service.headers);
const gravity = new GravitySensor();
const cameras = new KnownCameras(globalThis.localStorage);
const source = new VideoSource($("video"), { onFrame, onEnded: () => !document.hidden && openCamera() });
let view = null;
let session = null;

const screens = new Screens($("screen"), service, {
  onStart: start,
  knowsLens: () => source.isOpen && cameras.knows(source.lens),
  onForgetLens: () => cameras.forget(source.lens),
  onToken: (token) => {
    history.replaceState(null, "", `#token=${encodeURIComponent(token)}`);
    service.setToken(token);
    content.loader.setRequestHeader(service.headers);
    screens.choose();
  },
});

function addressOf(map) {
  return `${location.origin}${location.pathname}${map ? `?map=${encodeURIComponent(map)}` : ""}${location.hash}`;
}

// False where help is shown instead.
function isRefused(error) {
  const found = refusal({
    isSecure: isSecureContext,
    hasCamera: Boolean(navigator.mediaDevices?.getUserMedia),
    hasGraphics: Boolean(document.createElement("canvas").getContext("webgl2")),
    error,
    address: location.href,
  });
  if (found) screens.help(found);
  return Boolean(found);
}

async function openCamera() {
  try {
    await source.open();
    return true;
  } catch (error) {
    isRefused(error);
    return false;
  }
}

// While a tap is handled: browsers ask for the sensors only then.
async function start(map, kind) {
  const sensors = gravity.start();
  if (!source.isOpen && !(await openCamera())) return;
  await sensors;
  stayAwake();
  if (!view) openView();
  screens.hide();
  enter(map, kind);
}

function openView() {
  view = new LiveView($("view"), state, content, source);
  view.onPickAnchor = pickAnchor;
  view.onPlace = (where) => {
    before = new Set(state.anchors.map(({ name }) => name));
    session.link.send({ type: "place", model, ...where });
    setPlacing(false);
  };
}

function enter(map, kind) {
  session?.end();
  state.clear();
  state.tell("hello", "restart", "map", "anchors");
  pickAnchor(null);
  setPlacing(false);
  history.replaceState(null, "", addressOf(kind === "track" ? map : null));
  document.body.dataset.kind = kind;
  session = new Session({ service, state, source, gravity, cameras }, map, kind);
  view.session = session;
  window.oaslam = { session, state, source, view, service, cameras };
  for (const part of ["link", "answer", "progress"]) session.addEventListener(part, () => showState());
  session.addEventListener("progress", showProgress);
  session.addEventListener("saved", () => {
    enter(session.map, "track");
    say("saved: this is the new map");
  });
  session.addEventListener("said", ({ text }) => say(text));
  showState();
  showProgress();
}

function onFrame(time) {
  if (!session) return;
  session.offer(time);
  view.show(time);
}

// What is placed is selected when it comes.
let before = null; // the anchors that there were then
state.addEventListener("anchors", () => {
  const placed = before && state.anchors.find(({ name }) => !before.has(name));
  if (!placed) return;
  before = null;
  pickAnchor(placed.name);
});

const panel = new AnchorPanel($("anchor"), state, { send: (message) => session.link.send(message), onPick: pickAnchor });
function pickAnchor(name) {
  view?.anchors.select(name);
  panel.select(name);
  document.body.dataset.anchor = name ?? "";
}

// The bar.
let model = null; // to place
const press = (button, on) => button.setAttribute("aria-pressed", on);
function tool(text, action, act) {
  const button = el("button", { onclick: () => act(button) }, text);
  button.dataset.action = action;
  $("bar").append(button);
  return button;
}
const place = tool("Place", "place", () => setPlacing(!view.isPlacing));
const objects = tool("Objects", "objects", (button) => {
  const on = !view.occluders.outlines.visible;
  press(button, on);
  view.showObjects(on);
});
const finish = tool("Finish", "finish", () => {
  session.finish();
  showState();
});
const maps = tool("Maps", "maps", leave);
$("name").onclick = leave;

function leave() {
  session.end();
  session = null;
  view.session = null;
  screens.choose();
}

function setPlacing(on) {
  if (!view) return;
  view.isPlacing = on;
  press(place, on);
  $("models").hidden = !on;
  if (!on) return;
  pickAnchor(null);
  showModels();
}

function showModels() {
  const names = state.models.map(({ name }) => name);
  if (!names.includes(model)) model = names[0] ?? null;
  const choice = (text, isOn, act) => {
    const button = el("button", { onclick: () => (act(), showModels()) }, text);
    press(button, isOn);
    return button;
  };
  $("models").replaceChildren(
    el("p", {}, view.isOnObjects ? "Tap an object: it stands on top of it." : "Tap the place where it is to stand."),
    el("div", { className: "row" }, ...names.map((name) => choice(name, name === model, () => (model = name)))),
    el("div", { className: "row" },
      choice("on a surface", !view.isOnObjects, () => (view.isOnObjects = false)),
      choice("on objects", Boolean(view.isOnObjects), () => (view.isOnObjects = true))));
}

function showState() {
  if (!session) return;
  const { link, why, answer, delay, kind, isFinishing } = session;
  const seconds = link ? (link.retryAt - performance.now()) / 1000 : 0;
  const { state: color, text } = describe({ link: link?.state ?? "connecting", why, seconds, answer, kind, isFinishing });
  $("state").textContent = text;
  $("state").dataset.state = color;
  $("name").textContent = session.map;
  $("delay").hidden = delay === null;
  if (delay !== null) $("delay").textContent = `${Math.round(delay * 1000)} ms`;
  $("delay").title = answer ? `from an image to its pose; ${Math.round(answer.ms)} ms of it the server's work` : "";
  const isOpen = link?.state === "open";
  place.hidden = kind === "record" || !state.mayEdit || state.models.length === 0;
  place.disabled = !isOpen;
  objects.hidden = kind === "record";
  finish.hidden = kind !== "record";
  finish.disabled = !isOpen || isFinishing || !(session.progress?.keyframes >= LEAST_KEYFRAMES);
  maps.textContent = kind === "record" ? "Cancel" : "Maps";
}
state.addEventListener("hello", () => showState());
setInterval(() => session?.link.state === "waiting" && showState(), 500);

function showProgress() {
  const { progress, kind } = session;
  $("progress").hidden = kind !== "record";
  if (kind !== "record") return;
  const { text, keyframes = 0, landmarks = 0, objects: seen = 0 } = progress ?? { text: "Point at something with details, and move sideways slowly." };
  const count = (n, word) => el("span", {}, el("b", {}, n), ` ${word}`);
  $("progress").replaceChildren(el("p", {}, text), el("div", { className: "row counts" }, count(keyframes, "views"), count(landmarks, "points"), count(seen, "objects")));
}

let saidUntil;
function say(text) {
  $("toast").textContent = text;
  $("toast").hidden = false;
  clearTimeout(saidUntil);
  saidUntil = setTimeout(() => ($("toast").hidden = true), 5000);
}

// A page that nobody sees sends nothing; systems may take the camera from it.
document.addEventListener("visibilitychange", () => {
  if (document.hidden || !session) return;
  session.motion.reset();
  session.link.hurry();
  stayAwake();
  if (!source.isOpen) openCamera();
});
addEventListener("online", () => session?.link.hurry());

async function stayAwake() {
  await navigator.wakeLock?.request("screen").catch(() => null);
}

if (!isRefused(null)) {
  const map = new URLSearchParams(location.search).get("map");
  if (map) screens.start(map);
  else screens.choose();
}
