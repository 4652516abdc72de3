// What the sample's clip shows, by its ground truth: for tests of where content is drawn.
import { readFileSync } from "node:fs";
import { join } from "node:path";
import { add, conjugate, dot, minus, normalized, rotate } from "../src/device/rigid.js";

const table = (file) => readFileSync(file, "utf8").split("\n").filter((line) => /^[\d.-]/.test(line)).map((line) => line.split(/\s+/).map(Number));
const poseOfRow = ([, x, y, z, ...rotation]) => ({ position: [x, y, z], rotation: normalized(rotation) });

// The largest eigenvector of a symmetric matrix whose largest eigenvalue is positive.
function eigenvector(matrix) {
  const shift = matrix.flat().reduce((sum, value) => sum + Math.abs(value), 0);
  let v = [0.5, 0.5, 0.5, 0.5];
  for (let i = 0; i < 2000; ++i) v = normalized(v.map((value, r) => shift * value + matrix[r].reduce((sum, each, c) => sum + each * v[c], 0)));
  return v;
}

// The similarity from points to others (Horn 1987), as a function of a point.
function similarity(from, to) {
  const mean = (points) => points.reduce((sum, p) => add(sum, p, 1 / points.length), [0, 0, 0]);
  const [a, b] = [mean(from), mean(to)];
  const s = [0, 1, 2].map((i) => [0, 1, 2].map((k) => from.reduce((sum, p, n) => sum + (p[i] - a[i]) * (to[n][k] - b[k]), 0)));
  const [[xx, xy, xz], [yx, yy, yz], [zx, zy, zz]] = s;
  const rotation = eigenvector([ // x y z w
    [xx - yy - zz, xy + yx, zx + xz, yz - zy], [xy + yx, yy - xx - zz, yz + zy, zx - xz],
    [zx + xz, yz + zy, zz - xx - yy, xy - yx], [yz - zy, zx - xz, xy - yx, xx + yy + zz]]);
  const spread = (points, middle) => points.reduce((sum, p) => sum + dot(minus(p, middle), minus(p, middle)), 0);
  const scale = Math.sqrt(spread(to, b) / spread(from, a));
  return (p) => add(b, rotate(rotation, minus(p, a)), scale);
}

/** The clip in a folder, and a run that made a map of it (its trajectory.txt): where points of the room are in the map, and in each image. */
export class ClipTruth {
  constructor(clip, trajectory) {
    this.poses = table(join(clip, "groundtruth.txt")).map(poseOfRow);
    this.objects = JSON.parse(readFileSync(join(clip, "objects_gt.json"), "utf8")).objects;
    this.inMap = table(trajectory).map((row) => ({ frame: Math.round(30 * row[0]), ...poseOfRow(row) }));
    this.toMap = similarity(this.inMap.map(({ frame }) => this.poses[frame].position), this.inMap.map(({ position }) => position));
  }

  /** Where a point is in the image of a camera of this pose; null where it is not in it. */
  static project({ position, rotation }, point) {
    const [x, y, z] = rotate(conjugate(rotation), minus(point, position));
    const pixel = [(525 * x) / z + 319.5, (525 * y) / z + 239.5];
    return z > 0 && pixel[0] > 0 && pixel[1] > 0 && pixel[0] < 639 && pixel[1] < 479 ? pixel : null;
  }

  /** How far content is drawn from the truth, in pixels, by a pose in the map: for each object's centre that image `frame` shows. */
  errors(frame, pose) {
    return this.objects.flatMap(({ center }) => {
      const expected = ClipTruth.project(this.poses[frame], center), drawn = expected && ClipTruth.project(pose, this.toMap(center));
      return drawn ? [Math.hypot(drawn[0] - expected[0], drawn[1] - expected[1])] : [];
    });
  }
}

