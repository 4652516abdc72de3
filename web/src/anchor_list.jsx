import { useEffect, useRef } from "preact/hooks";
import { AnchorButton, NameField } from "./anchor_controls.jsx";
import { labelOf, short } from "./palette.js";

/**
 * The anchors of the map, and what can be changed about them. `onPick` gets a name.
 * @param {{ store: import("./store.js").Store, edits: import("./anchor_edits.js").AnchorEdits, selected: string | null, onPick: (name: string) => void }} props
 */
export function AnchorList({ store, edits, selected, onPick }) {
  const { mayEdit } = store;
  const anchors = edits.numbered();
  if (anchors.length === 0) return <p class="muted">{mayEdit ? "none yet: Place (p) in the AR view" : "no anchors in the map"}</p>;
  return anchors.map(({ anchor, number }) => <Row key={number} {...{ anchor, store, edits, onPick }} isSelected={anchor.name === selected} />);
}

function Row({ anchor, store, edits, onPick, isSelected }) {
  const row = useRef(/** @type {HTMLDivElement | null} */ (null));
  useEffect(() => {
    if (isSelected) row.current?.scrollIntoView({ block: "nearest" });
  }, [isSelected]);
  const { name, model, size, object } = anchor;
  const { mayEdit, unit } = store;
  const known = object === undefined ? undefined : store.objects.get(object);
  const place = object === undefined ? "" : ` on ${known ? labelOf(known) : "object"} ${object}`;
  const pick = () => onPick(name);
  const button = (action) => <AnchorButton {...{ edits, name, action }} />;
  return (
    <div class="anchor" ref={row} data-anchor={name} aria-selected={isSelected} onClick={pick}>
      <i />
      <NameField edits={edits} name={name} readOnly={!mayEdit} title={mayEdit ? "Rename" : name} data-action="rename" onFocus={pick} />
      {mayEdit && button("remove")}
      <span class="muted">{`${model}${place} \u00b7 ${short(size)} ${unit}`}</span>
      {mayEdit && <span class="edits">{["smaller", "larger", "left", "right"].map(button)}</span>}
    </div>
  );
}
