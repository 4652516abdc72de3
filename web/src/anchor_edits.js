/** @import { Anchor, AnchorEdit, Model, Place, Request } from "./messages" */
export const GROWTH = 1.15;
export const TURN = Math.PI / 12; // about the anchor's y axis
export const MAX_NAME = 64; // the program takes no longer one
const PATIENCE_MS = 2000; // for the answer to an edit

/** Edits of anchors and new ones, and what is known about them before the program answers. */
export class AnchorEdits {
  model = ""; // that the user chose to place
  /** @type {Set<string> | null} */ others = null; // the names that there were when content was placed

  /** @param {{ anchors: Anchor[], models: Model[] }} store  @param {(message: Request) => void} send  to the program */
  constructor(store, send) {
    this.store = store;
    this.send = send;
    /** @type {Map<string, number>} */
    this.numbers = new Map(); // by name
    this.count = 0;
  }

  /** @returns {string | undefined} */
  get modelToPlace() {
    const names = this.store.models.map(({ name }) => name);
    return names.includes(this.model) ? this.model : names[0];
  }

  /** @param {Place} where */
  place(where) {
    if (this.modelToPlace === undefined) return;
    this.others = new Set(this.store.anchors.map(({ name }) => name));
    this.send({ type: "place", model: this.modelToPlace, ...where });
  }

  // Name and size after the last edit, which may not be answered yet: each of several quick clicks starts from the one before.
  expected(name) {
    const { asked } = this;
    if (asked && performance.now() < asked.until && [asked.of, asked.name].includes(name)) return asked;
    return this.store.anchors.find((anchor) => anchor.name === name);
  }

  /** `change` makes the edit from the expected name and size. @param {string} name  @param {(now: { name: string, size: number }) => AnchorEdit} change */
  change(name, change) {
    const now = this.expected(name);
    if (!now) return;
    const edit = change(now);
    this.send({ type: "anchor", name: now.name, ...edit });
    const renamed = this.exists(edit.rename) ? undefined : edit.rename; // the program refuses a name that is taken
    this.asked = { of: name, name: renamed ?? now.name, size: edit.size ?? now.size, until: performance.now() + PATIENCE_MS };
  }

  rename(from, to) {
    if (to === "" || to === from) return;
    this.change(from, () => ({ rename: to }));
    this.renamed = { from, to };
  }

  // What is to be selected instead of `name` after the anchors have changed: content that was placed here, or its new name; null where it is gone.
  follow(name) {
    const placed = this.others && this.store.anchors.find((anchor) => !this.others?.has(anchor.name));
    if (placed) this.others = null;
    if (placed) return placed.name;
    if (name === null || this.exists(name)) return name;
    const { from, to } = this.renamed ?? {};
    return from === name && this.exists(to) ? to : null;
  }

  exists(name) {
    return this.store.anchors.some((anchor) => anchor.name === name);
  }

  // The anchors, each with a number that it keeps when it is renamed here, in the order of these numbers.
  numbered() {
    const before = this.numbers;
    const { from, to } = this.renamed ?? {};
    const numberOf = (name) => before.get(name) ?? (name === to && !this.exists(from) ? before.get(from) : undefined) ?? ++this.count;
    this.numbers = new Map(this.store.anchors.map(({ name }) => [name, numberOf(name)]));
    return this.store.anchors.map((anchor) => ({ anchor, number: this.numbers.get(anchor.name) ?? 0 })).sort((a, b) => a.number - b.number);
  }
}
