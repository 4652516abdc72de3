// The intrinsics of this device's cameras: the server finds them once, the browser remembers them.
import { scaledCamera } from "../device/lens.js";

// The size at which an image has as many pixels as the server uses (features.resolution).
export function sentSize(width, height, pixels = 640 * 480) {
  const scale = Math.min(1, Math.sqrt(pixels / (width * height)));
  return { width: Math.round(width * scale), height: Math.round(height * scale) };
}

const isCamera = (c) => c && ["width", "height", "fx", "fy"].every((key) => c[key] > 0) && ["cx", "cy"].every((key) => Number.isFinite(c[key]));

export class KnownCameras {
  constructor(storage) {
    this.storage = storage;
  }

  // `lens`: { label, deviceId, width, height } of the video. A label is the same on the next visit, an id need not be.
  key({ label, deviceId, width, height }) {
    return `oaslam camera ${label || deviceId} ${width}x${height}`;
  }

  // The camera for images of a size; null where it is not known.
  recall(lens, size) {
    try {
      const camera = JSON.parse(this.storage.getItem(this.key(lens)));
      return isCamera(camera) ? scaledCamera(camera, size.width, size.height) : null;
    } catch {
      return null; // the browser may keep nothing, or another program's value
    }
  }

  knows(lens) {
    return this.recall(lens, lens) !== null;
  }

  remember(lens, camera) {
    try {
      this.storage.setItem(this.key(lens), JSON.stringify(camera));
    } catch {
      // Then it is estimated again on the next visit.
    }
  }

  forget(lens) {
    try {
      this.storage.removeItem(this.key(lens));
    } catch {
      // A browser that keeps nothing has nothing to forget.
    }
  }
}
