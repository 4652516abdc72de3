import { LineSegments2 } from "three/examples/jsm/lines/LineSegments2.js";
import { LineSegmentsGeometry } from "three/examples/jsm/lines/LineSegmentsGeometry.js";
import { LineMaterial } from "three/examples/jsm/lines/LineMaterial.js";
import { COLORS } from "./palette.js";

/** The trajectory, where it is uncertain in another colour, and the true one. */
export class PathLayer {
  /** @param {import("./map_view.js").MapView} view */
  constructor(view) {
    this.view = view;
    this.path = this.line(COLORS.path, 2.2, 1);
    this.uncertain = this.line(COLORS.uncertain, 2.6, 1);
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
    if (part !== "path" && part !== "notes" && part !== "restart") return;
    const { path, groundtruth, notes } = this.view.store;
    const doubtful = new Set(notes.filter((note) => note.uncertain).map((note) => note.frame));
    const segments = [], uncertain = [];
    for (let i = 1; i < path.size; ++i) {
      const gap = path.frames[i] - path.frames[i - 1];
      if (gap > 10 || gap <= 0 || !Number.isFinite(path.poses[7 * i + 4]) || !Number.isFinite(path.poses[7 * i - 3])) continue;
      (doubtful.has(path.frames[i]) ? uncertain : segments).push(...path.poses.subarray(7 * i - 3, 7 * i), ...path.poses.subarray(7 * i + 4, 7 * i + 7));
    }
    this.replace(this.path, segments);
    this.replace(this.uncertain, uncertain);
    const truth = [];
    for (let i = 3; i < groundtruth.length; i += 3) truth.push(...groundtruth.subarray(i - 3, i + 3));
    this.replace(this.truth, truth);
  }

  replace(line, segments) {
    line.geometry.dispose();
    line.geometry = new LineSegmentsGeometry();
    if (segments.length > 0) line.geometry.setPositions(segments);
    this.want(line, line.userData.wanted, segments.length > 0);
  }

  setVisible(on) {
    for (const line of [this.path, this.uncertain]) this.want(line, on);
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
    for (const line of [this.path, this.uncertain, this.truth]) line.material.resolution.set(width, height);
  }
}
