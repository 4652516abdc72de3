import { DoubleSide, Group, Mesh, MeshBasicMaterial, RingGeometry, Vector3 } from "three";
import { Labels } from "./labels.js";
import { COLORS } from "./palette.js";

const ABOVE_PX = 10; // a name's middle over its content
const RING = new RingGeometry(0.94, 1, 64).rotateX(-Math.PI / 2);
const RING_MATERIAL = new MeshBasicMaterial({ color: COLORS.anchor, side: DoubleSide });

// The content of anchors, where they are now.
export class AnchorsLayer {
  constructor(view, content, { shadows = false } = {}) {
    this.view = view;
    this.content = content;
    this.shadows = shadows;
    this.group = new Group();
    view.world.add(this.group);
    this.shapes = new Map();
    this.selected = null;
    this.named = true;
    this.ring = new Mesh(RING, RING_MATERIAL);
    this.labels = new Labels(view.element, "anchor", (name) => view.onPickAnchor?.(name));
    content.addEventListener("loaded", () => this.arrange());
  }

  get count() {
    return this.group.visible ? this.shapes.size : 0;
  }

  update(part) {
    if (part !== "anchors" && part !== "restart") return;
    const anchors = new Map(this.view.store.anchors.map((anchor) => [anchor.name, anchor]));
    const sourceOf = ({ model }) => `${model} ${this.content.urlOf(model)}`;
    for (const [name, shape] of this.shapes)
      if (!anchors.has(name) || shape.userData.source !== sourceOf(anchors.get(name))) {
        shape.removeFromParent();
        this.shapes.delete(name);
      }
    for (const [name, anchor] of anchors) {
      if (!this.shapes.has(name)) this.shapes.set(name, this.build(anchor, sourceOf(anchor)));
      const shape = this.shapes.get(name);
      shape.quaternion.fromArray(anchor.pose);
      shape.position.fromArray(anchor.pose, 4);
      shape.scale.setScalar(anchor.size);
    }
    this.labels.set([...anchors.keys()].map((key) => ({ key, text: key, color: COLORS.anchor })));
    this.arrange();
  }

  build({ name, model }, source) {
    const shape = this.content.make(model, { shadow: this.shadows });
    Object.assign(shape.userData, { name, source });
    this.group.add(shape);
    return shape;
  }

  // The ring around what is selected, as wide as that is now.
  arrange() {
    const shape = this.shapes.get(this.selected);
    this.ring.removeFromParent();
    if (shape) {
      const { x, z } = shape.userData.sides;
      this.ring.scale.setScalar(0.62 * Math.max(x, z) + 0.08);
      this.ring.position.y = 0.01;
      shape.add(this.ring);
    }
    this.group.updateMatrixWorld(true);
    this.view.invalidate();
  }

  select(name) {
    this.selected = name;
    this.arrange();
  }

  // What the raycaster meets first, unless something of `before` lies before it.
  pick(raycaster, before = []) {
    if (!this.group.visible) return null;
    const hit = raycaster.intersectObjects([...this.group.children, ...before], true).find(({ object }) => !object.userData.isShadow && object !== this.ring);
    let node = hit?.object;
    while (node && node.parent !== this.group) node = node.parent;
    return node?.userData.name ?? null;
  }

  // Over the content, unless all of that is hidden; the places that they take. A pin is always named: it does not show what it stands for.
  placeLabels() {
    const point = new Vector3();
    const onAxis = (shape, share) => point.set(0, share * shape.userData.sides.y, 0).applyMatrix4(shape.matrix);
    return this.labels.place((name) => {
      const shape = this.shapes.get(name);
      if (!this.group.visible || !(this.named || shape.userData.isPin)) return null;
      if ([0.05, 0.5, 1].every((share) => this.view.isHidden?.(onAxis(shape, share)))) return null;
      const at = this.view.toPage(onAxis(shape, 1));
      return at && { ...at, y: at.y - ABOVE_PX };
    }, this.selected);
  }

  setVisible(on) {
    this.group.visible = on;
  }
}
