import { Group, Mesh, MeshBasicMaterial, Quaternion, Vector3 } from "three";
import { LineSegments2 } from "three/examples/jsm/lines/LineSegments2.js";
import { LineSegmentsGeometry } from "three/examples/jsm/lines/LineSegmentsGeometry.js";
import { LineMaterial } from "three/examples/jsm/lines/LineMaterial.js";
import { RINGS, SPHERE } from "./objects_layer.js";
import { classColor } from "./palette.js";

const DEPTH_ONLY = new MeshBasicMaterial({ colorWrite: false });
const LINES = new LineSegmentsGeometry().setPositions(Array.from(RINGS.attributes.position.array));

/** @import { MapObject } from "./messages" */

/** The mapped objects, drawn into the depth buffer alone: they hide content behind them, and show the image. */
export class OccludersLayer {
  /** @type {Map<number, { object: MapObject, body: Mesh, outline: LineSegments2 }>} */ shapes = new Map(); // by id

  /** @param {Pick<import("./anchors_layer.js").Stage, "world" | "store">} view */
  constructor(view) {
    this.view = view;
    this.bodies = new Group();
    this.outlines = new Group();
    this.outlines.visible = false;
    view.world.add(this.bodies, this.outlines);
    this.occluding = true;
    this.isStale = false;
    this.ray = { from: new Vector3(), to: new Vector3() };
  }

  update(part) {
    if (part === "map" || part === "restart" || part === "anchors") this.isStale = true;
  }

  // To be called before drawing: the work is put off while the view is not shown.
  arrange() {
    if (!this.isStale) return;
    this.isStale = false;
    this.fit();
    this.letStand();
  }

  // Makes the shapes of objects that have changed anew.
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

  /** @param {MapObject} object */
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

  // An ellipsoid with an anchor in it hides nothing: that of a table, for example, bulges over what stands on the table.
  letStand() {
    const feet = this.view.store.anchors.map(({ pose, size }) =>
      new Vector3(0, 0.05 * size, 0).applyQuaternion(new Quaternion().fromArray(pose)).add(new Vector3().fromArray(pose, 4)));
    const inside = new Vector3();
    for (const body of this.bodies.children)
      body.visible = this.occluding && !feet.some((foot) => inside.copy(foot).applyMatrix4(body.userData.inverse).lengthSq() < 1);
  }

  // Whether an object that hides is between two points of the map.
  isBetween(eye, point) {
    return this.bodies.children.some((body) => {
      const t = body.visible ? this.meet(body, eye, point) : null;
      return t !== null && t < 1;
    });
  }

  // The smallest object that a ray in the map's frame meets (on a table: the cup); null where there is none.
  objectOn(origin, direction) {
    const point = origin.clone().add(direction);
    const met = [...this.shapes.values()].filter(({ body }) => this.meet(body, origin, point) !== null);
    const volume = ({ object }) => object.half_axes.reduce((a, b) => a * b, 1);
    return met.sort((a, b) => volume(a) - volume(b))[0]?.object.id ?? null;
  }

  // Where the line from `eye` (0) to `point` (1) enters a body; null where it does not.
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

  // The bodies that hide something, for a raycaster.
  hiding() {
    return this.bodies.children.filter((body) => body.visible);
  }

  setOccluding(on) {
    this.occluding = on;
    this.isStale = true;
  }
}
