// How fast time passes for who looks: slower than it should where pictures come late, whatever a frame costs to make.
const GONE = 2; // seconds between pictures; after more somebody was away, and nothing was slow
const LEAST = 0.5; // seconds that must have been seen
const SLOW = 0.8; // of the pace of time; slower is said

export class Pace {
  constructor() {
    Object.assign(this, { last: null, real: 0, seen: 0 });
  }

  /** A picture at `now` (milliseconds), for which `seconds` of the motion passed. */
  picture(now, seconds) {
    const real = (now - this.last) / 1000;
    if (this.last !== null && real < GONE) {
      this.real += real;
      this.seen += seconds;
    }
    this.last = now;
  }

  /** Nothing moves. */
  rest() {
    this.last = null;
  }

  /** Of the pace of time, since this was asked last; 1 where nobody looked. */
  take() {
    const { seen, real } = this;
    Object.assign(this, { seen: 0, real: 0 });
    return real > LEAST ? seen / real : 1;
  }
}

/** A sentence on time that passes at a share `pace` of its own; none where it is fast enough. */
export const late = (pace) => (pace < SLOW ? ` Pictures come late on this machine, and time passes at ${pace.toFixed(1)} of its pace.` : "");
