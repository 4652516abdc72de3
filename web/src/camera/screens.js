// What stands before the picture: the choice of a map, and help.
import { el } from "../dom.js";

const NAME = /^[A-Za-z0-9_-][A-Za-z0-9._-]{0,63}$/; // as the server wants it

export class Screens {
  // `onStart` gets a map and "track" or "record", while a tap is handled; `onForgetLens` makes `knowsLens` false.
  constructor(element, service, { onStart, onToken, knowsLens, onForgetLens }) {
    Object.assign(this, { element, service, onStart, onToken, knowsLens, onForgetLens });
  }

  show(...parts) {
    this.element.hidden = false;
    this.element.replaceChildren(el("div", { className: "card" }, el("h1", {}, "OA-SLAM"), ...parts));
  }

  hide() {
    this.element.hidden = true;
  }

  // One map, of the address.
  start(map) {
    this.show(
      el("p", {}, "The camera is found in the map ", el("b", {}, map), ", and what stands there is drawn in its picture. Images go to this server; it keeps none unless it was told to."),
      this.button("Start", "start", () => this.onStart(map, "track"), "primary"),
      this.button("Other maps", "maps", () => this.choose()));
  }

  async choose() {
    this.show(el("p", { className: "muted" }, "looking for maps\u2026"));
    let maps;
    try {
      maps = await this.service.maps();
    } catch (error) {
      if (error.status === 401 || error.status === 403) return this.askForToken();
      return this.show(el("p", {}, error.status ? error.message : "The server does not answer."), this.button("Again", "again", () => this.choose(), "primary"));
    }
    const list = el("div", { className: "list" }, ...maps.map(({ name }) => this.map(name)));
    if (maps.length === 0) list.append(el("p", { className: "muted" }, "There is no map yet."));
    const input = el("input", { placeholder: "name of the new map", maxLength: 64, spellcheck: false, autocapitalize: "off", autocomplete: "off" });
    const hint = el("p", { className: "muted" }, "A new map is made from what the camera sees.");
    const create = this.button("New map", "create", () => {
      const name = input.value.trim();
      const isTaken = maps.some((map) => map.name === name);
      if (!NAME.test(name)) hint.textContent = "A name has letters, digits, and . _ - (no blanks)";
      else if (isTaken) hint.textContent = `There is a map ${name} already.`;
      else this.onStart(name, "record");
    });
    const forget = this.button("Estimate this camera's lens again", "lens", () => {
      this.onForgetLens();
      forget.remove();
    }, "link");
    this.show(list, el("div", { className: "row" }, input, create), hint, ...(this.knowsLens() ? [forget] : []));
  }

  map(name) {
    const button = this.button(name, "map", () => this.onStart(name, "track"));
    button.dataset.map = name;
    return button;
  }

  askForToken() {
    const input = el("input", { placeholder: "token", autocapitalize: "off", autocomplete: "off", spellcheck: false });
    this.show(
      el("p", {}, "This server asks for a token. The address that it printed ends in #token=\u2026: open that one, or give the token here."),
      el("div", { className: "row" }, input, this.button("Go on", "token", () => this.onToken(input.value.trim()), "primary")));
  }

  help({ title, steps }) {
    this.show(el("h2", {}, title), el("ol", {}, ...steps.map((step) => el("li", {}, step))), this.button("Try again", "reload", () => location.reload(), "primary"));
  }

  button(text, action, onclick, className = "") {
    const button = el("button", { onclick, className }, text);
    button.dataset.action = action;
    return button;
  }
}
