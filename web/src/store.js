/** @import { Anchor, FrameMessage, MapSummary, Model, RunEvent, SeenObject, Status } from "./messages" */
/** @typedef {FrameMessage & { px: Float32Array, landmarks: Uint32Array, isMatched: (i: number) => boolean, bitmap: ImageBitmap | null, keyframe?: number }} Frame */
/** @typedef {Omit<import("./messages").ObjectDetail, "crops"> & { crops: { frame: number, url: string }[] }} Detail */
/** @typedef {{ id: number, frame: number, pose: Float32Array, edges: Uint32Array }} Keyframe  `edges`: pairs of another keyframe and the number of shared landmarks */
/** @typedef {{ frame: number, state: number, ms: number, inliers: number, uncertain: boolean }} Note */
/** @type {import("./messages").State[]} */
export const STATES = ["initializing", "tracking", "relocalized", "objects", "lost", "odometry", "preliminary"];
const NO_LANDMARK = 0xffffffff;

// Landmarks by id in arrays without gaps: a removed one is replaced by the last.
class Landmarks {
  constructor() {
    this.place = new Map();
    this.count = 0;
    this.ids = new Uint32Array(1024);
    this.positions = new Float32Array(3 * 1024);
    this.colors = new Uint8Array(3 * 1024);
    this.known = new Map(); // colours by id, also of landmarks that have not come yet
    this.dirty = [Infinity, -1];
  }

  grow() {
    const larger = (array) => {
      const copy = new array.constructor(2 * array.length);
      copy.set(array);
      return copy;
    };
    this.ids = larger(this.ids);
    this.positions = larger(this.positions);
    this.colors = larger(this.colors);
  }

  touch(place) {
    this.dirty[0] = Math.min(this.dirty[0], place);
    this.dirty[1] = Math.max(this.dirty[1], place);
  }

  set(id, x, y, z) {
    let place = this.place.get(id);
    if (place === undefined) {
      if (this.count === this.ids.length) this.grow();
      place = this.count++;
      this.place.set(id, place);
      this.ids[place] = id;
      this.paint(place, this.known.get(id));
    }
    this.positions.set([x, y, z], 3 * place);
    this.touch(place);
  }

  paint(place, rgb) {
    this.colors.set(rgb === undefined ? [128, 140, 156] : [rgb >> 16, (rgb >> 8) & 255, rgb & 255], 3 * place);
    this.touch(place);
  }

  color(id, r, g, b) {
    const rgb = (r << 16) | (g << 8) | b;
    this.known.set(id, rgb);
    const place = this.place.get(id);
    if (place !== undefined) this.paint(place, rgb);
  }

  remove(id) {
    const place = this.place.get(id);
    if (place === undefined) return;
    this.place.delete(id);
    const last = --this.count;
    if (place === last) return;
    this.ids[place] = this.ids[last];
    this.positions.copyWithin(3 * place, 3 * last, 3 * last + 3);
    this.colors.copyWithin(3 * place, 3 * last, 3 * last + 3);
    this.place.set(this.ids[place], place);
    this.touch(place);
  }
}

/** What the program has told: the map, the frames, the events. An event of the name of each part that changed is dispatched. */
export class Store extends EventTarget {
  /** @type {Status} */ status = { live: false, paused: false, mapping: true, dropped: 0, title: "" };
  mayCommand = false;
  mayPlace = false; // and edit anchors
  /** @type {Model[]} */ models = [];
  /** @type {RunEvent[]} */ events = [];
  updates = 0; // since the connection was opened; the first one has all that was before
  /** @type {Landmarks} */ landmarks;
  /** @type {Map<number, Keyframe>} */ keyframes;
  /** @type {Map<number, SeenObject>} */ objects;
  /** @type {{ size: number, poses: Float32Array, states: Uint8Array, frames: Int32Array }} */ path;
  /** @type {Note[]} */ notes;
  /** @type {Float32Array} */ groundtruth;
  /** @type {MapSummary} */ map;
  /** @type {Frame | null} */ frame; // the newest
  /** @type {Anchor[]} */ anchors;
  /** @type {Frame | null} */ chosen; // of the keyframe that was asked for
  /** @type {Detail | null} */ detail = null; // of the object that was asked for

  constructor() {
    super();
    this.clear();
  }

  clear() {
    this.landmarks = new Landmarks();
    this.keyframes = new Map();
    this.objects = new Map();
    this.path = { size: 0, poses: new Float32Array(0), states: new Uint8Array(0), frames: new Int32Array(0) };
    this.notes = [];
    this.groundtruth = new Float32Array(0);
    this.map = { landmarks: 0, keyframes: 0, loops: 0, metric: false };
    this.frame = null;
    this.anchors = [];
    this.chosen = null;
    this.showDetail(null);
  }

  // A run that has ended accepts no edits; a saved map, which takes no commands, does.
  get mayEdit() {
    return this.mayPlace && (this.status.live || !this.mayCommand);
  }

  get unit() {
    return this.map.metric ? "m" : "units";
  }

  /** The place of the recording that has a frame. @param {number} frame */
  recordingOf(frame) {
    const { recordings = [] } = this.status;
    return Math.max(0, recordings.findLastIndex((r) => r.first_frame <= frame));
  }

  mappedObjects() {
    return [...this.objects.values()].filter((o) => o.mapped);
  }

  /** Resolves when all is taken over, pictures included. @param {import("./messages").ViewerMessage} message */
  async take(message) {
    const changed = new Set();
    if (message.type === "hello") {
      // After it comes the whole map.
      this.clear();
      this.events = [];
      this.updates = 0;
      this.mayCommand = message.commands;
      this.mayPlace = message.anchors ?? false;
      this.models = message.models ?? [];
      for (const part of ["hello", "restart", "map", "path", "frame", "notes", "events", "anchors", "status"]) changed.add(part);
    } else if (message.type === "update") {
      await this.update(message, changed);
    } else if (message.type === "object") {
      this.showDetail(message);
      changed.add("detail");
    } else if (message.type === "keyframe") {
      this.chosen = { ...(await frameOf(message.frame, message.arrays)), keyframe: message.keyframe };
      changed.add("frame");
    }
    for (const part of changed) this.dispatchEvent(new Event(part));
  }

  /** @param {import("./messages").Update} message  @param {Set<string>} changed */
  async update(message, changed) {
    const { arrays } = message;
    ++this.updates;
    if (message.restart) {
      this.clear();
      changed.add("restart").add("path").add("frame").add("notes").add("anchors");
    }
    if (message.map) {
      this.updateMap(message, message.map);
      changed.add("map");
    }
    if (arrays.color_ids) {
      arrays.color_ids.forEach((id, i) => this.landmarks.color(id, ...arrays.colors.subarray(3 * i, 3 * i + 3)));
      changed.add("map");
    }
    if (message.path_size !== undefined) {
      this.updatePath(message.path_size, arrays);
      changed.add("path");
    }
    if (arrays.note_frames) {
      arrays.note_frames.forEach((frame, i) =>
        this.notes.push({ frame, state: arrays.note_states[i], ms: arrays.note_ms[i], inliers: arrays.note_inliers[i], uncertain: arrays.note_uncertain[i] > 0 }));
      changed.add("notes");
    }
    if (message.events) {
      this.events.push(...message.events);
      changed.add("events");
    }
    if (arrays.groundtruth) {
      this.groundtruth = arrays.groundtruth;
      changed.add("path");
    }
    if (message.anchors) {
      this.anchors = message.anchors;
      changed.add("anchors");
    }
    if (message.status) {
      this.status = message.status;
      changed.add("status");
    }
    if (message.frame) {
      const before = this.frame;
      this.frame = await frameOf(message.frame, arrays);
      before?.bitmap?.close();
      if (this.status.live) this.chosen = null;
      changed.add("frame");
    }
  }

  /** @param {import("./messages").Update} message  @param {MapSummary} map */
  updateMap(message, map) {
    const { arrays } = message;
    this.map = map;
    const positions = arrays.landmark_positions;
    arrays.landmark_ids?.forEach((id, i) => this.landmarks.set(id, positions[3 * i], positions[3 * i + 1], positions[3 * i + 2]));
    arrays.landmarks_gone?.forEach((id) => this.landmarks.remove(id));
    let edge = 0;
    arrays.keyframe_ids?.forEach((id, i) => {
      const degree = arrays.keyframe_degrees[i];
      this.keyframes.set(id, {
        id,
        frame: arrays.keyframe_frames[i],
        pose: arrays.keyframe_poses.slice(7 * i, 7 * i + 7),
        edges: degree > 0 ? arrays.keyframe_edges.slice(2 * edge, 2 * (edge + degree)) : new Uint32Array(0),
      });
      edge += degree;
    });
    arrays.keyframes_gone?.forEach((id) => this.keyframes.delete(id));
    message.objects?.forEach((object) => this.objects.set(object.id, object));
    message.objects_gone?.forEach((id) => this.objects.delete(id));
  }

  /** The pictures of the one before are released. @param {import("./messages").ObjectDetail | null} message */
  showDetail(message) {
    for (const { url } of this.detail?.crops ?? []) URL.revokeObjectURL(url);
    let offset = 0;
    const crops = message?.crops.map(({ frame, bytes }) => {
      const blob = new Blob([message.arrays.jpegs.subarray(offset, offset + bytes)], { type: "image/jpeg" });
      offset += bytes;
      return { frame, url: URL.createObjectURL(blob) };
    });
    this.detail = message && { ...message, crops: crops ?? [] };
  }

  updatePath(size, arrays) {
    const { path } = this;
    if (size > path.states.length) {
      const capacity = Math.max(size, 2 * path.states.length, 256);
      const larger = (array, length, fill) => {
        const copy = new array.constructor(length).fill(fill);
        copy.set(array);
        return copy;
      };
      path.poses = larger(path.poses, 7 * capacity, NaN);
      path.states = larger(path.states, capacity, 0);
      path.frames = larger(path.frames, capacity, -1);
    }
    if (size < path.size) path.poses.fill(NaN, 7 * size);
    path.size = size;
    arrays.path_places?.forEach((place, i) => {
      path.poses.set(arrays.path_poses.subarray(7 * i, 7 * i + 7), 7 * place);
      path.states[place] = arrays.path_states[i];
      path.frames[place] = arrays.path_frames[i];
    });
  }
}

/** @returns {Promise<Frame>} */
async function frameOf(frame, arrays) {
  const landmarks = arrays.keypoint_landmarks ?? new Uint32Array(0);
  return {
    ...frame,
    px: arrays.keypoints ?? new Float32Array(0),
    landmarks,
    isMatched: (i) => landmarks[i] !== NO_LANDMARK,
    bitmap: arrays.jpeg ? await createImageBitmap(new Blob([arrays.jpeg], { type: "image/jpeg" })) : null,
  };
}
