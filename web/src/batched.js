/**
 * A function that has `act` called by `schedule`: once, however often it is called until then.
 * @param {() => void} act
 * @param {(act: () => void) => void} schedule
 */
export function batched(act, schedule) {
  let isWaiting = false;
  return () => {
    if (isWaiting) return;
    isWaiting = true;
    schedule(() => {
      isWaiting = false;
      act();
    });
  };
}

// Before the next repaint.
export const onceAFrame = (draw) => batched(draw, (act) => requestAnimationFrame(act));
