import { Client, isToken } from "./client/client.js";

/**
 * The program that a page came from, and the token that opens it, by the page's own address: its path leads to the program, where a proxy may give
 * it one, and the token is in its part behind # (docs/service.md).
 */
export class Service extends Client {
  /** @param {{ protocol: string, host: string, pathname: string, hash: string }} location  @param {string} [page] the path that the program has for the page, besides / */
  constructor({ protocol, host, pathname, hash }, page = "/") {
    super(`${protocol}//${host}${pathname.endsWith(page) ? pathname.slice(0, -page.length) : pathname}`);
    this.setToken(new URLSearchParams(hash.replace(/^#/, "")).get("token") ?? "");
  }

  // A token that no server can have given is left out: the server will ask for one.
  setToken(token) {
    this.token = isToken(token) ? token : "";
  }

  // Why a connection to a map fails, in words for a person; null where the server does not answer.
  async whyNot(map, kind) {
    const problem = await this.problemOf(map, kind);
    if (!problem) return "the server ended the connection";
    if (problem.status === null) return null;
    return problem.isAboutToken ? "the token is missing, or not allowed to do this" : problem.message;
  }
}
