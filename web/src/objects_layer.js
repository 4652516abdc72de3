import { BufferGeometry, Color, CubeTexture, Float32BufferAttribute, Group, LineBasicMaterial, LineSegments, Mesh, MeshLambertMaterial, Raycaster, SphereGeometry } from "three";
import { classColor } from "./palette.js";

export const SPHERE = new SphereGeometry(1, 32, 20);
export const RINGS = rings();
const UNLIT = { envMap: new CubeTexture(), reflectivity: 0 }; // by the light around content, which is there only with anchors

// Three great circles, which show the axes.
function rings() {
  const points = [];
  const steps = 64;
  for (let axis = 0; axis < 3; ++axis)
    for (let i = 0; i < steps; ++i)
      for (const angle of [(2 * Math.PI * i) / steps, (2 * Math.PI * (i + 1)) / steps]) {
        const point = [0, 0, 0];
        point[(axis + 1) % 3] = Math.cos(angle);
        point[(axis + 2) % 3] = Math.sin(angle);
        points.push(...point);
      }
  return new BufferGeometry().setAttribute("position", new Float32BufferAttribute(points, 3));
}

/** Objects as ellipsoids; candidates, which the map has not accepted yet, as rings alone. */
export class ObjectsLayer {
  /** @type {Map<number, Group>} */ shapes = new Map(); // by id
  /** @type {number | null} */ selected = null;

  /** @param {import("./map_view.js").MapView} view */
  constructor(view) {
    this.view = view;
    this.group = new Group();
    this.candidates = new Group();
    this.candidates.visible = false;
    view.world.add(this.group, this.candidates);
    this.raycaster = new Raycaster();
  }

  get count() {
    return this.group.visible ? this.group.children.length : 0;
  }

  update(part) {
    if (part !== "map" && part !== "restart") return;
    const { objects } = this.view.store;
    for (const [id, shape] of this.shapes)
      if (objects.get(id) !== shape.userData.object) {
        shape.removeFromParent();
        for (const child of shape.children) materialOf(child).dispose();
        this.shapes.delete(id);
      }
    for (const [id, object] of objects) if (!this.shapes.has(id)) this.shapes.set(id, this.build(object));
  }

  /** @param {import("./messages").MapObject} object */
  build(object) {
    const shape = new Group();
    const color = new Color(classColor(object.category_id));
    const selected = object.id === this.selected;
    if (object.mapped) {
      const body = new Mesh(SPHERE, new MeshLambertMaterial({ color, transparent: true, depthWrite: false, ...UNLIT }));
      body.userData.id = object.id;
      shape.add(body);
    }
    shape.add(new LineSegments(RINGS, new LineBasicMaterial({ color, transparent: true })));
    shape.position.set(...object.center);
    shape.quaternion.set(...object.rotation);
    shape.scale.set(...object.half_axes);
    shape.userData.object = object;
    this.emphasize(shape, selected);
    (object.mapped ? this.group : this.candidates).add(shape);
    shape.updateMatrixWorld(true);
    return shape;
  }

  emphasize(shape, selected) {
    for (const child of shape.children) materialOf(child).opacity = child instanceof Mesh ? (selected ? 0.55 : 0.26) : selected ? 1 : 0.7;
  }

  select(id) {
    this.selected = id;
    for (const [other, shape] of this.shapes) this.emphasize(shape, other === id);
    this.view.invalidate();
  }

  // The smallest ellipsoid under the pointer: who clicks on a cup on a table means the cup.
  pick(at) {
    if (!this.group.visible) return null;
    this.raycaster.setFromCamera(at, this.view.camera);
    const bodies = this.group.children.map((shape) => shape.children[0]);
    const size = (hit) => hit.object.parent.userData.object.half_axes.reduce((a, b) => a * b, 1);
    const hits = this.raycaster.intersectObjects(bodies, false).sort((a, b) => size(a) - size(b));
    return hits.length > 0 ? hits[0].object.userData.id : null;
  }

  // Where the pointer meets the nearest ellipsoid, in the map.
  surface(at) {
    if (!this.group.visible) return null;
    this.raycaster.setFromCamera(at, this.view.camera);
    const hit = this.raycaster.intersectObjects(this.group.children.map((shape) => shape.children[0]), false)[0];
    return hit ? this.view.world.worldToLocal(hit.point.clone()) : null;
  }

  setVisible(on) {
    this.group.visible = on;
  }
}

const materialOf = (shape) => /** @type {import("three").Material} */ (shape.material);
