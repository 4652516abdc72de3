export const STATE_COLORS = { initializing: "#8b96a3", tracking: "#4cc38a", relocalized: "#5ab0f5", objects: "#e8b339", lost: "#e5585f", odometry: "#9fb86b", preliminary: "#b7a6f5" };
export const COLORS = { path: "#5ab0f5", uncertain: "#ff8c42", groundtruth: "#e6e9ed", keyframe: "#5d83ad", covisible: "#51657a", camera: "#ffd166", matched: "#ffd166", measure: "#ff8fa3", anchor: "#ffb454" };
export const RECORDING_COLORS = [COLORS.path, "#e8d44d", "#c58af9", "#4cc38a", "#e5585f", "#f28fb1"]; // of trajectories
export const MARKS = { lost: STATE_COLORS.lost, relocalized: STATE_COLORS.relocalized, objects: STATE_COLORS.objects, loop: "#c58af9", reset: "#e6e9ed" }; // of events

// A hue for each class, in the order of their first use; those of the first ones differ most.
const HUES = [200, 28, 140, 330, 52, 268, 172, 4, 96, 232, 300, 76, 118, 316, 216, 40];
const order = new Map();
export function classColor(category, lightness = 64) {
  if (!order.has(category)) order.set(category, order.size);
  return `hsl(${HUES[order.get(category) % HUES.length]}, 66%, ${lightness}%)`;
}

export function labelOf(object) {
  return object.name || object.category;
}

// With `count` significant digits.
export function short(x, count = 3) {
  if (x === 0) return "0";
  const digits = Math.max(0, count - 1 - Math.floor(Math.log10(Math.abs(x))));
  return x.toFixed(Math.min(digits, 6));
}
