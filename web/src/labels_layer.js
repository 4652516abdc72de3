import { Vector3 } from "three";
import { Labels } from "./labels.js";
import { classColor, labelOf } from "./palette.js";

// Names of objects beside them.
export class LabelsLayer {
  constructor(view) {
    this.view = view;
    this.labels = new Labels(view.element, "object", (id) => view.onPick?.(id));
    this.visible = true;
  }

  update(part) {
    if (part !== "map" && part !== "restart") return;
    this.labels.set(this.view.store.mappedObjects().map((o) => ({ key: o.id, text: `${labelOf(o)} ${o.id}`, color: classColor(o.category_id, 70) })));
  }

  place(taken) {
    if (!this.visible || !this.view.layers.objects.group.visible) return;
    const { objects } = this.view.store;
    this.labels.place((id) => objects.has(id) && this.view.toPage(new Vector3(...objects.get(id).center)), this.view.layers.objects.selected, taken);
  }

  setVisible(on) {
    this.visible = on;
    this.labels.element.hidden = !on;
  }
}
