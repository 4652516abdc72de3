import { tokenOf } from "../connection.js";

const TOKEN = /^[A-Za-z0-9._~-]+$/; // what a subprotocol takes

// The addresses of the service, and the token that opens them: what stands behind # in the page's address (docs/service.md).
export class Service {
  constructor({ protocol, host, hash }) {
    this.base = `${protocol}//${host}`;
    this.socketBase = `${protocol === "https:" ? "wss:" : "ws:"}//${host}`;
    this.setToken(tokenOf(hash));
  }

  // One that cannot be is none: the server will ask for it.
  setToken(token) {
    this.token = TOKEN.test(token) ? token : "";
  }

  get headers() {
    return this.token ? { Authorization: `Bearer ${this.token}` } : {};
  }

  pathOf(map) {
    return `/v1/maps/${encodeURIComponent(map)}`;
  }

  // Of a WebSocket. It can have no headers: the token is a subprotocol.
  socketOf(map, kind) {
    return { url: `${this.socketBase}${this.pathOf(map)}/${kind}`, protocols: this.token ? ["oaslam", `oaslam.token.${this.token}`] : ["oaslam"] };
  }

  // Throws an Error with `status` where there is an answer that says no.
  async get(path) {
    const response = await fetch(this.base + path, { headers: this.headers });
    const body = await response.json().catch(() => ({}));
    if (response.ok) return body;
    throw Object.assign(new Error(body.error ?? `the server answers ${response.status}`), { status: response.status });
  }

  async maps() {
    return (await this.get("/v1/maps")).maps;
  }

  // Why a connection to a map does not come about, for a person; null where nothing is to be heard.
  async whyNot(map, kind) {
    try {
      if (kind === "record") await this.maps();
      else await this.get(this.pathOf(map));
      return "the server ended the connection";
    } catch (error) {
      if (error.status === undefined) return null;
      return error.status === 401 || error.status === 403 ? "the token is missing, or not allowed to do this" : error.message;
    }
  }
}
