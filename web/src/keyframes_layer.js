import { BufferAttribute, BufferGeometry, LineBasicMaterial, LineSegments, Quaternion, Vector3 } from "three";
import { DEFAULT_CAMERA, frustumLines } from "./frustum.js";
import { COLORS } from "./palette.js";

const MIN_SHARED = 100; // landmarks of an edge that is drawn; the strongest edge of a keyframe always is

/** Keyframes as frusta, and lines between those that see the same landmarks. */
export class KeyframesLayer {
  /** @param {import("./map_view.js").MapView} view */
  constructor(view) {
    this.view = view;
    this.frusta = new LineSegments(new BufferGeometry(), new LineBasicMaterial({ color: COLORS.keyframe, transparent: true, opacity: 0.75 }));
    this.edges = new LineSegments(new BufferGeometry(), new LineBasicMaterial({ color: COLORS.covisible, transparent: true, opacity: 0.3, depthWrite: false }));
    this.edges.visible = false;
    for (const lines of [this.frusta, this.edges]) {
      lines.frustumCulled = false;
      view.world.add(lines);
    }
  }

  get count() {
    return this.frusta.visible ? this.frusta.geometry.drawRange.count / 16 : 0;
  }

  update(part) {
    if (part !== "map" && part !== "restart") return;
    const { keyframes, frame } = this.view.store;
    const outline = frustumLines(frame?.camera ?? DEFAULT_CAMERA, 0.035 * this.view.radius);
    const frusta = new Float32Array(keyframes.size * 16 * 3);
    const edges = [];
    const point = new Vector3();
    const turn = new Quaternion();
    let at = 0;
    for (const { id, pose, edges: covisible } of keyframes.values()) {
      turn.set(pose[0], pose[1], pose[2], pose[3]);
      for (const corner of outline) {
        point.set(...corner).applyQuaternion(turn);
        frusta[at++] = point.x + pose[4];
        frusta[at++] = point.y + pose[5];
        frusta[at++] = point.z + pose[6];
      }
      for (let i = 0; i < covisible.length; i += 2) {
        const other = keyframes.get(covisible[i]);
        const isDrawn = other && (i === 0 || (covisible[i + 1] >= MIN_SHARED && covisible[i] < id));
        if (isDrawn) edges.push(...pose.subarray(4), ...other.pose.subarray(4));
      }
    }
    replace(this.frusta.geometry, frusta);
    replace(this.edges.geometry, new Float32Array(edges));
  }

  setVisible(on) {
    this.frusta.visible = on;
  }
}

function replace(geometry, positions) {
  geometry.dispose();
  geometry.setAttribute("position", new BufferAttribute(positions, 3));
  geometry.setDrawRange(0, positions.length / 3);
}
