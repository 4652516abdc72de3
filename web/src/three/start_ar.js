import { DirectionalLight, PerspectiveCamera, Scene, WebGLRenderer } from "three";
import { ArSession } from "../ar/session.js";
import { lightAround } from "../content.js";
import { ArLayer } from "./ar_layer.js";

const LIGHT = 0.45; // from all sides, beside that of a sun
const MOST_PIXELS = 2; // drawn in one of the page, along each side

/**
 * A tap on the picture, in CSS pixels of the canvas; `hit`: where it meets what the camera sees; `ray`: for the service, in a map; `anchor`: the name of the
 * anchor whose content was tapped.
 * @typedef {{ x: number, y: number, hit: import("./ar_layer.js").Hit | null, ray: ReturnType<ArLayer["ray"]>, anchor: string | null }} Tap
 */

/** The picture of the camera with content, drawn on an element. */
export class Ar {
  /** @type {((tap: Tap) => void) | undefined} */ onTap;
  /** @type {(() => void) | undefined} before each drawing */ onFrame;
  /** @type {(error: Error) => void} the session ended */ onError = reportError;
  scene = new Scene();
  camera = new PerspectiveCamera();
  renderer = new WebGLRenderer({ antialias: true });

  /** startAr makes it. @param {ArSession} session  @param {HTMLElement} element  @param {ConstructorParameters<typeof ArLayer>[1]} options */
  constructor(session, element, options) {
    this.session = session;
    this.element = element;
    this.layer = new ArLayer(session, options);
    const sun = new DirectionalLight("#ffffff", 1.2);
    sun.position.set(0.5, 2, 1);
    this.scene.add(this.layer, sun);
    lightAround(this.scene, this.renderer, LIGHT);
    const { domElement: canvas } = this.renderer;
    Object.assign(canvas.style, { display: "block", width: "100%", height: "100%", touchAction: "manipulation" });
    element.prepend(canvas);
    canvas.addEventListener("click", ({ offsetX, offsetY }) => this.onTap?.(this.#tap(offsetX, offsetY)));
    session.addEventListener("error", (/** @type {any} */ { error }) => this.onError(error));
    this.renderer.setAnimationLoop(() => this.#draw());
  }

  #draw() {
    const { renderer, element } = this;
    const ratio = Math.min(devicePixelRatio, MOST_PIXELS);
    renderer.setPixelRatio(ratio);
    renderer.setSize(element.clientWidth, element.clientHeight, false);
    this.layer.update(this.camera, renderer.domElement);
    this.onFrame?.();
    renderer.render(this.scene, this.camera);
  }

  /** @param {number} x  @param {number} y  @returns {Tap} */
  #tap(x, y) {
    const { layer } = this;
    return { x, y, hit: layer.hit(x, y), ray: layer.ray(x, y), anchor: layer.anchorAt(x, y) };
  }

  /** As ArLayer.place. @template {import("three").Object3D} T  @param {T} object  @param {import("./ar_layer.js").Hit} hit  @returns {T} */
  place(object, hit) {
    return this.layer.place(object, hit);
  }

  /** Closes the camera, and takes the picture from the page. */
  stop() {
    this.session.stop();
    this.renderer.setAnimationLoop(null);
    this.renderer.domElement.remove();
    this.layer.dispose();
    this.renderer.dispose();
  }
}

/**
 * Opens the camera and draws its picture on an element, which has a size. To be called while a tap or a click is handled. Rejects with an Error that says
 * why it cannot.
 * @param {Parameters<typeof ArSession.start>[0] & ConstructorParameters<typeof ArLayer>[1] & { element?: HTMLElement }} [options] of ArSession.start and of
 *   ArLayer; element: document.body unless given
 */
export async function startAr({ element = document.body, content, ...options } = {}) {
  const session = await ArSession.start({ parent: element, ...options });
  try {
    return new Ar(session, element, { content });
  } catch (error) {
    session.stop();
    throw error; // as where there is no WebGL
  }
}
