import { Vector3 } from "three";
import { Labels } from "./labels.js";
import { classColor, labelOf } from "./palette.js";

/** The names of objects. */
export class LabelsLayer {
  /** @param {import("./map_view.js").MapView} view */
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
    this.labels.place((id) => {
      const object = objects.get(id);
      return object && this.view.toPage(new Vector3(...object.center));
    }, this.view.layers.objects.selected, taken);
  }

  setVisible(on) {
    this.visible = on;
    this.labels.element.hidden = !on;
  }
}
