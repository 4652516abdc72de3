// The sidebar's lists: layers, objects, anchors, events.
import { AnchorList } from "./anchor_list.js";
import { classColor, COLORS, labelOf, STATE_COLORS } from "./palette.js";
import { el } from "./dom.js";

const EVENT_COLORS = { lost: STATE_COLORS.lost, relocalized: STATE_COLORS.relocalized, objects: STATE_COLORS.objects, loop: "#c58af9", object: "#8b96a3", anchor: COLORS.anchor, map: STATE_COLORS.tracking, reset: "#e6e9ed" };

export class Lists {
  constructor(tabs, body, store, { layers, onLayer, onPick, onPickAnchor, onEvent, send }) {
    this.store = store;
    this.body = body;
    this.onPick = onPick;
    this.onEvent = onEvent;
    this.pages = { Layers: this.layersPage(layers, onLayer), Objects: el("div", { className: "list" }), Anchors: el("div", { className: "list" }), Events: el("div", { className: "list" }) };
    this.buttons = Object.keys(this.pages).map((name) => {
      const button = el("button", { onclick: () => this.open(name) }, name);
      button.dataset.tab = name;
      return button;
    });
    tabs.append(...this.buttons);
    body.append(...Object.values(this.pages));
    store.addEventListener("map", () => this.drawObjects());
    store.addEventListener("restart", () => this.drawObjects());
    store.addEventListener("events", () => this.drawEvents());
    this.anchors = new AnchorList(this.pages.Anchors, store, { send, onPick: onPickAnchor });
    for (const part of ["anchors", "restart"]) store.addEventListener(part, () => this.title("Anchors", store.anchors.length));
    this.open("Layers");
  }

  open(name) {
    for (const button of this.buttons) button.setAttribute("aria-selected", button.dataset.tab === name);
    for (const [other, page] of Object.entries(this.pages)) page.hidden = other !== name;
  }

  title(name, count) {
    this.buttons.find((button) => button.dataset.tab === name).textContent = count > 0 ? `${name} ${count}` : name;
  }

  layersPage(layers, onLayer) {
    const page = el("div", { className: "layers" });
    for (const { id, label, color, on, group } of layers) {
      if (group) page.append(el("h3", {}, group));
      const box = el("input", { type: "checkbox", checked: on, onchange: () => onLayer(id, box.checked) });
      box.dataset.layer = id;
      const mark = el("i", {});
      mark.style.background = color;
      page.append(el("label", {}, box, mark, label));
    }
    return page;
  }

  drawObjects() {
    const objects = this.store.mappedObjects().sort((a, b) => a.id - b.id);
    const key = objects.map((o) => `${o.id} ${labelOf(o)} ${o.observations}`).join();
    this.title("Objects", objects.length);
    if (key === this.objectsKey) return;
    this.objectsKey = key;
    const rows = objects.map((o) => {
      const row = el("button", { className: "row", onclick: () => this.onPick(o.id) }, el("i", {}), el("span", {}, `${labelOf(o)} ${o.id}`), el("span", { className: "muted" }, `seen ${o.observations}\u00d7`));
      row.style.setProperty("--color", classColor(o.category_id));
      row.dataset.object = o.id;
      return row;
    });
    this.pages.Objects.replaceChildren(...(rows.length > 0 ? rows : [el("p", { className: "muted" }, "no objects in the map")]));
  }

  drawEvents() {
    const { events } = this.store;
    const shown = events.slice(-200).reverse();
    this.pages.Events.replaceChildren(...shown.map((event) => {
      const row = el("button", { className: "row event", onclick: () => this.onEvent(event.frame) }, el("span", { className: "muted frame" }, event.frame ?? ""), el("i", {}), el("span", {}, el("b", {}, event.kind), ` ${event.text}`));
      row.style.setProperty("--color", EVENT_COLORS[event.kind] ?? "#8b96a3");
      return row;
    }));
    this.title("Events", events.length);
  }
}
