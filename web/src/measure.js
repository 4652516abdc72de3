import { Vector3 } from "three";
import { LineSegments2 } from "three/examples/jsm/lines/LineSegments2.js";
import { LineSegmentsGeometry } from "three/examples/jsm/lines/LineSegmentsGeometry.js";
import { LineMaterial } from "three/examples/jsm/lines/LineMaterial.js";
import { COLORS, short } from "./palette.js";

const REACH_PX = 10;

/** The distance between two clicked points: landmarks, or places on ellipsoids. */
export class MeasureTool {
  /** @type {Vector3[]} */ points = [];

  /** @param {import("./map_view.js").MapView} view */
  constructor(view) {
    this.view = view;
    this.isOn = false;
    this.line = new LineSegments2(new LineSegmentsGeometry(), new LineMaterial({ color: COLORS.measure, linewidth: 2.5, depthTest: false }));
    this.line.visible = false;
    this.line.frustumCulled = false;
    this.line.renderOrder = 1;
    view.world.add(this.line);
    this.label = document.createElement("div");
    this.label.className = "measure";
    this.label.hidden = true;
    this.marks = [0, 1].map(() => {
      const mark = document.createElement("div");
      mark.className = "mark";
      mark.hidden = true;
      return mark;
    });
    view.element.append(this.label, ...this.marks);
  }

  set(on) {
    this.isOn = on;
    this.points = [];
    this.view.element.classList.toggle("measuring", on);
    this.show();
  }

  get distance() {
    return this.points.length === 2 ? this.points[0].distanceTo(this.points[1]) : null;
  }

  pick(at) {
    const point = this.nearestLandmark(at) ?? this.view.layers.objects.surface(at);
    if (!point) return;
    if (this.points.length === 2) this.points = [];
    this.points.push(point);
    this.show();
  }

  // The landmark within reach of the pointer that is nearest to the viewer.
  nearestLandmark({ x, y, rect }) {
    if (!this.view.layers.landmarks.points.visible) return null;
    const { landmarks } = this.view.store;
    const matrix = this.view.camera.projectionMatrix.clone().multiply(this.view.camera.matrixWorldInverse).multiply(this.view.world.matrixWorld);
    const point = new Vector3();
    /** @type {{ depth: number, place: number } | null} */
    let best = null;
    for (let i = 0; i < landmarks.count; ++i) {
      point.fromArray(landmarks.positions, 3 * i).applyMatrix4(matrix);
      const away = Math.hypot(((point.x - x) * rect.width) / 2, ((point.y - y) * rect.height) / 2);
      if (point.z > -1 && point.z < 1 && away < REACH_PX && (!best || point.z < best.depth)) best = { depth: point.z, place: i };
    }
    return best && new Vector3().fromArray(landmarks.positions, 3 * best.place);
  }

  show() {
    const [a, b] = this.points;
    this.line.visible = Boolean(b);
    if (b) {
      this.line.geometry.dispose();
      this.line.geometry = new LineSegmentsGeometry().setPositions([...a.toArray(), ...b.toArray()]);
      this.label.textContent = `${short(a.distanceTo(b))} ${this.view.store.unit}`;
    }
    this.view.invalidate();
  }

  place() {
    this.marks.forEach((mark, i) => put(mark, this.points[i] && this.view.toPage(this.points[i])));
    const middle = this.points.length === 2 && this.points[0].clone().add(this.points[1]).multiplyScalar(0.5);
    put(this.label, middle && this.view.toPage(middle));
  }

  resize(width, height) {
    this.line.material.resolution.set(width, height);
  }
}

function put(element, at) {
  element.hidden = !at;
  if (at) element.style.transform = `translate(${at.x}px, ${at.y}px) translate(-50%, -50%)`;
}
