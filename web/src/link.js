const FIRST_MS = 500;
const LAST_MS = 8000;

/**
 * A WebSocket that opens again after it was closed: after half a second, then after twice as long each time, up to eight seconds.
 * State: "connecting", "open" (the server has said hello), or "waiting" (closed; `retryAt` is when it opens again, on the clock of
 * performance.now()).
 */
export class Link {
  /**
   * `onMessage` gets one message at a time: the next one when the promise that it returned is settled.
   * @param {{ url: string, protocols: string[], onMessage: (message: any) => any, onState: (state: string) => void,
   *   decode?: (data: any) => any, comesBack?: boolean }} options
   */
  constructor({ url, protocols, onMessage, onState, decode = JSON.parse, comesBack = true }) {
    this.url = url;
    this.protocols = protocols;
    this.onMessage = onMessage;
    this.onState = onState;
    this.decode = decode;
    this.comesBack = comesBack;
    this.delay = FIRST_MS;
    this.retryAt = 0;
    this.isEnded = false;
    this.heard = 0; // when the server was heard last
    this.taken = Promise.resolve(); // when all messages so far are dealt with
    this.open();
  }

  open() {
    clearTimeout(this.timer);
    this.setState("connecting");
    const socket = new WebSocket(this.url, this.protocols);
    socket.binaryType = "arraybuffer";
    this.socket = socket;
    this.heard = performance.now();
    socket.onmessage = ({ data }) => {
      this.heard = performance.now();
      this.taken = this.taken.then(() => this.take(socket, data)).catch(reportError);
    };
    socket.onclose = () => {
      if (socket === this.socket) this.wait();
    };
  }

  async take(socket, data) {
    if (socket !== this.socket) return;
    const message = this.decode(data);
    if (message.type === "hello") {
      this.delay = FIRST_MS;
      this.setState("open");
    }
    await this.onMessage(message);
  }

  wait() {
    this.retryAt = performance.now() + this.delay;
    if (this.comesBack) this.timer = setTimeout(() => this.open(), this.delay);
    this.delay = Math.min(2 * this.delay, LAST_MS);
    this.setState("waiting");
  }

  setState(state) {
    this.state = state;
    this.onState(state);
  }

  // Opens a closed one now instead of later: the device has a network again, or the user looks.
  hurry() {
    if (this.state === "waiting" && this.comesBack && !this.isEnded) this.open();
  }

  // For one that is open and silent.
  restart() {
    this.close();
    this.wait();
  }

  end() {
    this.isEnded = true;
    clearTimeout(this.timer);
    this.close();
  }

  close() {
    const { socket } = this;
    this.socket = null;
    socket?.close();
  }

  get isOpen() {
    return this.state === "open" && this.socket?.readyState === WebSocket.OPEN;
  }

  // Whether all that was sent has left the browser.
  get isFree() {
    return this.isOpen && this.socket?.bufferedAmount === 0;
  }

  /** @param {import("./messages").Request} message */
  send(message) {
    this.sendBytes(JSON.stringify(message));
  }

  sendBytes(data) {
    if (this.isOpen) this.socket?.send(data);
  }
}
