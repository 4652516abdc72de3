const MAX_CUT = 0.4;

/** @import { Lens, Pixel } from "./messages" */

/**
 * Where the image of a camera is on an element: in its middle, as large as fits or, with `fills`, so large that it fills the element, unless that cuts
 * away more than MAX_CUT of it.
 */
export class ImageArea {
  /** @param {HTMLElement} element  @param {Lens} camera  @param {{ fills?: boolean }} options */
  constructor(element, camera, { fills = false } = {}) {
    const { clientWidth: width, clientHeight: height } = element;
    this.camera = camera;
    const [least, most] = [width / camera.width, height / camera.height].sort((a, b) => a - b);
    this.scale = fills && least / most >= 1 - MAX_CUT ? most : least;
    this.offset = [(width - camera.width * this.scale) / 2, (height - camera.height * this.scale) / 2];
  }

  /** The pixel at a place on the element. @returns {Pixel} */
  toPixel(x, y) {
    return [(x - this.offset[0]) / this.scale - 0.5, (y - this.offset[1]) / this.scale - 0.5];
  }

  /** @param {Pixel} pixel */
  toElement([u, v]) {
    return { x: this.offset[0] + (u + 0.5) * this.scale, y: this.offset[1] + (v + 0.5) * this.scale };
  }

  /** @param {Pixel} pixel */
  contains([u, v]) {
    return u >= -0.5 && v >= -0.5 && u <= this.camera.width - 0.5 && v <= this.camera.height - 0.5;
  }
}

/**
 * Sizes the canvas to its element and draws the image. What is drawn after it is in the image's pixels, whose corners are integers.
 * @param {HTMLCanvasElement} canvas  @param {HTMLElement} element  @param {import("./store.js").Frame | null} frame
 * @returns {{ context: CanvasRenderingContext2D, area: ImageArea | null }}
 */
export function paintImage(canvas, element, frame) {
  const dpr = Math.min(devicePixelRatio, 2);
  canvas.width = element.clientWidth * dpr;
  canvas.height = element.clientHeight * dpr;
  const context = contextOf(canvas);
  if (!frame) return { context, area: null };
  const { camera } = frame;
  const area = new ImageArea(element, camera);
  context.setTransform(dpr * area.scale, 0, 0, dpr * area.scale, dpr * area.offset[0], dpr * area.offset[1]);
  context.beginPath();
  context.rect(0, 0, camera.width, camera.height);
  context.clip();
  context.fillStyle = "#161b21";
  context.fillRect(0, 0, camera.width, camera.height);
  if (frame.bitmap) context.drawImage(frame.bitmap, 0, 0, camera.width, camera.height);
  return { context, area };
}

/** @param {HTMLCanvasElement} canvas */
export const contextOf = (canvas) => /** @type {CanvasRenderingContext2D} */ (canvas.getContext("2d"));

/**
 * The object with the smallest outline around a pixel, null where there is none: who clicks on a cup on a table means the cup.
 * @param {import("./store.js").Frame} frame  @param {Pixel} pixel
 */
export function objectAt(frame, [u, v]) {
  const hits = frame.ellipses.filter((e) => {
    const [dx, dy] = [u - e.center[0], v - e.center[1]];
    const along = (dx * Math.cos(e.angle) + dy * Math.sin(e.angle)) / e.half_axes[0];
    const across = (dy * Math.cos(e.angle) - dx * Math.sin(e.angle)) / e.half_axes[1];
    return along * along + across * across <= 1;
  });
  hits.sort((a, b) => a.half_axes[0] * a.half_axes[1] - b.half_axes[0] * b.half_axes[1]);
  return hits[0]?.object ?? null;
}
