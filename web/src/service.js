const TOKEN = /^[A-Za-z0-9._~-]+$/; // the characters that a WebSocket's subprotocol may have

/** An answer of the server that says no. */
export class Refusal extends Error {
  constructor(message, status) {
    super(message);
    this.status = status;
  }

  get isAboutToken() {
    return this.status === 401 || this.status === 403;
  }
}

/** The addresses of the program, and the token that opens them, from the page's own address: the token is in its part behind # (docs/service.md). */
export class Service {
  /** @param {{ protocol: string, host: string, hash: string }} location */
  constructor({ protocol, host, hash }) {
    this.base = `${protocol}//${host}`;
    this.socketBase = `${protocol === "https:" ? "wss:" : "ws:"}//${host}`;
    this.setToken(new URLSearchParams(hash.replace(/^#/, "")).get("token") ?? "");
  }

  // A token that no server can have given is left out: the server will ask for one.
  setToken(token) {
    this.token = TOKEN.test(token) ? token : "";
  }

  /** @returns {Record<string, string>} */
  get headers() {
    return this.token ? { Authorization: `Bearer ${this.token}` } : {};
  }

  pathOf(map) {
    return `/v1/maps/${encodeURIComponent(map)}`;
  }

  // Address and subprotocols of a WebSocket. A browser sends no headers of ours with it: a subprotocol carries the token.
  socket(path) {
    return { url: this.socketBase + path, protocols: this.token ? ["oaslam", `oaslam.token.${this.token}`] : ["oaslam"] };
  }

  socketOf(map, kind) {
    return this.socket(`${this.pathOf(map)}/${kind}`);
  }

  // Throws a Refusal, or another error where there is no answer.
  async get(path) {
    const response = await fetch(this.base + path, { headers: this.headers });
    const body = await response.json().catch(() => ({}));
    if (response.ok) return body;
    throw new Refusal(body.error ?? `the server answers ${response.status}`, response.status);
  }

  async maps() {
    return (await this.get("/v1/maps")).maps;
  }

  // Why a connection to a map fails, in words for a person; null where the server does not answer.
  async whyNot(map, kind) {
    try {
      if (kind === "record") await this.maps();
      else await this.get(this.pathOf(map));
      return "the server ended the connection";
    } catch (error) {
      if (!(error instanceof Refusal)) return null;
      return error.isAboutToken ? "the token is missing, or not allowed to do this" : error.message;
    }
  }
}
