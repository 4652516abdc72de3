/** Anchors after an edit by the service: those it names are gone or changed. @template {{ name: string }} T  @param {T[]} anchors  @param {{ anchors?: T[], removed?: string[] }} edit  @returns {T[]} */
export function editedAnchors(anchors, { anchors: changed = [], removed = [] }) {
  const now = new Map(anchors.map((anchor) => [anchor.name, anchor]));
  for (const name of removed) now.delete(name);
  for (const anchor of changed) now.set(anchor.name, anchor);
  return [...now.values()];
}
