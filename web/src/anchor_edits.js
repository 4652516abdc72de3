// What is asked of the program about anchors, before its answer comes.
export const GROWTH = 1.15;
export const TURN = Math.PI / 12; // about the anchor's y axis
export const MAX_NAME = 64; // the program takes no longer one
const PATIENCE_MS = 2000; // for what was asked for to come

export class AnchorEdits {
  // `send` takes a message to the program.
  constructor(store, send) {
    this.store = store;
    this.send = send;
  }

  // Name and size as they will be: one click follows another before what it asked for is told.
  expected(name) {
    const { asked } = this;
    if (asked && performance.now() < asked.until && [asked.of, asked.name].includes(name)) return asked;
    return this.store.anchors.find((anchor) => anchor.name === name);
  }

  // `change` gives the edit, from what there will be.
  change(name, change) {
    const now = this.expected(name);
    if (!now) return;
    const edit = change(now);
    this.send({ type: "anchor", name: now.name, ...edit });
    const isTaken = this.exists(edit.rename); // that will be refused
    this.asked = { of: name, name: (isTaken ? null : edit.rename) ?? now.name, size: edit.size ?? now.size, until: performance.now() + PATIENCE_MS };
  }

  rename(from, to) {
    if (to !== "" && to !== from) this.change(from, () => ({ rename: to }));
    this.renamed = { from, to };
  }

  // The name of what is selected now: it may have been changed here; null where it is gone.
  follow(name) {
    if (name === null || this.exists(name)) return name;
    return this.renamed?.from === name && this.exists(this.renamed.to) ? this.renamed.to : null;
  }

  exists(name) {
    return this.store.anchors.some((anchor) => anchor.name === name);
  }
}
