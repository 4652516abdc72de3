// The map that the camera is in, as the layers of the AR scene read it (docs/service.md says how it comes).
import { Quaternion, Vector3 } from "three";

export const poseArray = ({ position, rotation }) => [...rotation, ...position];
const anchorOf = (anchor) => ({ ...anchor, pose: poseArray(anchor.pose) });
const objectOf = ({ ellipsoid, ...object }) => ({ ...object, ...ellipsoid, category_id: object.category, mapped: true });

export class MapState extends EventTarget {
  constructor() {
    super();
    this.upright = new Quaternion();
    this.clear();
  }

  clear() {
    Object.assign(this, { name: "", mayEdit: false, models: [], anchors: [], objects: new Map(), unit: "units" });
    this.upright.identity();
  }

  mappedObjects() {
    return [...this.objects.values()];
  }

  // `hello`, or `map` where the map was replaced.
  enter({ map, may_write, models, anchors = [], objects = [], up, is_metric }) {
    this.name = map ?? this.name;
    this.mayEdit = may_write ?? this.mayEdit;
    this.models = models ?? this.models;
    this.anchors = anchors.map(anchorOf);
    this.objects = new Map(objects.map((object) => [object.id, objectOf(object)]));
    this.unit = is_metric ? "m" : "units";
    this.upright.setFromUnitVectors(new Vector3(...(up ?? [0, 1, 0])).normalize(), new Vector3(0, 1, 0));
    this.tell("hello", "restart", "map", "anchors");
  }

  // What others and this page have changed.
  edit({ anchors = [], removed = [] }) {
    const now = new Map(this.anchors.map((anchor) => [anchor.name, anchor]));
    for (const name of removed) now.delete(name);
    for (const anchor of anchors) now.set(anchor.name, anchorOf(anchor));
    this.anchors = [...now.values()];
    this.tell("anchors");
  }

  tell(...parts) {
    for (const part of parts) this.dispatchEvent(new Event(part));
  }
}
