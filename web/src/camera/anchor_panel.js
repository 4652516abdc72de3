// The selected anchor, and what can be changed about it.
import { AnchorEdits, GROWTH, MAX_NAME, TURN } from "../anchor_edits.js";
import { el } from "../dom.js";
import { short } from "../palette.js";

export class AnchorPanel {
  constructor(element, state, { send, onPick }) {
    Object.assign(this, { element, state, onPick });
    this.edits = new AnchorEdits(state, send);
    this.name = null;
    this.input = el("input", { maxLength: MAX_NAME, spellcheck: false, autocomplete: "off" });
    this.input.setAttribute("aria-label", "name");
    this.input.onchange = () => this.edits.rename(this.name, this.input.value.trim());
    this.input.onkeydown = ({ key }) => {
      if (key === "Escape") this.input.value = this.name;
      if (key === "Escape" || key === "Enter") this.input.blur();
    };
    this.about = el("span", { className: "muted" });
    const button = (action, label, title, change) => {
      const made = el("button", { title, onclick: () => this.edits.change(this.name, change) }, label);
      made.dataset.action = action;
      return made;
    };
    this.actions = el("div", { className: "row" },
      button("smaller", "\u2212", "Smaller", (now) => ({ size: now.size / GROWTH })),
      button("larger", "+", "Larger", (now) => ({ size: now.size * GROWTH })),
      button("left", "\u21ba", "Turn left by 15 degrees", () => ({ turn: TURN })),
      button("right", "\u21bb", "Turn right by 15 degrees", () => ({ turn: -TURN })),
      button("remove", "Remove", "Remove", () => ({ remove: true })));
    const close = el("button", { title: "Close", className: "close", onclick: () => onPick(null) }, "\u00d7");
    element.append(el("div", { className: "row" }, this.input, this.about, close), this.actions);
    state.addEventListener("anchors", () => this.follow());
  }

  follow() {
    const now = this.edits.follow(this.name);
    if (now !== this.name) this.onPick(now);
    else this.draw();
  }

  select(name) {
    this.name = name;
    this.draw();
  }

  draw() {
    const anchor = this.state.anchors.find(({ name }) => name === this.name);
    this.element.hidden = !anchor;
    if (!anchor) return;
    if (document.activeElement !== this.input) this.input.value = anchor.name;
    this.input.readOnly = !this.state.mayEdit;
    this.actions.hidden = !this.state.mayEdit;
    this.about.textContent = `${anchor.model} \u00b7 ${short(anchor.size)} ${this.state.unit}`;
  }
}
