// What changes an anchor, on both pages.
import { useState } from "preact/hooks";
import { GROWTH, MAX_NAME, TURN } from "./anchor_edits.js";

/** @type {Record<string, { label: string, title: string, change: (now: { size: number }) => import("./messages").AnchorEdit }>} */
const ACTIONS = {
  smaller: { label: "\u2212", title: "Smaller", change: (now) => ({ size: now.size / GROWTH }) },
  larger: { label: "+", title: "Larger", change: (now) => ({ size: now.size * GROWTH }) },
  left: { label: "\u21ba", title: "Turn left by 15 degrees", change: () => ({ turn: TURN }) },
  right: { label: "\u21bb", title: "Turn right by 15 degrees", change: () => ({ turn: -TURN }) },
  remove: { label: "\u00d7", title: "Remove", change: () => ({ remove: true }) },
};

/** @param {{ edits: import("./anchor_edits.js").AnchorEdits, name: string, action: string, label?: string }} props */
export function AnchorButton({ edits, name, action, label }) {
  const { title, change, ...own } = ACTIONS[action];
  return <button title={title} data-action={action} onClick={() => edits.change(name, change)}>{label ?? own.label}</button>;
}

// The name, to be typed over: Enter and leaving the field take the new one over, Escape restores the old one.
export function NameField({ edits, name, readOnly, ...rest }) {
  const [typed, setTyped] = useState(/** @type {string | null} */ (null)); // null: nothing is being typed
  const onKeyDown = ({ key, currentTarget }) => {
    if (key === "Escape") currentTarget.value = name;
    if (key === "Escape" || key === "Enter") currentTarget.blur();
  };
  const onBlur = ({ currentTarget }) => {
    setTyped(null);
    edits.rename(name, currentTarget.value.trim());
  };
  return <input {...rest} value={typed ?? name} maxLength={MAX_NAME} readOnly={readOnly} spellcheck={false} autocomplete="off"
    onInput={({ currentTarget }) => setTyped(currentTarget.value)} onKeyDown={onKeyDown} onBlur={onBlur} />;
}
