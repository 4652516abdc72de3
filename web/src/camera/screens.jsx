// What is shown instead of the picture: the choice of a map, and help.
import { useRef, useState } from "preact/hooks";

const NAME = /^[^./\p{Cc}][^/\p{Cc}]*$/u, LONGEST = 64; // shorter than what the server accepts

/** @type {import("preact").InputHTMLAttributes} */
const FIELD = { autocapitalize: "off", autocomplete: "off", spellcheck: false };
const Button = ({ action, ...rest }) => <button data-action={action} {...rest} />;

export const Screen = ({ children }) => <section id="screen"><div class="card"><h1>OA-SLAM</h1>{children}</div></section>;

// The map of the page's address. (`onStart` runs while the tap is handled: browsers ask for camera and sensors only then.)
export const Start = ({ map, sharesImages, onStart, onMaps }) => (
  <>
    <p>The camera is found in the map <b>{map}</b>, and what stands there is drawn in its picture. {sharesImages ? "Images go to this server, one or two a second; it keeps none unless it was told to." : "No image leaves this device: only key points and their descriptors go to this server."}</p>
    <Button action="start" class="primary" onClick={() => onStart(map, "track")}>Start</Button>
    <Button action="maps" onClick={onMaps}>Other maps</Button>
  </>
);

export const Looking = () => <p class="muted">{"looking for maps\u2026"}</p>;

export const NoMaps = ({ text, onAgain, onAlone }) => (
  <>
    <p>{text}</p>
    <Button action="again" class="primary" onClick={onAgain}>Again</Button>
    <Button action="alone" onClick={onAlone}>Without a map</Button>
    <p class="muted">Without a map, content stands on what the camera sees, and is gone when the page is left.</p>
  </>
);

// The maps to be in, and a new one. `onForgetLens` makes `knowsLens` false.
export function MapChoice({ maps, knowsLens, onStart, onForgetLens }) {
  const input = useRef(/** @type {HTMLInputElement | null} */ (null));
  const [hint, setHint] = useState("A new map is made from what the camera sees.");
  const create = () => {
    const name = input.current?.value.trim() ?? "";
    if (!NAME.test(name)) setHint("A name begins without a dot and has no slash");
    else if (maps.some((map) => map.name === name)) setHint(`There is a map ${name} already.`);
    else onStart(name, "record");
  };
  return (
    <>
      <div class="list">
        {maps.map(({ name }) => <Button key={name} action="map" data-map={name} onClick={() => onStart(name, "track")}>{name}</Button>)}
        {maps.length === 0 && <p class="muted">There is no map yet.</p>}
      </div>
      <div class="row">
        <input ref={input} placeholder="name of the new map" maxLength={LONGEST} {...FIELD} />
        <Button action="create" onClick={create}>New map</Button>
      </div>
      <p class="muted">{hint}</p>
      {knowsLens && <Button action="lens" class="link" onClick={onForgetLens}>Estimate this camera's lens again</Button>}
    </>
  );
}

export function TokenForm({ onToken }) {
  const input = useRef(/** @type {HTMLInputElement | null} */ (null));
  return (
    <>
      <p>{"This server asks for a token. The address that it printed ends in #token=\u2026: open that one, or give the token here."}</p>
      <div class="row">
        <input ref={input} placeholder="token" {...FIELD} />
        <Button action="token" class="primary" onClick={() => onToken(input.current?.value.trim() ?? "")}>Go on</Button>
      </div>
    </>
  );
}

export const Help = ({ title, steps }) => (
  <>
    <h2>{title}</h2>
    <ol>{steps.map((step) => <li key={step}>{step}</li>)}</ol>
    <Button action="reload" class="primary" onClick={() => location.reload()}>Try again</Button>
  </>
);
