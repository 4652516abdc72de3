// A WebSocket that comes back: after half a second, then after twice as long each time, up to eight seconds.
const FIRST_MS = 500;
const LAST_MS = 8000;

export class Link {
  // `onState` gets "connecting", "open" (once the server has said hello) or "waiting" (closed, until `retryAt`, on the clock of performance.now()).
  constructor({ url, protocols, onMessage, onState, comesBack = true }) {
    Object.assign(this, { url, protocols, onMessage, onState, comesBack });
    this.delay = FIRST_MS;
    this.retryAt = null;
    this.isEnded = false;
    this.open();
  }

  open() {
    clearTimeout(this.timer);
    this.setState("connecting");
    const socket = new WebSocket(this.url, this.protocols);
    this.socket = socket;
    this.heard = performance.now();
    socket.onmessage = ({ data }) => {
      if (socket !== this.socket) return;
      this.heard = performance.now();
      const message = JSON.parse(data);
      if (message.type === "hello") {
        this.delay = FIRST_MS;
        this.setState("open");
      }
      this.onMessage(message);
    };
    socket.onclose = () => {
      if (socket === this.socket) this.wait();
    };
  }

  wait() {
    if (this.isEnded) return;
    this.retryAt = performance.now() + this.delay;
    if (this.comesBack) this.timer = setTimeout(() => this.open(), this.delay);
    this.delay = Math.min(2 * this.delay, LAST_MS);
    this.setState("waiting");
  }

  setState(state) {
    this.state = state;
    this.onState(state);
  }

  // Now, instead of later: the device has a network again, or the user looks.
  hurry() {
    if (this.state === "waiting" && this.comesBack && !this.isEnded) this.open();
  }

  // One that is silent though it is open.
  restart() {
    const { socket } = this;
    this.socket = null;
    socket?.close();
    this.wait();
  }

  end() {
    this.isEnded = true;
    clearTimeout(this.timer);
    this.socket?.close();
  }

  get isOpen() {
    return this.state === "open" && this.socket.readyState === WebSocket.OPEN;
  }

  // Whether what was sent before is on its way.
  get isFree() {
    return this.isOpen && this.socket.bufferedAmount === 0;
  }

  send(message) {
    if (this.isOpen) this.socket.send(JSON.stringify(message));
  }

  sendBytes(bytes) {
    if (this.isOpen) this.socket.send(bytes);
  }
}
