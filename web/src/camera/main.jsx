import { render } from "preact";
import { AnchorEdits } from "../anchor_edits.js";
import { batched } from "../batched.js";
import { ServiceError } from "../client/service_error.js";
import { Content } from "../content.js";
import { Service } from "../service.js";
import { News, Toast } from "../toast.jsx";
import { GravitySensor } from "./gravity.js";
import { Gyroscope } from "./gyroscope.js";
import { refusal } from "./help.js";
import { KnownCameras } from "./intrinsics.js";
import { LiveView } from "./live_view.js";
import { MapState } from "./map_state.js";
import { AnchorPanel, Header, PlacePanel, Progress } from "./panels.jsx";
import { Help, Looking, MapChoice, NoMaps, Screen, Start, TokenForm } from "./screens.jsx";
import { Session } from "./session.js";
import { VideoSource } from "./video_source.js";

const LEAST_KEYFRAMES = 5; // of a map that the server saves

const parameters = new URLSearchParams(location.search);
const share = parameters.get("share") === "features" ? "features" : "images";

const $ = (id) => /** @type {HTMLElement} */ (document.getElementById(id));
const service = new Service(location, "/camera");
const state = new MapState();
const content = new Content(state, service.base);
content.loader.setRequestHeader(service.headers);
const gravity = new GravitySensor();
const gyroscope = new Gyroscope();
gyroscope.start();
const cameras = new KnownCameras(globalThis.localStorage);
const source = new VideoSource(/** @type {HTMLVideoElement} */ ($("video")), { onFrame, onEnded: () => !document.hidden && openCamera() });
/** @type {LiveView | null} */
let view = null;
/** @type {Session | null} */
let session = null;
let isWorking = false; // at an image

// What the panels show beside map and session; after a change they are drawn anew.
const ui = {
  screen: /** @type {import("preact").ComponentChild} */ (null), // instead of the picture
  anchor: /** @type {string | null} */ (null), // that is selected
};
const draw = batched(() => render(<Panels />, $("panels")), queueMicrotask);
const news = new News(draw);
function set(changes) {
  Object.assign(ui, changes);
  draw();
}
const edits = new AnchorEdits(state, (message) => session?.send(message));
for (const part of ["hello", "anchors"]) state.addEventListener(part, draw);
setInterval(() => session && draw(), 250); // the age of the place, and the seconds until a connection opens again

function Panels() {
  const anchor = state.anchors.find(({ name }) => name === ui.anchor);
  document.body.dataset.anchor = anchor?.name ?? "";
  return (
    <>
      {session ? <Header session={session} onLeave={leave} /> : <header />}
      <Toast news={news} />
      <footer>
        <Progress progress={session?.progress ?? null} hidden={session?.kind !== "record"} />
        {anchor && <AnchorPanel key={anchor.name} anchor={anchor} state={state} edits={edits} onClose={() => pickAnchor(null)} />}
        {view?.isPlacing && <PlacePanel models={state.models} edits={edits} view={view} onChange={draw} />}
        {session && view && <Bar session={session} view={view} />}
      </footer>
      {ui.screen && <Screen>{ui.screen}</Screen>}
    </>
  );
}

function Bar({ session: { kind, stream, tracked, isFinishing, progress }, view: { isPlacing, occluders } }) {
  const isOpen = stream ? stream.link.state === "open" : tracked?.state === "tracking";
  const areObjectsShown = occluders.outlines.visible;
  const mayFinish = isOpen && !isFinishing && progress?.keyframes >= LEAST_KEYFRAMES;
  return (
    <div id="bar">
      {kind !== "record" && state.mayEdit && state.models.length > 0 && <button data-action="place" disabled={!isOpen} aria-pressed={isPlacing} onClick={() => setPlacing(!isPlacing)}>Place</button>}
      {kind === "track" && <button data-action="objects" aria-pressed={areObjectsShown} onClick={() => showObjects(!areObjectsShown)}>Objects</button>}
      {kind === "record" && <button data-action="finish" disabled={!mayFinish} onClick={finish}>Finish</button>}
      <button data-action="maps" onClick={leave}>{kind === "record" ? "Cancel" : "Maps"}</button>
    </div>
  );
}

async function choose() {
  set({ screen: <Looking /> });
  try {
    const maps = await service.maps();
    const showMaps = () => set({ screen: <MapChoice maps={maps} knowsLens={source.isOpen && cameras.knows(source.lens)} onStart={start} onForgetLens={forgetLens} /> });
    const forgetLens = () => {
      cameras.forget(source.lens);
      showMaps();
    };
    showMaps();
  } catch (error) {
    const isAnswer = error instanceof ServiceError && error.status !== null;
    if (isAnswer && error.isAboutToken) set({ screen: <TokenForm onToken={setToken} /> });
    else set({ screen: <NoMaps text={isAnswer ? error.message : "The server does not answer."} onAgain={choose} onAlone={() => start("", "alone")} /> });
  }
}

function setToken(token) {
  history.replaceState(null, "", `#token=${encodeURIComponent(token)}`);
  service.setToken(token);
  content.loader.setRequestHeader(service.headers);
  choose();
}

function addressOf(map) {
  const search = new URLSearchParams({ ...(map && { map }), ...(share === "features" && { share }) }).toString();
  return `${location.origin}${location.pathname}${search && `?${search}`}${location.hash}`;
}

// Shows help where the browser refuses something; returns whether it does.
function isRefused(error) {
  const found = refusal({
    isSecure: isSecureContext,
    hasCamera: Boolean(navigator.mediaDevices?.getUserMedia),
    hasGraphics: Boolean(document.createElement("canvas").getContext("webgl2")),
    error,
    address: location.href,
  });
  if (found) set({ screen: <Help {...found} /> });
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

/** To be called while a tap is handled: browsers ask for the sensors only then. @param {string} map  @param {"track" | "record" | "alone"} kind */
async function start(map, kind) {
  const sensors = gravity.start();
  if (!source.isOpen && !(await openCamera())) return;
  await sensors;
  stayAwake();
  view ??= openView();
  set({ screen: null });
  enter(map, kind, view);
}

function openView() {
  const opened = new LiveView($("view"), state, content, source);
  opened.onPickAnchor = pickAnchor;
  opened.onPlace = (where) => {
    edits.place(where);
    setPlacing(false);
  };
  return opened;
}

function enter(map, kind, view) {
  session?.end();
  state.clear();
  state.tell("hello", "restart", "map", "anchors");
  pickAnchor(null);
  setPlacing(false);
  history.replaceState(null, "", addressOf(kind === "track" ? map : null));
  document.body.dataset.kind = kind;
  const entered = new Session({ service, state, source, gravity, gyroscope, cameras }, map, kind, { share });
  session = view.session = entered;
  Object.assign(window, { oaslam: { session, state, source, view, service, cameras } });
  for (const part of ["link", "answer", "progress"]) entered.addEventListener(part, draw);
  entered.addEventListener("saved", () => {
    enter(entered.map, "track", view);
    news.say("saved: this is the new map");
  });
  entered.addEventListener("said", (/** @type {any} */ { detail }) => news.say(detail));
}

function leave() {
  session?.end();
  session = null;
  if (view) view.session = null;
  setPlacing(false);
  choose();
}

function finish() {
  session?.finish();
  draw();
}

// While one image is worked at, others are left out: the next one is newer.
async function onFrame(time) {
  const [entered, shown] = [session, view];
  if (!entered || !shown || isWorking || document.hidden) return;
  isWorking = true;
  try {
    const { image, canvas } = source.grab(entered.size);
    shown.take(canvas);
    const tracked = await entered.process(image, time);
    if (entered === session) shown.show(tracked);
  } finally {
    isWorking = false;
  }
}

function pickAnchor(name) {
  view?.anchors.select(name);
  set({ anchor: name });
}

state.addEventListener("anchors", () => {
  const now = edits.follow(ui.anchor);
  if (now !== ui.anchor) pickAnchor(now);
});

function setPlacing(on) {
  if (view) view.isPlacing = on;
  if (on) pickAnchor(null);
  draw();
}

function showObjects(on) {
  view?.showObjects(on);
  draw();
}

// While the page is hidden it sends nothing, and the system may take the camera from it.
document.addEventListener("visibilitychange", () => {
  if (document.hidden || !session) return;
  session.stream?.link.hurry();
  stayAwake();
  if (!source.isOpen) openCamera();
});
addEventListener("online", () => session?.stream?.link.hurry());

async function stayAwake() {
  await navigator.wakeLock?.request("screen").catch(() => null);
}

if (!isRefused(null)) {
  const map = parameters.get("map");
  if (map) set({ screen: <Start map={map} sharesImages={share === "images"} onStart={start} onMaps={choose} /> });
  else choose();
}
