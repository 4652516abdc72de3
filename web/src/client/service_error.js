/** The service refused a request or did not answer it, or told of an error in a stream. `message` is the sentence of the service. */
export class ServiceError extends Error {
  name = "ServiceError";

  /**
   * @param {number | null} status of HTTP; null where there was no answer, and for an error that was told in a stream
   * @param {string} message
   * @param {number | null} [retryAfter] seconds after which it may be tried again, for 503
   */
  constructor(status, message, retryAfter = null) {
    super(message);
    this.status = status;
    this.retryAfter = retryAfter;
  }

  /** Whether the token is missing, or not allowed to do this. */
  get isAboutToken() {
    return this.status === 401 || this.status === 403;
  }

  /** Of an answer that is not 2xx. @param {Response} response */
  static async ofResponse(response) {
    const text = (await response.text().catch(() => "")).trim();
    const wait = response.status === 503 ? Number(response.headers.get("Retry-After")) || 1 : null;
    return new ServiceError(response.status, sentenceOf(text) || `the server answers ${response.status}`, wait);
  }

  /** @param {string} url  @param {any} error what fetch threw */
  static unreachable(url, error) {
    const why = error.name === "TimeoutError" ? "no answer in time" : error.cause?.code ?? error.message;
    return new ServiceError(null, `${url}: ${why}`);
  }
}

/** @param {string} text JSON, or a text as of what stands before the service */
function sentenceOf(text) {
  try {
    return String(JSON.parse(text).error);
  } catch {
    return text.startsWith("<") ? "" : text;
  }
}
