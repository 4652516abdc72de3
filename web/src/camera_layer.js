import { BufferAttribute, BufferGeometry, DoubleSide, Group, LineBasicMaterial, LineSegments, Mesh, MeshBasicMaterial, SRGBColorSpace, SphereGeometry, Texture } from "three";
import { DEFAULT_CAMERA, frustumCorners, frustumLines } from "./frustum.js";
import { contextOf } from "./image_area.js";
import { COLORS, STATE_COLORS } from "./palette.js";

const SIGMAS = 3; // of its position, which are drawn

/** The camera, where it is now or where the timeline points, with its image and how uncertain its position is. */
export class CameraLayer {
  canvas = document.createElement("canvas");
  /** @type {number | null} */ place = null; // of the path, chosen on the timeline

  /** @param {import("./map_view.js").MapView} view */
  constructor(view) {
    this.view = view;
    this.group = new Group();
    this.lines = new LineSegments(new BufferGeometry(), new LineBasicMaterial());
    this.image = new Mesh(new BufferGeometry(), new MeshBasicMaterial({ side: DoubleSide, transparent: true, opacity: 0.92 }));
    this.image.geometry.setAttribute("uv", new BufferAttribute(new Float32Array([0, 1, 1, 1, 1, 0, 0, 0]), 2));
    this.image.geometry.setIndex([0, 3, 1, 1, 3, 2]);
    this.spread = new Mesh(new SphereGeometry(1, 24, 16), new MeshBasicMaterial({ transparent: true, opacity: 0.25, depthWrite: false }));
    for (const part of [this.lines, this.image, this.spread]) {
      part.frustumCulled = false;
      this.group.add(part);
    }
    this.wanted = true;
    this.group.visible = false;
    view.world.add(this.group);
  }

  frame() {
    return this.view.store.chosen ?? this.view.store.frame;
  }

  pose() {
    const { path } = this.view.store;
    if (this.place !== null && this.place < path.size) return path.poses.subarray(7 * this.place, 7 * this.place + 7);
    return this.frame()?.pose ?? null;
  }

  /** Shows a place of the path; with null the newest frame, or the chosen keyframe. @param {number | null} place */
  goTo(place) {
    this.place = place;
    this.update("frame");
  }

  update(part) {
    if (part === "restart" || this.view.store.status.live) this.place = null;
    if (part !== "frame" && part !== "path" && part !== "restart") return;
    const pose = this.pose();
    this.group.visible = this.wanted && pose !== null && Number.isFinite(pose[4]);
    if (!this.group.visible || !pose) return;
    const frame = this.frame();
    const camera = frame?.camera ?? DEFAULT_CAMERA;
    const depth = 0.11 * this.view.radius;
    this.lines.geometry.setAttribute("position", new BufferAttribute(new Float32Array(frustumLines(camera, depth).flat()), 3));
    this.image.geometry.setAttribute("position", new BufferAttribute(new Float32Array(frustumCorners(camera, depth).flat()), 3));
    this.lines.material.color.set(STATE_COLORS[frame?.state ?? "tracking"]);
    this.group.quaternion.set(pose[0], pose[1], pose[2], pose[3]);
    this.group.position.set(pose[4], pose[5], pose[6]);
    this.showSpread(this.place === null ? frame : null);
    this.showImage(this.place === null ? frame?.bitmap : null);
  }

  showSpread(frame) {
    const spread = frame?.spread;
    this.spread.visible = Boolean(spread);
    if (!spread) return;
    this.spread.scale.fromArray(spread.half_axes.map((x) => Math.max(SIGMAS * x, 1e-6 * this.view.radius)));
    this.spread.quaternion.fromArray(spread.rotation);
    this.spread.material.color.set(frame.uncertain ? COLORS.uncertain : STATE_COLORS[frame.state]);
  }

  showImage(bitmap) {
    this.image.visible = Boolean(bitmap);
    if (!bitmap || this.image.userData.bitmap === bitmap) return;
    this.image.userData.bitmap = bitmap;
    this.image.material.map?.dispose();
    // A copy, since the bitmap is closed when the next one comes.
    Object.assign(this.canvas, { width: bitmap.width, height: bitmap.height });
    contextOf(this.canvas).drawImage(bitmap, 0, 0);
    const texture = new Texture(this.canvas);
    texture.colorSpace = SRGBColorSpace;
    texture.needsUpdate = true;
    this.image.material.map = texture;
    this.image.material.needsUpdate = true;
  }

  setVisible(on) {
    this.wanted = on;
    this.update("frame");
  }
}
