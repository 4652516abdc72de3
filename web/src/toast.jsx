const SHOWN_MS = 5000;

/** A line of news that goes by itself; `draw` is called when it changes. */
export class News {
  /** @param {() => void} draw */
  constructor(draw) {
    this.draw = draw;
    this.text = "";
    this.kind = "";
    this.isShown = false;
  }

  say(text, kind = "") {
    Object.assign(this, { text, kind, isShown: true });
    clearTimeout(this.timer);
    this.timer = setTimeout(() => {
      this.isShown = false;
      this.draw();
    }, SHOWN_MS);
    this.draw();
  }
}

/** @param {{ news: News }} props */
export const Toast = ({ news: { text, kind, isShown } }) => <div id="toast" class="pill" data-state={kind} hidden={!isShown}>{text}</div>;
