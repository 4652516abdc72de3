import { Box3, BufferAttribute, ConeGeometry, Group, Mesh, MeshBasicMaterial, PMREMGenerator, RingGeometry, Vector3 } from "three";
import { RoomEnvironment } from "three/examples/jsm/environments/RoomEnvironment.js";
import { GLTFLoader } from "three/examples/jsm/loaders/GLTFLoader.js";
import { clone } from "three/examples/jsm/utils/SkeletonUtils.js";
import { COLORS } from "./palette.js";

const PIN = new ConeGeometry(0.22, 1, 24, 1, true).rotateX(Math.PI).translate(0, 0.5, 0);
const PIN_MATERIAL = new MeshBasicMaterial({ color: COLORS.anchor, transparent: true, opacity: 0.6 });
const PIN_SIDES = new Vector3(0.44, 1, 0.44);
const SHADOW = fadingDisc(0.5);
const SHADOW_MATERIAL = new MeshBasicMaterial({ vertexColors: true, transparent: true, depthWrite: false });

// Dark up to half its radius, nothing at the rim.
function fadingDisc(darkness) {
  const disc = new RingGeometry(0, 1, 48, 2).rotateX(-Math.PI / 2);
  const { position } = disc.attributes;
  const colors = new Float32Array(4 * position.count);
  for (let i = 0; i < position.count; ++i) colors[4 * i + 3] = darkness * Math.min(1, 2 - 2 * Math.hypot(position.getX(i), position.getZ(i)));
  return disc.setAttribute("color", new BufferAttribute(colors, 4));
}

// Light from all sides, without which metals are black.
export function lightAround(scene, renderer, intensity) {
  const generator = new PMREMGenerator(renderer);
  const room = new RoomEnvironment();
  scene.environment = generator.fromScene(room, 0.04).texture;
  scene.environmentIntensity = intensity;
  room.dispose();
  generator.dispose();
}

/** What stands on anchors: models from glTF files, scaled so that the longest side is 1, standing on the origin with y up. */
export class Content extends EventTarget {
  /** @typedef {{ loading?: Promise<any>, template?: Group, sides?: Vector3 }} Loaded */
  /** @type {Map<string, Loaded | null>} */
  models = new Map(); // by url; without a template until it is loaded, null where that failed

  /** @param {EventTarget & { models: import("./messages").Model[] }} store  @param {string} [base] the address before those of models */
  constructor(store, base = "") {
    super();
    this.store = store;
    this.base = base;
    this.loader = new GLTFLoader();
    store.addEventListener("hello", () => this.forget()); // the program may have been restarted with other files
  }

  forget() {
    for (const model of this.models.values()) if (model?.template) dispose(model.template);
    this.models = new Map();
  }

  urlOf(model) {
    const { url } = this.store.models.find((m) => m.name === model) ?? {};
    return url && this.base + url;
  }

  // A group with the model, or a pin until it is loaded. Its user data: `isPin`, and `sides`, the extent along x, y, z.
  make(model, { shadow = false } = {}) {
    const stand = new Group();
    const url = this.urlOf(model);
    const fill = () => {
      const loaded = url ? this.load(url) : null;
      const sides = loaded?.sides ?? PIN_SIDES;
      stand.clear();
      stand.add(loaded?.template ? clone(loaded.template) : new Mesh(PIN, PIN_MATERIAL));
      if (shadow) stand.add(shadowUnder(sides));
      Object.assign(stand.userData, { isPin: !loaded?.template, sides });
    };
    fill();
    if (url && stand.userData.isPin) this.load(url)?.loading?.then(fill);
    return stand;
  }

  load(url) {
    const { models } = this;
    const known = models.get(url);
    if (known !== undefined) return known;
    /** @type {Loaded} */
    const model = {};
    models.set(url, model);
    const loading = this.loader.loadAsync(url)
      .then(({ scene }) => Object.assign(model, normalized(scene)))
      .catch((error) => {
        console.warn(`${url}: ${error.message}`);
        models.set(url, null);
      });
    model.loading = loading;
    // After those who wait for the model have taken it.
    loading.then(() => setTimeout(() => this.dispatchEvent(new Event("loaded"))));
    return model;
  }
}

function dispose(template) {
  template.traverse(({ geometry, material }) => {
    geometry?.dispose();
    for (const each of material ? [material].flat() : []) {
      for (const value of Object.values(each)) if (value?.isTexture) value.dispose();
      each.dispose();
    }
  });
}

// Lights and cameras of the file are left out: they would change the rest of the scene.
function normalized(scene) {
  const extras = [];
  scene.traverse((node) => (node.isLight || node.isCamera) && extras.push(node));
  for (const node of extras) node.removeFromParent();
  const box = new Box3().setFromObject(scene, true);
  const sides = box.getSize(new Vector3());
  const longest = Math.max(sides.x, sides.y, sides.z);
  if (!(longest > 0 && longest < Infinity)) throw new Error("it has no size");
  const middle = box.getCenter(new Vector3());
  const template = new Group();
  template.add(scene);
  template.scale.setScalar(1 / longest);
  template.position.set(-middle.x, -box.min.y, -middle.z).divideScalar(longest);
  return { template, sides: sides.divideScalar(longest) };
}

function shadowUnder(sides) {
  const shadow = new Mesh(SHADOW, SHADOW_MATERIAL);
  shadow.scale.set(0.75 * sides.x + 0.05, 1, 0.75 * sides.z + 0.05);
  shadow.position.y = 0.004;
  shadow.userData.isShadow = true;
  return shadow;
}
