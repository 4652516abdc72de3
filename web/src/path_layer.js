import { LineSegments2 } from "three/examples/jsm/lines/LineSegments2.js";
import { LineSegmentsGeometry } from "three/examples/jsm/lines/LineSegmentsGeometry.js";
import { LineMaterial } from "three/examples/jsm/lines/LineMaterial.js";
import { Color } from "three";
import { COLORS, RECORDING_COLORS } from "./palette.js";

/** The trajectory, where it is uncertain in another colour, and the true one. */
export class PathLayer {
  /** @param {import("./map_view.js").MapView} view */
  constructor(view) {
    this.view = view;
    this.path = this.line("#ffffff", 2.2, 1);
    this.path.material.vertexColors = true;
    this.truth = this.line(COLORS.groundtruth, 1.2, 0.55);
  }

  line(color, width, opacity) {
    const line = new LineSegments2(new LineSegmentsGeometry(), new LineMaterial({ color, linewidth: width, transparent: opacity < 1, opacity }));
    line.frustumCulled = false;
    line.visible = false;
    line.userData = { wanted: true, hasContent: false };
    this.view.world.add(line);
    return line;
  }

  update(part) {
    if (!["path", "notes", "restart", "status"].includes(part)) return;
    const { store } = this.view;
    const { path, groundtruth } = store;
    const uncertain = new Set(store.notes.filter((note) => note.uncertain).map((note) => note.frame));
    const segments = [];
    const colors = [];
    for (let i = 1; i < path.size; ++i) {
      const gap = path.frames[i] - path.frames[i - 1];
      if (gap > 10 || gap <= 0 || !Number.isFinite(path.poses[7 * i + 4]) || !Number.isFinite(path.poses[7 * i - 3])) continue;
      const recording = store.recordingOf(path.frames[i]);
      if (recording !== store.recordingOf(path.frames[i - 1])) continue;
      const { r, g, b } = new Color(uncertain.has(path.frames[i]) ? COLORS.uncertain : RECORDING_COLORS[recording % RECORDING_COLORS.length]);
      colors.push(r, g, b, r, g, b);
      segments.push(...path.poses.subarray(7 * i - 3, 7 * i), ...path.poses.subarray(7 * i + 4, 7 * i + 7));
    }
    this.replace(this.path, segments, colors);
    const truth = [];
    for (let i = 3; i < groundtruth.length; i += 3) truth.push(...groundtruth.subarray(i - 3, i + 3));
    this.replace(this.truth, truth);
  }

  replace(line, segments, colors = []) {
    line.geometry.dispose();
    line.geometry = new LineSegmentsGeometry();
    if (segments.length > 0) line.geometry.setPositions(segments);
    if (colors.length > 0) line.geometry.setColors(colors);
    this.want(line, line.userData.wanted, segments.length > 0);
  }

  setVisible(on) {
    this.want(this.path, on);
  }

  setTruthVisible(on) {
    this.want(this.truth, on);
    this.view.invalidate();
  }

  want(line, wanted, hasContent = line.userData.hasContent) {
    line.userData = { wanted, hasContent };
    line.visible = wanted && hasContent;
  }

  resize(width, height) {
    for (const line of [this.path, this.truth]) line.material.resolution.set(width, height);
  }
}
