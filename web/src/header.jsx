import { useMemo } from "preact/hooks";

/**
 * The line on top: views, state, numbers, connection.
 * @param {{ store: import("./store.js").Store, link: string, views: string[], view: string, onView: (view: string) => void }} props
 */
export function Header({ store, link, views, view, onView }) {
  const { frame, chosen, status, map } = store;
  const state = status.live ? ((chosen ?? frame)?.state ?? "waiting") : link === "open" || map.keyframes > 0 ? "saved" : "no connection";
  return (
    <>
      <span class="brand">OA-SLAM</span>
      <nav id="views" role="tablist">
        {views.map((name) => <button key={name} role="tab" data-view={name} aria-selected={name === view} onClick={() => onView(name)}>{name}</button>)}
      </nav>
      <span id="state" class="pill" data-state={state}>{status.paused ? `${state} \u00b7 paused` : state}</span>
      <dl id="stats"><Stats store={store} /></dl>
      <span id="title">{nameOf(status.title)}</span>
      <span id="link" data-state={link} title="connection to the program" />
    </>
  );
}

// The last part of a path.
export const nameOf = (title) => title.split("/").filter(Boolean).at(-1) ?? "";

function Stats({ store }) {
  const { notes, frame, status, map } = store;
  const median = useMemo(() => {
    const times = notes.map(({ ms }) => ms).filter((ms) => ms > 0).sort((a, b) => a - b);
    return times[times.length >> 1]?.toFixed(1);
  }, [notes, notes.length, status.live]);
  const stats = { landmarks: store.landmarks.count, objects: store.mappedObjects().length, keyframes: store.keyframes.size, loops: map.loops || null };
  if (status.live && frame) {
    const { inliers, ms, confidence } = frame;
    Object.assign(stats, { frame: frame.frame, points: inliers, ms: ms.total.toFixed(1), confidence: confidence.toFixed(2), dropped: status.dropped || null });
  } else if (!status.live && notes.length > 0) {
    Object.assign(stats, { frames: notes.length, "median ms": median });
  }
  return Object.entries(stats).filter(([, value]) => value != null).map(([name, value]) => [
    <dt key={name}>{name}</dt>,
    <dd key={`${name} value`} data-stat={name} data-value={value}>{value.toLocaleString("en")}</dd>,
  ]);
}
