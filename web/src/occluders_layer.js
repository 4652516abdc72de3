import { Group, Mesh, MeshBasicMaterial, Quaternion, Vector3 } from "three";
import { LineSegments2 } from "three/examples/jsm/lines/LineSegments2.js";
import { LineSegmentsGeometry } from "three/examples/jsm/lines/LineSegmentsGeometry.js";
import { LineMaterial } from "three/examples/jsm/lines/LineMaterial.js";
import { RINGS, SPHERE } from "./objects_layer.js";
import { classColor } from "./palette.js";

const DEPTH_ONLY = new MeshBasicMaterial({ colorWrite: false });
const LINES = new LineSegmentsGeometry().setPositions(RINGS.attributes.position.array);

// The mapped objects, to the eye as clear as air: what is behind them is not drawn.
export class OccludersLayer {
  constructor(view) {
    this.view = view;
    this.bodies = new Group();
    this.outlines = new Group();
    this.outlines.visible = false;
    view.world.add(this.bodies, this.outlines);
    this.shapes = new Map(); // by object: what it was made of, body, outline
    this.occluding = true;
    this.isStale = false;
    this.ray = { from: new Vector3(), to: new Vector3() };
  }

  update(part) {
    if (part === "map" || part === "restart" || part === "anchors") this.isStale = true;
  }

  // Before it is drawn: while nobody looks there is nothing to do.
  arrange() {
    if (!this.isStale) return;
    this.isStale = false;
    this.fit();
    this.letStand();
  }

  // To the objects of the map: those that changed are made anew.
  fit() {
    const { objects } = this.view.store;
    for (const [id, { object, body, outline }] of this.shapes)
      if (objects.get(id) !== object) {
        body.removeFromParent();
        outline.removeFromParent();
        outline.material.dispose();
        this.shapes.delete(id);
      }
    for (const object of this.view.store.mappedObjects()) if (!this.shapes.has(object.id)) this.shapes.set(object.id, this.build(object));
  }

  build(object) {
    const body = new Mesh(SPHERE, DEPTH_ONLY);
    body.renderOrder = -1; // before all content
    const outline = new LineSegments2(LINES, new LineMaterial({ color: classColor(object.category_id), linewidth: 1.5 }));
    for (const shape of [body, outline]) {
      shape.position.set(...object.center);
      shape.quaternion.set(...object.rotation);
      shape.scale.set(...object.half_axes);
    }
    this.bodies.add(body);
    this.outlines.add(outline);
    body.updateMatrixWorld(true);
    body.userData.inverse = body.matrix.clone().invert(); // to the unit sphere
    return { object, body, outline };
  }

  // What stands inside an ellipsoid (on a table: its ellipsoid bulges over the board) is to be seen: that one hides nothing.
  letStand() {
    const feet = this.view.store.anchors.map(({ pose, size }) =>
      new Vector3(0, 0.05 * size, 0).applyQuaternion(new Quaternion(...pose.slice(0, 4))).add(new Vector3(...pose.slice(4))));
    const inside = new Vector3();
    for (const body of this.bodies.children)
      body.visible = this.occluding && !feet.some((foot) => inside.copy(foot).applyMatrix4(body.userData.inverse).lengthSq() < 1);
  }

  // Whether one that hides lies on the way from one point of the map to another.
  isBetween(eye, point) {
    return this.bodies.children.some((body) => {
      const t = body.visible ? this.meet(body, eye, point) : null;
      return t !== null && t < 1;
    });
  }

  // The smallest object that a ray of the map meets: a cup on a table is meant, not the table. Null where there is none.
  objectOn(origin, direction) {
    const point = origin.clone().add(direction);
    const met = [...this.shapes.values()].filter(({ body }) => this.meet(body, origin, point) !== null);
    const volume = ({ object }) => object.half_axes.reduce((a, b) => a * b, 1);
    return met.sort((a, b) => volume(a) - volume(b))[0]?.object.id ?? null;
  }

  // How far along the way from `eye` to `point` (there: 1) the line enters a body; null where it does not.
  meet(body, eye, point) {
    const { from, to } = this.ray;
    from.copy(eye).applyMatrix4(body.userData.inverse);
    to.copy(point).applyMatrix4(body.userData.inverse).sub(from);
    // |from + t to| = 1 at its first t
    const [a, b, c] = [to.lengthSq(), from.dot(to), from.lengthSq() - 1];
    const root = b * b - a * c;
    const t = root < 0 ? -1 : (-b - Math.sqrt(root)) / a;
    return t > 0 ? t : null;
  }

  // Those that hide something, for a raycaster.
  hiding() {
    return this.bodies.children.filter((body) => body.visible);
  }

  setOccluding(on) {
    this.occluding = on;
    this.isStale = true;
  }
}
