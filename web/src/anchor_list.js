// The anchors of the map, and what can be changed about them.
import { el } from "./dom.js";
import { labelOf, short } from "./palette.js";

const GROWTH = 1.15;
const TURN = Math.PI / 12; // about the anchor's y axis

export class AnchorList {
  // `send` takes a message to the program, `onPick` the name of an anchor.
  constructor(element, store, { send, onPick }) {
    this.element = element;
    this.store = store;
    this.send = send;
    this.onPick = onPick;
    this.selected = null;
    for (const part of ["anchors", "map", "status", "restart"]) store.addEventListener(part, () => this.draw());
    element.addEventListener("focusout", () => setTimeout(() => this.draw()));
    this.draw();
  }

  // Rows stay while what they say does, and while a name is being typed.
  draw() {
    const { anchors, mayPlace } = this.store;
    const key = JSON.stringify([mayPlace, anchors.map((a) => [a.name, a.model, a.size, this.standsOn(a)])]);
    if (key === this.key || this.element.querySelector("input:focus:not([readonly])")) return;
    this.key = key;
    const empty = el("p", { className: "muted" }, mayPlace ? "none yet: Place (p) in the AR view" : "no anchors in the map");
    this.element.replaceChildren(...(anchors.length > 0 ? anchors.map((anchor) => this.row(anchor)) : [empty]));
  }

  standsOn({ object }) {
    if (object === undefined) return "";
    const known = this.store.objects.get(object);
    return ` on ${known ? `${labelOf(known)} ` : "object "}${object}`;
  }

  row(anchor) {
    const { name, model, size } = anchor;
    const { mayPlace, unit } = this.store;
    const input = el("input", { value: name, readOnly: !mayPlace, title: mayPlace ? "Rename" : name, spellcheck: false });
    input.onchange = () => this.rename(name, input.value.trim());
    input.onkeydown = (event) => {
      if (event.key === "Escape") input.value = name;
      if (event.key === "Escape" || event.key === "Enter") input.blur();
    };
    const row = el("div", { className: "anchor", onclick: () => this.onPick(name) }, el("i", {}), input);
    row.dataset.anchor = name;
    row.setAttribute("aria-selected", name === this.selected);
    const edit = (action, label, title, change) => {
      const button = el("button", { title, onclick: () => this.change(name, change) }, label);
      button.dataset.action = action;
      return button;
    };
    if (mayPlace) row.append(edit("remove", "\u00d7", "Remove", () => ({ remove: true })));
    row.append(el("span", { className: "muted" }, `${model}${this.standsOn(anchor)} \u00b7 ${short(size)} ${unit}`));
    if (mayPlace)
      row.append(el("span", { className: "edits" },
        edit("smaller", "\u2212", "Smaller", (now) => ({ size: now.size / GROWTH })),
        edit("larger", "+", "Larger", (now) => ({ size: now.size * GROWTH })),
        edit("left", "\u21ba", "Turn left by 15 degrees", () => ({ turn: TURN })),
        edit("right", "\u21bb", "Turn right by 15 degrees", () => ({ turn: -TURN }))));
    return row;
  }

  change(name, change) {
    const now = this.store.anchors.find((anchor) => anchor.name === name);
    if (now) this.send({ type: "anchor", name, ...change(now) });
  }

  rename(from, to) {
    this.key = null; // the old name again, if the new one is not taken
    if (to !== "" && to !== from) this.change(from, () => ({ rename: to }));
    this.renamed = { from, to };
  }

  // The name of what is selected now: it may have been changed here; null where it is gone.
  follow(name) {
    const exists = (wanted) => this.store.anchors.some((anchor) => anchor.name === wanted);
    if (name === null || exists(name)) return name;
    return this.renamed?.from === name && exists(this.renamed.to) ? this.renamed.to : null;
  }

  select(name) {
    this.selected = name;
    for (const row of this.element.children) {
      row.setAttribute("aria-selected", row.dataset.anchor === name);
      if (row.dataset.anchor === name) row.scrollIntoView({ block: "nearest" });
    }
  }
}
