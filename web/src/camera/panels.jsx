// What lies over the picture.
import { AnchorButton, NameField } from "../anchor_controls.jsx";
import { short } from "../palette.js";
import { ageInWords, describe } from "./words.js";

/** State of the camera, how old its place is, and its map. @param {{ session: import("./session.js").Session, onLeave: () => void }} props */
export function Header({ session, onLeave }) {
  const { map, stream, why, answer, kind, isFinishing, tracked } = session;
  const seconds = ((stream?.link.retryAt ?? 0) - performance.now()) / 1000;
  const { state, text } = describe({ link: stream?.link.state, why, seconds, answer, kind, isFinishing, tracked });
  const age = tracked?.pose ? tracked.age : null;
  return (
    <header>
      <span id="state" class="pill" data-state={state}>{text}</span>
      {age !== null && <span id="age" class="pill" title="since the image by which the server has placed the camera; the device follows it since">{ageInWords(age)}</span>}
      <button id="name" class="pill" title="maps" onClick={onLeave}>{map || "no map"}</button>
    </header>
  );
}

/** How far a new map is. @param {{ progress: import("../messages").Progress | null, hidden: boolean }} props */
export function Progress({ progress, hidden }) {
  const { text, keyframes = 0, landmarks = 0, objects = 0 } = progress ?? { text: "Point at something with details, and move sideways slowly." };
  return (
    <div id="progress" hidden={hidden}>
      <p>{text}</p>
      <div class="row counts"><span><b>{keyframes}</b> views</span><span><b>{landmarks}</b> points</span><span><b>{objects}</b> objects</span></div>
    </div>
  );
}

/**
 * The selected anchor, and what can be changed about it.
 * @param {{ anchor: import("../messages").Anchor, state: import("./map_state.js").MapState, edits: import("../anchor_edits.js").AnchorEdits, onClose: () => void }} props
 */
export function AnchorPanel({ anchor: { name, model, size }, state, edits, onClose }) {
  return (
    <div id="anchor">
      <div class="row">
        <NameField edits={edits} name={name} readOnly={!state.mayEdit} aria-label="name" />
        <span class="muted">{`${model} \u00b7 ${short(size)} ${state.unit}`}</span>
        <button title="Close" class="close" onClick={onClose}>{"\u00d7"}</button>
      </div>
      {state.mayEdit && (
        <div class="row">
          {["smaller", "larger", "left", "right"].map((action) => <AnchorButton {...{ edits, name, action }} />)}
          <AnchorButton {...{ edits, name }} action="remove" label="Remove" />
        </div>
      )}
    </div>
  );
}

/**
 * What the next tap places: which model, and whether on top of an object or where the ray meets a surface.
 * @param {{ models: import("../messages").Model[], edits: import("../anchor_edits.js").AnchorEdits, view: import("./live_view.js").LiveView, onChange: () => void }} props
 */
export function PlacePanel({ models, edits, view, onChange }) {
  const choice = (text, isOn, choose) => <button key={text} aria-pressed={isOn} onClick={() => (choose(), onChange())}>{text}</button>;
  return (
    <div id="models">
      <p>{view.isOnObjects ? "Tap an object: it stands on top of it." : "Tap the place where it is to stand."}</p>
      <div class="row">{models.map(({ name }) => choice(name, name === edits.modelToPlace, () => (edits.model = name)))}</div>
      <div class="row">
        {choice("on a surface", !view.isOnObjects, () => (view.isOnObjects = false))}
        {choice("on objects", view.isOnObjects, () => (view.isOnObjects = true))}
      </div>
    </div>
  );
}
