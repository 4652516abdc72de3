import { DoubleSide, Group, Mesh, MeshBasicMaterial, RingGeometry, Vector3 } from "three";
import { Labels } from "./labels.js";
import { COLORS } from "./palette.js";

const ABOVE_PX = 10; // a name's middle over its content
const RING = new RingGeometry(0.94, 1, 64).rotateX(-Math.PI / 2);
const RING_MATERIAL = new MeshBasicMaterial({ color: COLORS.anchor, side: DoubleSide });

/**
 * What a layer is part of: it adds its shapes to `world`, which is in the map's frame.
 * @typedef {object} Stage
 * @property {import("three").Object3D} world
 * @property {import("./ar_scene.js").MapContent} store
 * @property {HTMLElement} element for the names
 * @property {() => void} invalidate
 * @property {((name: string) => void) | undefined} [onPickAnchor]
 * @property {(point: Vector3) => boolean} isHidden
 * @property {(point: Vector3) => { x: number, y: number, depth: number } | null} toPage
 */

/** @typedef {(anchor: { name: string, model: string }) => import("three").Object3D | null | undefined} OwnContent */

/** Content on the anchors. */
export class AnchorsLayer {
  /** @type {Map<string, Group>} */ shapes = new Map(); // by name
  /** @type {string | null} */ selected = null;
  named = true;

  /**
   * `own`: what stands on an anchor instead of its model, of size 1 and with y up.
   * @param {Stage} view  @param {import("./content.js").Content} content  @param {{ shadows?: boolean, own?: OwnContent }} options
   */
  constructor(view, content, { shadows = false, own } = {}) {
    this.view = view;
    this.content = content;
    this.shadows = shadows;
    this.own = own;
    this.group = new Group();
    view.world.add(this.group);
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
    for (const [name, shape] of this.shapes) {
      const anchor = anchors.get(name);
      if (anchor && shape.userData.source === sourceOf(anchor)) continue;
      shape.removeFromParent();
      this.shapes.delete(name);
    }
    for (const [name, anchor] of anchors) {
      const shape = this.shapes.get(name) ?? this.build(anchor, sourceOf(anchor));
      shape.quaternion.fromArray(anchor.pose);
      shape.position.fromArray(anchor.pose, 4);
      shape.scale.setScalar(anchor.size);
    }
    this.labels.set([...anchors.keys()].map((key) => ({ key, text: key, color: COLORS.anchor })));
    this.arrange();
  }

  build({ name, model }, source) {
    const own = this.own?.({ name, model });
    const shape = own ? new Group().add(own) : this.content.make(model, { shadow: this.shadows });
    Object.assign(shape.userData, { name, source });
    this.group.add(shape);
    this.shapes.set(name, shape);
    return shape;
  }

  // Puts the ring around the selected content, whose width depends on whether its model is loaded.
  arrange() {
    const shape = this.selected === null ? undefined : this.shapes.get(this.selected);
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

  /** @param {string | null} name */
  select(name) {
    this.selected = name;
    this.arrange();
  }

  /**
   * The name of the content that the raycaster meets first; null where there is none, or a shape of `before` is met first.
   * @param {import("three").Raycaster} raycaster  @param {import("three").Object3D[]} before  @returns {string | null}
   */
  pick(raycaster, before = []) {
    if (!this.group.visible) return null;
    const hit = raycaster.intersectObjects([...this.group.children, ...before], true).find(({ object }) => !object.userData.isShadow && object !== this.ring);
    /** @type {import("three").Object3D | null | undefined} */
    let node = hit?.object;
    while (node && node.parent !== this.group) node = node.parent;
    return node?.userData.name ?? null;
  }

  // Puts the names over their content, unless all of it is hidden; returns the rectangles of all labels. A pin is always named, since it shows no model.
  placeLabels() {
    const point = new Vector3();
    const onAxis = (shape, share) => point.set(0, share * shape.userData.sides.y, 0).applyMatrix4(shape.matrix);
    return this.labels.place((name) => {
      const shape = this.shapes.get(name);
      if (!shape || !this.group.visible || !(this.named || shape.userData.isPin)) return null;
      if ([0.05, 0.5, 1].every((share) => this.view.isHidden(onAxis(shape, share)))) return null;
      const at = this.view.toPage(onAxis(shape, 1));
      return at && { ...at, y: at.y - ABOVE_PX };
    }, this.selected);
  }

  setVisible(on) {
    this.group.visible = on;
  }
}
