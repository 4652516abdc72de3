// The anchors of the map, and what can be changed about them.
import { AnchorEdits, GROWTH, MAX_NAME, TURN } from "./anchor_edits.js";
import { el } from "./dom.js";
import { labelOf, short } from "./palette.js";

export class AnchorList {
  // `send` takes a message to the program, `onPick` the name of an anchor.
  constructor(element, store, { send, onPick }) {
    this.element = element;
    this.store = store;
    this.edits = new AnchorEdits(store, send);
    this.onPick = onPick;
    this.selected = null;
    this.press = null;
    for (const part of ["anchors", "map", "status", "restart"]) store.addEventListener(part, () => this.draw());
    element.addEventListener("focusout", () => setTimeout(() => this.draw()));
    // A press of a button or a key lasts until after the click that may come of it, unless another has begun by then.
    for (const begin of ["pointerdown", "keydown"]) element.addEventListener(begin, () => (this.press = {}));
    const release = () => {
      const { press } = this;
      setTimeout(() => {
        if (this.press !== press) return;
        this.press = null;
        this.draw();
      });
    };
    for (const end of ["pointerup", "pointercancel", "keyup", "blur"]) addEventListener(end, release);
    this.draw();
  }

  // Rows stay while what they say does, while a name is being typed, and while one is pressed.
  draw() {
    const { anchors, mayEdit } = this.store;
    const key = JSON.stringify([mayEdit, anchors.map((a) => [a.name, a.model, a.size, this.standsOn(a)])]);
    if (key === this.key || this.press || this.element.querySelector("input:focus:not([readonly])")) return;
    this.key = key;
    const empty = el("p", { className: "muted" }, mayEdit ? "none yet: Place (p) in the AR view" : "no anchors in the map");
    const held = this.element.contains(document.activeElement) ? document.activeElement : null;
    const heldRow = held?.closest(".anchor")?.dataset.anchor ?? null;
    this.element.replaceChildren(...(anchors.length > 0 ? anchors.map((anchor) => this.row(anchor)) : [empty]));
    // Who works with the keyboard stays where they are.
    if (held) this.rowOf(this.follow(heldRow))?.querySelector(`[data-action=${held.dataset.action}]`)?.focus();
  }

  rowOf(name) {
    return [...this.element.children].find((row) => row.dataset.anchor === name);
  }

  standsOn({ object }) {
    if (object === undefined) return "";
    const known = this.store.objects.get(object);
    return ` on ${known ? `${labelOf(known)} ` : "object "}${object}`;
  }

  row(anchor) {
    const { name, model, size } = anchor;
    const { mayEdit, unit } = this.store;
    const input = el("input", { value: name, maxLength: MAX_NAME, readOnly: !mayEdit, title: mayEdit ? "Rename" : name, spellcheck: false });
    input.dataset.action = "rename";
    input.onfocus = () => this.onPick(name);
    input.onchange = () => this.rename(name, input.value.trim());
    input.onkeydown = (event) => {
      if (event.key === "Escape") input.value = name;
      if (event.key === "Escape" || event.key === "Enter") input.blur();
    };
    const row = el("div", { className: "anchor", onclick: () => this.onPick(name) }, el("i", {}), input);
    row.dataset.anchor = name;
    row.setAttribute("aria-selected", name === this.selected);
    const edit = (action, label, title, change) => {
      const button = el("button", { title, onclick: () => this.edits.change(name, change) }, label);
      button.dataset.action = action;
      return button;
    };
    if (mayEdit) row.append(edit("remove", "\u00d7", "Remove", () => ({ remove: true })));
    row.append(el("span", { className: "muted" }, `${model}${this.standsOn(anchor)} \u00b7 ${short(size)} ${unit}`));
    if (mayEdit)
      row.append(el("span", { className: "edits" },
        edit("smaller", "\u2212", "Smaller", (now) => ({ size: now.size / GROWTH })),
        edit("larger", "+", "Larger", (now) => ({ size: now.size * GROWTH })),
        edit("left", "\u21ba", "Turn left by 15 degrees", () => ({ turn: TURN })),
        edit("right", "\u21bb", "Turn right by 15 degrees", () => ({ turn: -TURN }))));
    return row;
  }

  rename(from, to) {
    this.key = null; // the old name again, if the new one is not taken
    this.edits.rename(from, to);
  }

  // The name of what is selected now; null where it is gone.
  follow(name) {
    return this.edits.follow(name);
  }

  select(name) {
    this.selected = name;
    for (const row of this.element.children) {
      row.setAttribute("aria-selected", row.dataset.anchor === name);
      if (row.dataset.anchor === name) row.scrollIntoView({ block: "nearest" });
    }
  }
}
