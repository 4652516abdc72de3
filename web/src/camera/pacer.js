// Two images: one is on its way while the server works at the other.
const MAX_IN_FLIGHT = 2;
const PATIENCE_MS = 4000; // after which an answer is considered lost

/** Tells when the next image is sent: at the pace of the answers. */
export class Pacer {
  /** @type {{ id: number, at: number }[]} */ flying = []; // images without an answer, oldest first
  /** @type {number | null} */ roundTrip = null; // ms, smoothed

  reset() {
    this.flying = [];
    this.roundTrip = null;
  }

  // The second follows the first after half a round trip, so that answers come evenly.
  maySend(now) {
    this.flying = this.flying.filter(({ at }) => now - at < PATIENCE_MS);
    const last = this.flying.at(-1);
    if (!last) return true;
    return this.flying.length < MAX_IN_FLIGHT && this.roundTrip !== null && now - last.at >= this.roundTrip / 2;
  }

  sent(id, now) {
    this.flying.push({ id, at: now });
  }

  // The server has dropped all images before the one that it answers.
  answered(id, now) {
    const image = this.flying.find((each) => each.id === id);
    if (image) this.roundTrip = this.roundTrip === null ? now - image.at : 0.8 * this.roundTrip + 0.2 * (now - image.at);
    this.flying = this.flying.filter((each) => each.id > id);
  }
}
