// Wishes that are heard late, as over a slow line.

export class Delayed {
  constructor() {
    this.said = []; // {at, wish}, oldest first; only the first may have been heard already
  }

  /** `wish` is said at frame `now` (of the motion, it need not be whole); the one that is heard now, of `late` frames ago, or null. */
  hear(now, wish, late) {
    if (this.said.at(-1)?.at >= now) this.said = this.said.filter(({ at }) => at < now); // he pauses, or begins anew
    this.said.push({ at: now, wish });
    while (this.said[1]?.at <= now - late) this.said.shift();
    const [first] = this.said;
    return first.at <= now - late ? first.wish : null;
  }
}
