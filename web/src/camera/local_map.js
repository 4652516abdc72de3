/** @import { Anchor, Request, Triple } from "../messages" */
import { Quaternion, Vector3 } from "three";

const SIZE = 0.1; // of the depth
const TURN = new Vector3(0, 1, 0);

/** Content in the frame of the odometry, where there is no map: placed and edited as the service does it. */
export class LocalMap {
  count = 0;

  /** @param {import("./map_state.js").MapState} state  @param {import("../device/device_tracker.js").DeviceTracker} tracker */
  constructor(state, tracker) {
    this.state = state;
    this.tracker = tracker;
    state.enter({ type: "hello", map: "", may_write: true, models: [{ name: "pin", url: "" }] });
  }

  /** @param {Request} message */
  edit(message) {
    const { state } = this;
    if (message.type === "place") this.place(message);
    if (message.type !== "anchor") return;
    const { name, size, turn, rename, remove } = message;
    const edited = (/** @type {Anchor} */ anchor) => {
      const pose = [...new Quaternion().fromArray(anchor.pose).multiply(new Quaternion().setFromAxisAngle(TURN, turn ?? 0)).toArray(), ...anchor.pose.slice(4)];
      return { ...anchor, pose, size: size ?? anchor.size, name: rename && !state.anchors.some((other) => other.name === rename) ? rename : name };
    };
    state.anchors = state.anchors.flatMap((anchor) => (anchor.name !== name ? [anchor] : remove ? [] : [edited(anchor)]));
    state.tell("anchors");
  }

  // Where the ray meets what the odometry sees, upright, with its front towards the camera.
  place({ model, direction }) {
    const { state, tracker } = this;
    const { pose } = tracker.last ?? {};
    if (!pose) return;
    const toCamera = new Quaternion(...pose.rotation).invert();
    const ray = new Vector3(...direction).applyQuaternion(toCamera);
    const hit = ray.z > 0 ? tracker.hitAlong([ray.x / ray.z, ray.y / ray.z, 1]) : null;
    if (!hit) return;
    const up = new Vector3(...upOf(tracker));
    state.upright.setFromUnitVectors(up, new Vector3(0, 1, 0));
    const front = new Vector3(...pose.position).sub(new Vector3(...hit.position)).projectOnPlane(up).normalize();
    const turned = new Quaternion().setFromUnitVectors(new Vector3(0, 1, 0), up);
    const from = new Vector3(0, 0, 1).applyQuaternion(turned);
    const turn = new Quaternion().setFromAxisAngle(up, Math.atan2(from.clone().cross(front).dot(up), from.dot(front)));
    const size = SIZE * new Vector3(...pose.position).distanceTo(new Vector3(...hit.position));
    state.anchors = [...state.anchors, { name: `${model} ${++this.count}`, model, size, pose: [...turn.multiply(turned).toArray(), ...hit.position] }];
    state.tell("anchors");
  }

  // Returns whether there was something.
  clear() {
    const { state } = this;
    const was = state.anchors.length > 0;
    state.anchors = [];
    state.tell("anchors");
    return was;
  }
}

// Without a sensor of gravity the camera is taken to have been level when the run began.
/** @returns {Triple} */
const upOf = ({ up }) => up ?? [0, -1, 0];
