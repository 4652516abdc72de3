// A function that draws before the next repaint: once, however often it is called until then.
export function onceAFrame(draw) {
  let isStale = false;
  return () => {
    if (isStale) return;
    isStale = true;
    requestAnimationFrame(() => {
      isStale = false;
      draw();
    });
  };
}
