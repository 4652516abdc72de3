import { Vector3 } from "three";
import { classColor, labelOf } from "./palette.js";

// Names of objects beside them; of those that would cover each other the nearest is shown.
export class LabelsLayer {
  constructor(view) {
    this.view = view;
    this.element = document.createElement("div");
    this.element.className = "labels";
    view.element.append(this.element);
    this.labels = new Map();
    this.visible = true;
  }

  update(part) {
    if (part !== "map" && part !== "restart") return;
    const { objects } = this.view.store;
    for (const [id, label] of this.labels)
      if (!objects.get(id)?.mapped) {
        label.remove();
        this.labels.delete(id);
      }
    for (const object of objects.values()) {
      if (!object.mapped) continue;
      let label = this.labels.get(object.id);
      if (!label) {
        label = document.createElement("button");
        label.onclick = () => this.view.onPick?.(object.id);
        this.element.append(label);
        this.labels.set(object.id, label);
      }
      label.dataset.object = object.id;
      label.style.setProperty("--color", classColor(object.category_id, 70));
      const text = `${labelOf(object)} ${object.id}`;
      if (label.textContent !== text) {
        label.textContent = text;
        label.box = null;
      }
    }
  }

  place() {
    if (!this.visible || !this.view.layers.objects.group.visible) return;
    const { objects } = this.view.store;
    const placed = [];
    const candidates = [];
    for (const [id, label] of this.labels) {
      const object = objects.get(id);
      const at = object && this.view.toPage(new Vector3(...object.center));
      if (at) candidates.push({ label, at, first: id === this.view.layers.objects.selected });
      else label.style.visibility = "hidden";
    }
    candidates.sort((a, b) => b.first - a.first || a.at.depth - b.at.depth);
    for (const { label, at, first } of candidates) {
      label.classList.toggle("selected", first);
      label.box ??= { width: label.offsetWidth, height: label.offsetHeight };
      const { width, height } = label.box;
      const free = [0, -1, 1, -2, 2].map((row) => ({ x: at.x - width / 2, y: at.y - height / 2 + row * (height + 1) }))
        .find(({ x, y }) => !placed.some((p) => x < p.x + p.width + 2 && p.x < x + width + 2 && y < p.y + p.height && p.y < y + height));
      label.style.visibility = free ? "visible" : "hidden";
      if (!free) continue;
      label.style.transform = `translate(${Math.round(free.x)}px, ${Math.round(free.y)}px)`;
      placed.push({ ...free, width, height });
    }
  }

  setVisible(on) {
    this.visible = on;
    this.element.hidden = !on;
  }
}
