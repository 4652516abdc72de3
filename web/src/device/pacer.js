const MOST_ON_THE_WAY = 3; // where a network is slow: the server answers the newest
const PATIENCE = 4000; // ms after which an answer is considered lost

/**
 * Tells when the next image is sent: the next one when the last one is answered, but not before `interval` ms have passed. Where answers take longer than
 * that, a second and a third image are on their way meanwhile.
 */
export class Pacer {
  /** @type {{ id: number, at: number }[]} */ flying = []; // images without an answer, oldest first
  last = -Infinity; // when an image was sent

  reset() {
    this.flying = [];
    this.last = -Infinity;
  }

  /** @param {number} now ms  @param {number} interval ms between two images, where answers come at once  @param {number} slow ms after which the next one goes without an answer */
  maySend(now, interval, slow = Infinity) {
    this.flying = this.flying.filter(({ at }) => now - at < PATIENCE);
    const waited = now - this.last;
    if (this.flying.length === 0) return waited >= interval;
    return this.flying.length < MOST_ON_THE_WAY && waited >= Math.max(interval, slow);
  }

  sent(id, now) {
    this.flying.push({ id, at: now });
    this.last = now;
  }

  givenUp(id) {
    this.flying = this.flying.filter((each) => each.id !== id);
  }

  // The server has dropped all images before the one that it answers.
  answered(id) {
    this.flying = this.flying.filter((each) => each.id > id);
  }
}
