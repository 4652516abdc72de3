/** Names as buttons over a view, beside what they name. Of those that would cover each other the nearest is shown. */
export class Labels {
  /** `kind`: what a key names. @param {HTMLElement} parent  @param {"object" | "anchor"} kind  @param {(key: any) => void} onClick */
  constructor(parent, kind, onClick) {
    this.element = document.createElement("div");
    this.element.className = "labels";
    parent.append(this.element);
    this.kind = kind;
    this.onClick = onClick;
    /** @type {Map<any, { button: HTMLButtonElement, size: { width: number, height: number } | null }>} */
    this.labels = new Map(); // by key; a size is measured when it is needed
  }

  /** @param {{ key: any, text: string, color: string }[]} entries */
  set(entries) {
    const keys = new Set(entries.map((entry) => entry.key));
    for (const [key, { button }] of this.labels)
      if (!keys.has(key)) {
        button.remove();
        this.labels.delete(key);
      }
    for (const { key, text, color } of entries) {
      const label = this.labels.get(key) ?? this.add(key);
      label.button.style.setProperty("--color", color);
      if (label.button.textContent !== text) {
        label.button.textContent = text;
        label.size = null;
      }
    }
  }

  add(key) {
    const label = { button: document.createElement("button"), size: null };
    label.button.onclick = () => this.onClick(key);
    label.button.dataset[this.kind] = key;
    this.element.append(label.button);
    this.labels.set(key, label);
    return label;
  }

  /**
   * Arranges the labels; the one of the key `selected` comes first. `at` gives the place of a key and its depth, nothing where no label is wanted.
   * Labels stay clear of the rectangles in `placed`, and theirs are added to it.
   * @param {(key: any) => { x: number, y: number, depth: number } | null | false | undefined} at
   */
  place(at, selected, placed = /** @type {{ x: number, y: number, width: number, height: number }[]} */ ([])) {
    const candidates = [];
    for (const [key, label] of this.labels) {
      const place = at(key);
      if (place) candidates.push({ label, at: place, first: key === selected });
      else label.button.style.visibility = "hidden";
    }
    candidates.sort((a, b) => Number(b.first) - Number(a.first) || a.at.depth - b.at.depth);
    for (const { label, at: { x, y }, first } of candidates) {
      const { button } = label;
      button.classList.toggle("selected", first);
      label.size ??= { width: button.offsetWidth, height: button.offsetHeight };
      const { width, height } = label.size;
      const free = [0, -1, 1, -2, 2].map((row) => ({ x: x - width / 2, y: y - height / 2 + row * (height + 1) }))
        .find((f) => !placed.some((p) => f.x < p.x + p.width + 2 && p.x < f.x + width + 2 && f.y < p.y + p.height && p.y < f.y + height));
      button.style.visibility = free ? "visible" : "hidden";
      if (!free) continue;
      button.style.transform = `translate(${Math.round(free.x)}px, ${Math.round(free.y)}px)`;
      placed.push({ ...free, width, height });
    }
    return placed;
  }

  hide() {
    for (const { button } of this.labels.values()) button.style.visibility = "hidden";
  }
}
