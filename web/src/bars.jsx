// What lies over the view that is open: tools, content to place, commands to a live run, hints and news.

/** `shortcut`: a key that presses the button. @param {import("preact").ButtonHTMLAttributes & { label: string, title: string, shortcut?: string }} props */
function Tool({ label, title, shortcut, ...rest }) {
  return <button title={shortcut ? `${title} (${shortcut === " " ? "space" : shortcut})` : title} data-key={shortcut} {...rest}>{label}</button>;
}

/** Presses the button that has a key as its shortcut; false where there is none. */
export function pressShortcut(key) {
  const button = document.querySelector(`button[data-key="${CSS.escape(key)}"]:enabled`);
  if (button instanceof HTMLElement) button.click();
  return button !== null;
}

/** @param {{ map: import("./map_view.js").MapView, onChange: () => void }} props */
export function Tools({ map, onChange }) {
  const after = (act) => () => (act(), onChange());
  return (
    <div id="tools" class="bar">
      <Tool label="Follow" title="Follow the camera" shortcut="c" aria-pressed={map.follow} onClick={after(() => map.setFollow(!map.follow))} />
      <Tool label="Fit" title="Show the whole map" shortcut="f" onClick={after(() => map.fit())} />
      <Tool label="Top" title="From above" shortcut="t" onClick={after(() => map.top())} />
      <Tool label="Measure" title="Distance between two points" shortcut="m" aria-pressed={map.measure.isOn} onClick={after(() => map.measure.set(!map.measure.isOn))} />
    </div>
  );
}

/** @param {{ edits: import("./anchor_edits.js").AnchorEdits, models: import("./messages").Model[], isPlacing: boolean, onPlace: () => void }} props */
export function PlaceBar({ edits, models, isPlacing, onPlace }) {
  const onChange = ({ currentTarget }) => {
    edits.model = currentTarget.value;
    currentTarget.blur(); // keys are shortcuts again
  };
  return (
    <div id="place" class="bar">
      <Tool label="Place" title="Put content into the scene" shortcut="p" aria-pressed={isPlacing} onClick={onPlace} />
      <select title="What to place" value={edits.modelToPlace} onChange={onChange}>{models.map(({ name }) => <option key={name} value={name}>{name}</option>)}</select>
    </div>
  );
}

/** @param {{ status: import("./messages").Status, hasMap: boolean, onCommand: (name: string, on?: boolean) => void }} props */
export function Controls({ status: { paused, mapping }, hasMap, onCommand }) {
  return (
    <div id="controls" class="bar">
      <Tool label={paused ? "Resume" : "Pause"} title="Hold the run" shortcut=" " aria-pressed={paused} onClick={() => onCommand("pause", !paused)} />
      <Tool label="Step" title="One image" shortcut="s" disabled={!paused} onClick={() => onCommand("step")} />
      <Tool label="Relocalize" title="Give up the pose and look for the camera in the map" disabled={!hasMap} onClick={() => onCommand("relocalize")} />
      <Tool label="Localization only" title="Follow the camera and leave the map as it is" disabled={!hasMap} aria-pressed={!mapping} onClick={() => onCommand("mapping", !mapping)} />
      <Tool label="Reset" title="Forget the map" onClick={() => onCommand("reset")} />
    </div>
  );
}
