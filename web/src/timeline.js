import { onceAFrame } from "./batched.js";
import { contextOf } from "./image_area.js";
import { MARKS, STATE_COLORS, short } from "./palette.js";
import { STATES } from "./store.js";

// A column shows the worst of its images.
const SEVERITY = ["initializing", "preliminary", "tracking", "relocalized", "odometry", "objects", "lost"].reduce(
  (order, state, n) => order.with(STATES.indexOf(/** @type {any} */ (state)), n),
  STATES.map(() => 0),
);

/** A strip with the states and times of all frames. A click on a frame chooses it. */
export class Timeline {
  /** @type {number | undefined} */ now; // the frame that was chosen

  /** @param {HTMLElement} element  @param {import("./store.js").Store} store  @param {{ onChoose: (frame: number) => void }} events */
  constructor(element, store, { onChoose }) {
    this.element = element;
    this.store = store;
    this.onChoose = onChoose;
    this.invalidate = onceAFrame(() => this.draw());
    this.canvas = document.createElement("canvas");
    this.tip = document.createElement("div");
    this.tip.className = "tip";
    this.tip.hidden = true;
    element.append(this.canvas, this.tip);
    for (const part of ["notes", "events", "restart", "frame"]) store.addEventListener(part, () => this.invalidate());
    new ResizeObserver(() => this.invalidate()).observe(element);
    element.addEventListener("pointermove", (event) => this.hover(event));
    element.addEventListener("pointerleave", () => this.hover(null));
    element.addEventListener("pointerdown", (event) => {
      element.setPointerCapture(event.pointerId);
      this.choose(event);
    });
  }

  draw() {
    const dpr = Math.min(devicePixelRatio, 2);
    const { clientWidth: width, clientHeight: height } = this.element;
    this.canvas.width = width * dpr;
    this.canvas.height = height * dpr;
    const context = contextOf(this.canvas);
    context.scale(dpr, dpr);
    const { notes } = this.store;
    if (notes.length === 0) return;
    const strip = 7;
    const area = height - strip - 8;
    const scale = Math.max(1, this.percentile(0.98) * 1.15);
    const columns = Math.min(width, Math.max(1, notes.length));
    for (let column = 0; column < columns; ++column) {
      const begin = Math.floor((column * notes.length) / columns);
      const end = Math.max(begin + 1, Math.floor(((column + 1) * notes.length) / columns));
      let ms = 0;
      let state = 0;
      for (let i = begin; i < end; ++i) {
        ms = Math.max(ms, notes[i].ms);
        if (SEVERITY[notes[i].state] > SEVERITY[state]) state = notes[i].state;
      }
      const x = (column * width) / columns;
      const step = width / columns + 0.5;
      context.fillStyle = STATE_COLORS[STATES[state]];
      context.fillRect(x, height - strip, step, strip);
      context.globalAlpha = 0.4;
      const bar = Math.min(1, ms / scale) * area;
      context.fillRect(x, height - strip - 2 - bar, Math.max(1, step - 1), bar);
      context.globalAlpha = 1;
    }
    this.drawMarks(context, width, height, strip);
    if (scale > 1) {
      context.fillStyle = "#8b96a3";
      context.font = "10px system-ui, sans-serif";
      context.fillText(`${short(scale / 1.15)} ms`, 6, 12);
    }
  }

  drawMarks(context, width, height, strip) {
    const { notes, events, frame, chosen } = this.store;
    const xOf = (number) => ((this.placeOf(number) + 0.5) / notes.length) * width;
    for (const event of events)
      if (MARKS[event.kind]) {
        context.fillStyle = MARKS[event.kind];
        context.fillRect(xOf(event.frame) - 0.5, 2, 1, height - strip - 4);
      }
    const now = this.now ?? chosen?.frame ?? frame?.frame;
    if (now === undefined) return;
    context.fillStyle = "#ffffff";
    context.fillRect(xOf(now) - 1, 0, 2, height);
  }

  percentile(share) {
    const values = this.store.notes.map((n) => n.ms).sort((a, b) => a - b);
    return values[Math.floor(share * (values.length - 1))];
  }

  // The place in the notes of a frame, or of the last one before it.
  placeOf(frame) {
    const { notes } = this.store;
    let [low, high] = [0, notes.length - 1];
    while (low < high) {
      const middle = (low + high + 1) >> 1;
      if (notes[middle].frame <= frame) low = middle;
      else high = middle - 1;
    }
    return low;
  }

  noteAt(event) {
    const { notes } = this.store;
    if (notes.length === 0) return null;
    const rect = this.element.getBoundingClientRect();
    return notes[Math.max(0, Math.min(notes.length - 1, Math.floor(((event.clientX - rect.left) / rect.width) * notes.length)))];
  }

  hover(event) {
    const note = event && this.noteAt(event);
    this.tip.hidden = !note;
    if (!note) return;
    const ms = note.ms > 0 ? ` \u00b7 ${note.ms.toFixed(1)} ms` : "";
    const { recordings = [] } = this.store.status;
    const place = this.store.recordingOf(note.frame);
    const recording = recordings.length > 1 ? `recording ${place + 1} ${recordings[place].name} \u00b7 ` : "";
    this.tip.textContent = `${recording}frame ${note.frame} \u00b7 ${STATES[note.state]} \u00b7 ${note.inliers} points${ms}`;
    const rect = this.element.getBoundingClientRect();
    this.tip.style.left = `${Math.max(4, Math.min(event.clientX - rect.left + 10, rect.width - this.tip.offsetWidth - 4))}px`;
    if (event.buttons & 1) this.choose(event);
  }

  choose(event) {
    const note = this.noteAt(event);
    if (!note || this.store.status.live) return;
    this.now = note.frame;
    this.onChoose(note.frame);
    this.invalidate();
  }
}
