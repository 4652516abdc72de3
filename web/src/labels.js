// Names beside what they name, as buttons over a view; of those that would cover each other the nearest is shown.
export class Labels {
  // `kind` is what a key names: "object" or "anchor".
  constructor(parent, kind, onClick) {
    this.element = document.createElement("div");
    this.element.className = "labels";
    parent.append(this.element);
    this.kind = kind;
    this.onClick = onClick;
    this.labels = new Map();
  }

  // Entries: key, text, color.
  set(entries) {
    const keys = new Set(entries.map((entry) => entry.key));
    for (const [key, label] of this.labels)
      if (!keys.has(key)) {
        label.remove();
        this.labels.delete(key);
      }
    for (const { key, text, color } of entries) {
      let label = this.labels.get(key);
      if (!label) {
        label = document.createElement("button");
        label.onclick = () => this.onClick(key);
        label.dataset[this.kind] = key;
        this.element.append(label);
        this.labels.set(key, label);
      }
      label.style.setProperty("--color", color);
      if (label.textContent !== text) {
        label.textContent = text;
        label.box = null;
      }
    }
  }

  // `at` gives the place of a key, with its depth, null where it is not to be seen. Keeps clear of what is placed already, and adds to it.
  place(at, selected, placed = []) {
    const candidates = [];
    for (const [key, label] of this.labels) {
      const place = at(key);
      if (place) candidates.push({ label, at: place, first: key === selected });
      else label.style.visibility = "hidden";
    }
    candidates.sort((a, b) => b.first - a.first || a.at.depth - b.at.depth);
    for (const { label, at: { x, y }, first } of candidates) {
      label.classList.toggle("selected", first);
      label.box ??= { width: label.offsetWidth, height: label.offsetHeight };
      const { width, height } = label.box;
      const free = [0, -1, 1, -2, 2].map((row) => ({ x: x - width / 2, y: y - height / 2 + row * (height + 1) }))
        .find((f) => !placed.some((p) => f.x < p.x + p.width + 2 && p.x < f.x + width + 2 && f.y < p.y + p.height && p.y < f.y + height));
      label.style.visibility = free ? "visible" : "hidden";
      if (!free) continue;
      label.style.transform = `translate(${Math.round(free.x)}px, ${Math.round(free.y)}px)`;
      placed.push({ ...free, width, height });
    }
    return placed;
  }

  hide() {
    for (const label of this.labels.values()) label.style.visibility = "hidden";
  }
}
