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
const MOVE = { state: "preliminary", text: STATES.preliminary };
const SHOWS_NOTHING = { state: "objects", text: "sees too little: point at something with details" }; // the motion sensors carry it for a second or two
const BLIND = { state: "lost", text: "nothing to hold on to: point at something with details" };

/** How long ago the service has placed the camera. @param {number} seconds */
export const ageInWords = (seconds) => `place ${seconds < 10 ? Math.max(0, seconds).toFixed(1) : Math.round(seconds)} s old`;

/** @param {{ link?: string, why?: string | null, seconds?: number, answer?: any, kind?: string, isFinishing?: boolean, tracked?: any }} session */
export function describe({ link, why, seconds = 0, answer, kind, isFinishing, tracked }) {
  const isPlaced = Boolean(tracked?.pose);
  if (isFinishing) return { state: "objects", text: "saving" };
  if (kind === "alone") return describeAlone(tracked);
  if (link === "waiting" && kind === "record") return { state: "lost", text: "the connection ended: this map is not saved" };
  if (link === "waiting") return { state: isPlaced ? "objects" : "lost", text: `${why ?? "no connection"}: again in ${Math.max(1, Math.ceil(seconds))} s` };
  if (isPlaced && answer?.state === "lost") return { state: "objects", text: STATES.lost };
  if (isPlaced && tracked.state === "inertial") return SHOWS_NOTHING;
  if (isPlaced) return tracked.state === "uncertain" ? { state: "objects", text: "too fast" } : { state: "tracking", text: STATES.tracking };
  if (link === "connecting") return { state: "", text: "connecting" };
  if (!answer) return { state: "", text: "waiting for the first answer" };
  if (tracked?.state === "blind") return BLIND;
  // The service knows the place, but not yet how the odometry's frame lies in it.
  if (kind === "track" && answer.state !== "lost") return MOVE;
  return { state: answer.state, text: STATES[answer.state] ?? answer.state };
}

function describeAlone(tracked) {
  if (tracked?.state === "blind") return BLIND;
  if (tracked?.state === "inertial") return SHOWS_NOTHING;
  if (tracked?.state === "tracking" || tracked?.state === "uncertain") return { state: "tracking", text: "without a map" };
  return tracked?.state === "preliminary" ? MOVE : { state: "", text: "starting" };
}
