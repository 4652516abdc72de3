// The state of the connection, or else of the camera, in words; `state` selects the colour (common.css).
const STATES = {
  tracking: "in the map",
  relocalized: "found",
  odometry: "on the way",
  preliminary: "move sideways, slowly",
  objects: "found by objects",
  lost: "looking for this place",
  initializing: "move sideways, slowly",
};

export function describe({ link, why, seconds, answer, kind, isFinishing }) {
  if (isFinishing) return { state: "objects", text: "saving" };
  if (link === "connecting") return { state: "", text: "connecting" };
  if (link === "waiting" && kind === "record") return { state: "lost", text: "the connection ended: this map is not saved" };
  if (link === "waiting") return { state: "lost", text: `${why ?? "no connection"}: again in ${Math.max(1, Math.ceil(seconds))} s` };
  if (!answer) return { state: "", text: "waiting for the first answer" };
  return { state: answer.state, text: STATES[answer.state] ?? answer.state };
}
