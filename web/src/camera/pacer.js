// When the next image is sent: at the pace at which answers come back. One is on the way while another is worked at; never more.
const MAX_IN_FLIGHT = 2;
const PATIENCE_MS = 4000; // then the answer is taken for lost

export class Pacer {
  constructor() {
    this.reset();
  }

  reset() {
    this.flying = []; // { id, at }, oldest first
    this.roundTrip = null; // ms, smoothed
  }

  // The second follows the first after half a round trip, so that answers come evenly.
  maySend(now) {
    this.flying = this.flying.filter(({ at }) => now - at < PATIENCE_MS);
    if (this.flying.length === 0) return true;
    return this.flying.length < MAX_IN_FLIGHT && this.roundTrip !== null && now - this.flying.at(-1).at >= this.roundTrip / 2;
  }

  sent(id, now) {
    this.flying.push({ id, at: now });
  }

  // An answer is also one to all images before, which were dropped.
  answered(id, now) {
    const image = this.flying.find((each) => each.id === id);
    if (image) this.roundTrip = this.roundTrip === null ? now - image.at : 0.8 * this.roundTrip + 0.2 * (now - image.at);
    this.flying = this.flying.filter((each) => each.id > id);
  }
}
