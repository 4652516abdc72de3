import { BufferAttribute, BufferGeometry, Points, PointsMaterial } from "three";
import { COLORS } from "./palette.js";

/** Landmarks, and on top of them those that the newest frame sees. */
export class PointsLayer {
  /** @param {import("./map_view.js").MapView} view */
  constructor(view) {
    this.view = view;
    this.points = new Points(new BufferGeometry(), new PointsMaterial({ size: 2.4, sizeAttenuation: false, vertexColors: true }));
    this.matched = new Points(new BufferGeometry(), new PointsMaterial({ size: 4, sizeAttenuation: false, color: COLORS.matched }));
    for (const layer of [this.points, this.matched]) {
      layer.frustumCulled = false;
      view.world.add(layer);
    }
  }

  get count() {
    return this.points.visible ? this.points.geometry.drawRange.count : 0;
  }

  update(part) {
    const { landmarks } = this.view.store;
    if (part === "map" || part === "restart") this.upload(landmarks);
    if (part === "frame" || part === "map" || part === "restart") this.showMatched(landmarks);
  }

  upload(landmarks) {
    const { geometry } = this.points;
    const [low, high] = landmarks.dirty;
    if (geometry.attributes.position?.array !== landmarks.positions) {
      geometry.dispose();
      geometry.setAttribute("position", new BufferAttribute(landmarks.positions, 3));
      geometry.setAttribute("color", new BufferAttribute(landmarks.colors, 3, true));
    } else if (high >= low) {
      for (const name of ["position", "color"]) {
        const attribute = /** @type {BufferAttribute} */ (geometry.attributes[name]);
        attribute.addUpdateRange(3 * low, 3 * (high - low + 1));
        attribute.needsUpdate = true;
      }
    }
    landmarks.dirty = [Infinity, -1];
    geometry.setDrawRange(0, landmarks.count);
  }

  showMatched(landmarks) {
    const { frame, status } = this.view.store;
    const positions = [];
    if (frame && status.live)
      for (const id of frame.landmarks) {
        const place = landmarks.place.get(id);
        if (place !== undefined) positions.push(...landmarks.positions.subarray(3 * place, 3 * place + 3));
      }
    const { geometry } = this.matched;
    const held = geometry.attributes.position;
    if (!held || held.array.length < positions.length) {
      geometry.dispose();
      geometry.setAttribute("position", new BufferAttribute(new Float32Array(Math.max(3000, 2 * positions.length)), 3));
    }
    geometry.attributes.position.array.set(positions);
    geometry.attributes.position.needsUpdate = true;
    geometry.setDrawRange(0, positions.length / 3);
  }

  setVisible(on) {
    this.points.visible = this.matched.visible = on;
  }
}
