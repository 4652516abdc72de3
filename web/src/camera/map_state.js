/** @import { Anchor, AnchorChanges, MapMessage, MapObject, Model, WireObject, WirePose } from "../messages" */
import { Quaternion, Vector3 } from "three";
import { editedAnchors } from "../edited_anchors.js";

/** @param {WirePose} pose  @returns {number[]} */
export const poseArray = ({ position, rotation }) => [...rotation, ...position];
/** @returns {Anchor} */
const anchorOf = (anchor) => ({ ...anchor, pose: poseArray(anchor.pose) });
/** @param {WireObject} object  @returns {MapObject} */
const objectOf = ({ ellipsoid, name = "", ...object }) => ({ ...object, name, ...ellipsoid, category_id: object.category, mapped: true });

/** The map that the camera is in, as the layers of the AR scene read it. An event of the name of each part that changed is dispatched. */
export class MapState extends EventTarget {
  name = "";
  mayEdit = false;
  /** @type {Model[]} */ models = [];
  /** @type {Anchor[]} */ anchors = [];
  /** @type {Map<number, MapObject>} */ objects = new Map();
  unit = "units";
  upright = new Quaternion(); // turns the map's up to +y

  clear() {
    Object.assign(this, { name: "", mayEdit: false, models: [], anchors: [], objects: new Map(), unit: "units" });
    this.upright.identity();
  }

  mappedObjects() {
    return [...this.objects.values()];
  }

  /** Takes a map over as it is when a connection begins, or when it was replaced. @param {MapMessage} message */
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

  /** Takes changes over, of this page or others. @param {AnchorChanges} message */
  edit({ anchors = [], removed = [] }) {
    this.anchors = editedAnchors(this.anchors, { anchors: anchors.map(anchorOf), removed });
    this.tell("anchors");
  }

  tell(...parts) {
    for (const part of parts) this.dispatchEvent(new Event(part));
  }
}
