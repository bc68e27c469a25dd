// How badly feet slide and how far joints leave their range, in nats: the terms `resting`, `contact`, `planted` and
// `poses` of motionlab/solvers/terms.py, by which futures are chosen. Frame by frame, so that nothing has to be kept.

const [SLIDE, HEIGHT] = [0.004, 0.008]; // m a frame, m
const REST = 0.006; // m a frame
const SLOW = 0.45; // m/s
const POSE = 0.03; // rad and m
const PLANTED = 0.3; // m/s of the slowest part of the feet
const GROUND = [0, 2];

const square = (value) => value * value;

export class FeetEnergy {
  /**
   * `encoding`: JointAngles; `fps`; `body` as motionlab/viewer/live/steer_settings.py says it: `feet` (points: left heel,
   * left toe, right heel, right toe), `low` (heights at rest of both toes, metres), `ranges` {first, low, high}
   * of channels from `first` on, or null where nothing is known of them.
   */
  constructor(encoding, fps, body) {
    Object.assign(this, { encoding, fps, ...body, scratch: new Float64Array(3 * encoding.count) });
  }

  /** What is known of a row at a place: where feet are, and which toes are down. */
  seen(row, place) {
    const points = this.encoding.points(row, place, this.scratch);
    const { contacts } = this.encoding;
    return {
      feet: this.feet.map((point) => [0, 1, 2].map((axis) => points[3 * point + axis])),
      down: contacts === null ? null : [row[contacts] > 0.5, row[contacts + 1] > 0.5],
    };
  }

  /** Nats of a row that is `now`, and was `before`. */
  nats(row, before, now) {
    let sum = 0;
    const moves = now.feet.map((foot, i) => foot.map((value, axis) => value - before.feet[i][axis]));
    for (const move of moves) {
      if (Math.hypot(...move) * this.fps < SLOW) for (const axis of GROUND) sum += square(move[axis] / REST) / 2;
    }
    sum += square((this.slowest(before, now) * this.fps) / PLANTED) / 2;
    if (now.down) {
      now.down.forEach((down, side) => {
        if (!down) return;
        const toe = 2 * side + 1;
        if (before.down[side]) for (const axis of GROUND) sum += square(moves[toe][axis] / SLIDE) / 2;
        sum += square((now.feet[toe][1] - this.low[side]) / HEIGHT) / 2;
      });
    }
    return sum + this.beyond(row);
  }

  /** Metres over the ground that the part of the feet moved that moved least. */
  slowest(before, now) {
    return Math.min(...now.feet.map((foot, i) => Math.hypot(...GROUND.map((axis) => foot[axis] - before.feet[i][axis]))));
  }

  /** Nats of what lies outside its range. */
  beyond(row) {
    if (!this.ranges) return 0;
    const { first, low, high } = this.ranges;
    let sum = 0;
    for (let i = 0; i < low.length; i++) {
      const value = row[first + i];
      sum += square(Math.max(low[i] - value, value - high[i], 0) / POSE) / 2;
    }
    return sum;
  }
}

/** A row with each joint's numbers brought back into their range, in place: metrics/broken.py. */
export function within(row, body) {
  if (!body.ranges) return row;
  const { first, low, high, joints } = body.ranges; // height and tilt are left as they are
  for (let at = joints; at < first + low.length; at++) row[at] = Math.min(Math.max(row[at], low[at - first]), high[at - first]);
  return row;
}
