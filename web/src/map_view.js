import { AmbientLight, Box3, Color, DirectionalLight, Group, GridHelper, PerspectiveCamera, Quaternion, Raycaster, Scene, Sphere, Vector3, WebGLRenderer } from "three";
import { OrbitControls } from "three/examples/jsm/controls/OrbitControls.js";
import { AnchorsLayer } from "./anchors_layer.js";
import { CameraLayer } from "./camera_layer.js";
import { lightAround } from "./content.js";
import { KeyframesLayer } from "./keyframes_layer.js";
import { LabelsLayer } from "./labels_layer.js";
import { MeasureTool } from "./measure.js";
import { ObjectsLayer } from "./objects_layer.js";
import { onceAFrame } from "./batched.js";
import { PathLayer } from "./path_layer.js";
import { PointsLayer } from "./points_layer.js";

const DOWN_IN_CAMERA = new Vector3(0, 1, 0);

/** The map in space. Everything is in `world`, which turns the map's up to +y. */
export class MapView {
  /** @type {((id: number | null) => void) | undefined} */ onPick;
  /** @type {((name: string | null) => void) | undefined} */ onPickAnchor;
  /** @type {GridHelper | null} */ grid = null;
  gridKey = "";
  isGridVisible = true;
  isMoved = false; // by the user
  /** @type {{ center: Vector3, radius: number } | null} */ fitted = null; // what the view was fitted to
  /** @type {number | undefined} */ floor; // the height of the lowest landmarks
  /** @type {number[] | null} */ pressed = null; // where the pointer went down

  /** @param {HTMLElement} stage  @param {import("./store.js").Store} store  @param {import("./content.js").Content} content */
  constructor(stage, store, content) {
    this.store = store;
    this.element = stage;
    this.invalidate = onceAFrame(() => this.draw());
    this.renderer = new WebGLRenderer({ antialias: true, preserveDrawingBuffer: true });
    this.renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
    this.legend = Object.assign(document.createElement("div"), { id: "legend" });
    stage.prepend(this.renderer.domElement, this.legend);
    this.scene = new Scene();
    this.scene.background = new Color("#0e1216");
    this.camera = new PerspectiveCamera(50, 1, 0.01, 100);
    this.controls = new OrbitControls(this.camera, this.renderer.domElement);
    this.controls.zoomToCursor = true;
    this.controls.addEventListener("change", () => this.invalidate());
    this.controls.addEventListener("start", () => (this.isMoved = true));
    this.scene.add(new AmbientLight("#ffffff", 1.6));
    const sun = new DirectionalLight("#ffffff", 1.8);
    sun.position.set(1, 2, 1.5);
    this.scene.add(sun);
    this.world = new Group();
    this.scene.add(this.world);
    this.radius = 1;
    this.center = new Vector3();
    this.follow = false;
    this.raycaster = new Raycaster();
    this.layers = {
      landmarks: new PointsLayer(this),
      objects: new ObjectsLayer(this),
      labels: new LabelsLayer(this),
      anchors: new AnchorsLayer(this, content),
      keyframes: new KeyframesLayer(this),
      path: new PathLayer(this),
      camera: new CameraLayer(this),
    };
    this.measure = new MeasureTool(this);
    for (const part of ["map", "path", "notes", "frame", "anchors", "restart", "status"]) store.addEventListener(part, () => this.update(part));
    new ResizeObserver(() => this.resize()).observe(stage);
    this.renderer.domElement.addEventListener("pointerdown", (event) => (this.pressed = [event.clientX, event.clientY]));
    this.renderer.domElement.addEventListener("pointerup", (event) => this.click(event));
    this.resize();
  }

  update(part) {
    if (part === "restart") {
      this.isMoved = false;
      this.fitted = null;
    }
    if (part === "map" || part === "restart") {
      this.turnUpright();
      this.measureExtent();
    }
    for (const layer of Object.values(this.layers)) layer.update(part);
    if (!this.isMoved && !this.follow && part === "map" && this.grew()) this.fit();
    if (this.follow && part === "frame") this.followCamera();
    this.invalidate();
  }

  // The whole map stays in view until the user moves it.
  grew() {
    if (!this.fitted) return true;
    const { center, radius } = this.fitted;
    return radius < 0.85 * this.radius || center.distanceTo(this.center) > 0.3 * radius;
  }

  turnUpright() {
    const { map, keyframes } = this.store;
    const up = map.up ? new Vector3(...map.up) : this.meanUp();
    if (!up || keyframes.size === 0) return;
    const turn = new Quaternion().setFromUnitVectors(up.clone().normalize(), new Vector3(0, 1, 0));
    if (!map.up && this.fitted && turn.angleTo(this.world.quaternion) < 0.2) return;
    this.world.quaternion.copy(turn);
    this.world.updateMatrixWorld(true);
  }

  meanUp() {
    const sum = new Vector3();
    for (const { pose } of this.store.keyframes.values()) sum.sub(DOWN_IN_CAMERA.clone().applyQuaternion(new Quaternion().fromArray(pose)));
    return sum.lengthSq() > 0 ? sum.normalize() : null;
  }

  // Measures the part of the map to be in view: cameras, objects, and the landmarks without the outer ones, which are the background.
  measureExtent() {
    const { landmarks, keyframes, objects } = this.store;
    const points = [];
    for (const { pose } of keyframes.values()) points.push(new Vector3(pose[4], pose[5], pose[6]));
    for (const object of objects.values()) if (object.mapped) points.push(new Vector3(...object.center));
    const step = Math.max(1, Math.floor(landmarks.count / 2000));
    const cloud = [];
    for (let i = 0; i < landmarks.count; i += step) cloud.push(new Vector3().fromArray(landmarks.positions, 3 * i));
    if (points.length + cloud.length === 0) return;
    const quantile = (values, share) => values[Math.floor(share * (values.length - 1))];
    const box = new Box3();
    for (const point of points) box.expandByPoint(point.applyQuaternion(this.world.quaternion));
    if (cloud.length > 0) {
      for (const point of cloud) point.applyQuaternion(this.world.quaternion);
      const low = new Vector3();
      const high = new Vector3();
      const share = objects.size > 2 ? 0.25 : 0.1;
      for (const axis of ["x", "y", "z"]) {
        const values = cloud.map((p) => p[axis]).sort((a, b) => a - b);
        low[axis] = quantile(values, share);
        high[axis] = quantile(values, 1 - share);
        if (axis === "y") this.floor = quantile(values, 0.02);
      }
      box.expandByPoint(low).expandByPoint(high);
    }
    const sphere = box.getBoundingSphere(new Sphere());
    this.center.copy(sphere.center);
    this.radius = Math.max(sphere.radius, 1e-6);
    this.placeGrid(box);
  }

  placeGrid(box) {
    const step = 10 ** Math.round(Math.log10(this.radius / 3));
    const cells = 2 * Math.ceil((1.3 * this.radius) / step);
    const key = `${step} ${cells}`;
    if (this.gridKey !== key) {
      this.grid?.removeFromParent();
      this.grid?.dispose();
      this.grid = new GridHelper(cells * step, cells, "#2c3742", "#1e2730");
      this.gridKey = key;
      this.grid.visible = this.isGridVisible;
      this.scene.add(this.grid);
      this.legend.textContent = `grid ${Number(step.toPrecision(1))} ${this.store.map.metric ? "m" : step === 1 ? "unit" : "units"}`;
    }
    this.grid?.position.set(Math.round(this.center.x / step) * step, Math.min(box.min.y, Math.max(this.floor ?? box.min.y, box.min.y - 0.5 * this.radius)), Math.round(this.center.z / step) * step);
  }

  // Looks at the whole map from behind the cameras, above them.
  fit() {
    this.follow = this.isMoved = false;
    const cameras = new Vector3();
    for (const { pose } of this.store.keyframes.values()) cameras.add(new Vector3(pose[4], pose[5], pose[6]));
    cameras.divideScalar(Math.max(1, this.store.keyframes.size)).applyQuaternion(this.world.quaternion);
    const direction = cameras.sub(this.center).setY(0);
    if (direction.lengthSq() < 1e-12) direction.set(0, 0, 1);
    direction.normalize().applyAxisAngle(new Vector3(0, 1, 0), 0.45).setY(0.65).normalize();
    const distance = (0.74 * this.radius) / Math.sin((this.camera.fov * Math.PI) / 360);
    this.look(direction.multiplyScalar(distance).add(this.center), this.center);
    this.fitted = { center: this.center.clone(), radius: this.radius };
  }

  top() {
    const distance = this.radius / Math.sin((this.camera.fov * Math.PI) / 360);
    this.follow = false;
    this.isMoved = true;
    this.look(new Vector3(0, distance, 1e-3 * distance).add(this.center), this.center);
  }

  look(from, at) {
    this.camera.position.copy(from);
    this.controls.target.copy(at);
    this.camera.near = this.radius / 500;
    this.camera.far = this.radius * 50;
    this.camera.updateProjectionMatrix();
    this.controls.update();
    this.invalidate();
  }

  // Looks from behind the camera, a little above it, to where it looks.
  followCamera() {
    const pose = this.layers.camera.pose();
    if (!pose) return;
    const turn = this.world.quaternion.clone().multiply(new Quaternion().fromArray(pose));
    const at = new Vector3(pose[4], pose[5], pose[6]).applyQuaternion(this.world.quaternion);
    const forward = new Vector3(0, 0, 1).applyQuaternion(turn);
    const from = at.clone().addScaledVector(forward, -0.35 * this.radius).add(new Vector3(0, 0.16 * this.radius, 0));
    const ease = this.isFollowing ? 0.25 : 1;
    this.isFollowing = true;
    this.isMoved = true;
    this.look(this.camera.position.clone().lerp(from, ease), this.controls.target.clone().lerp(at.addScaledVector(forward, 0.4 * this.radius), ease));
  }

  setFollow(on) {
    this.follow = on;
    this.isFollowing = false;
    if (on) this.followCamera();
  }

  setGridVisible(on) {
    this.isGridVisible = on;
    if (this.grid) this.grid.visible = on;
  }

  // Canvas coordinates of a pointer event, -1 to 1.
  pointer(event) {
    const rect = this.renderer.domElement.getBoundingClientRect();
    return { x: (2 * (event.clientX - rect.left)) / rect.width - 1, y: 1 - (2 * (event.clientY - rect.top)) / rect.height, rect };
  }

  click(event) {
    if (!this.pressed || Math.hypot(event.clientX - this.pressed[0], event.clientY - this.pressed[1]) > 4) return;
    const at = this.pointer(event);
    if (this.measure.isOn) this.measure.pick(at);
    else this.pick(at);
    this.invalidate();
  }

  // Content has precedence over ellipsoids, through which one sees.
  pick(at) {
    this.raycaster.setFromCamera(at, this.camera);
    const anchor = this.layers.anchors.pick(this.raycaster);
    this.onPickAnchor?.(anchor);
    if (anchor === null) this.onPick?.(this.layers.objects.pick(at));
  }

  // For a layer's names: nothing hides content in this view.
  isHidden() {
    return false;
  }

  /** Where a point of the map is on the element; null behind the camera. @param {Vector3} point */
  toPage(point) {
    const p = point.clone().applyQuaternion(this.world.quaternion).project(this.camera);
    if (p.z > 1 || p.z < -1) return null;
    return { x: ((p.x + 1) / 2) * this.element.clientWidth, y: ((1 - p.y) / 2) * this.element.clientHeight, depth: p.z };
  }

  resize() {
    const { clientWidth: width, clientHeight: height } = this.element;
    if (width === 0 || height === 0) return;
    this.renderer.setSize(width, height);
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
    this.layers.path.resize(width, height);
    this.measure.resize(width, height);
    this.invalidate();
  }

  draw() {
    if (!this.element.offsetParent && this.element.clientWidth === 0) return;
    if (this.store.anchors.length > 0 && !this.scene.environment) lightAround(this.scene, this.renderer, 0.2);
    this.renderer.render(this.scene, this.camera);
    this.layers.labels.place(this.layers.anchors.placeLabels());
    this.measure.place();
  }
}
