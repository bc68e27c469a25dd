// What becomes of a drawn frame before the network sees it: motionlab/solvers/live_frame.py. A push may lead a network
// to where no data were; so a frame is kept to what bodies do, and its step to what is asked and a stride's sway.
import { clamp, STANDING } from "../network/going.js";
import { pickStart } from "../network/guided.js";

const LIMIT = 4; // deviations of the data
const [SWAY, BRAKES] = [0.4, 1.3]; // m/s: that a stride sways; that is gone slower, sway aside
const [SWING, SLOWER] = [1.2, 2]; // the same of a turn, rad/s
const [ASIDE, BACK] = [0.6, 0.2]; // m/s at most: who is steered turns and goes ahead, and is not dragged
export const READY = 0.6; // m/s; who stops and is slower brings his feet together
const [DAMPED, PULLED] = [0.6, 0.15]; // shares, of their moves that is taken, of what lacks to a stand, a frame
const [SLIDES, RESTS] = [0.5, [0.2, 0.5]]; // share of his pace at which a foot rests at most; m/s of that
const GLIDES = 0.3; // seconds without: a run's flight is shorter

/**
 * Make a frame `input`, normalised, what a body can do who is asked for this, in place. `columns`: those of the step to
 * the left, the step ahead and the turn; `going`: before the frame; `speed` m/s and `bend` rad/s that are asked for.
 */
export function bound(input, columns, { mean, std }, going, { speed, bend }) {
  for (let i = 0; i < input.length; i++) input[i] = clamp(input[i], -LIMIT, LIMIT);
  const [left, ahead, turn] = columns.map((column, i) => (input[column] * std[i] + mean[i]) * going.fps); // a second
  const most = Math.max(speed, going.pace - BRAKES) + SWAY;
  const share = Math.min(most / Math.max(Math.hypot(left, ahead), 1e-9), 1);
  const mostTurn = Math.max(Math.abs(bend), Math.abs(going.turn) - SLOWER) + SWING;
  const root = [clamp(share * left, -ASIDE, ASIDE), Math.max(share * ahead, -BACK), clamp(turn, -mostTurn, mostTurn)];
  columns.forEach((column, i) => { input[column] = (root[i] / going.fps - mean[i]) / std[i]; });
}

/** The body of who comes to stand moves less than was drawn, and towards a `stand` (normalised, or null), in place. */
export function settle(input, last, body, stand) {
  for (let i = 0; i < input.length; i++) {
    if (body[i]) input[i] = last[i] + (1 - DAMPED) * (input[i] - last[i]) + (stand ? PULLED * (stand[i] - last[i]) : 0);
  }
}

/** Who goes on without that a foot rests is reminded of how people step: what he remembers is then that of a start. */
export class Gliding {
  /** `parts` as of LiveControl, with the network's `starts`. */
  constructor(parts) {
    Object.assign(this, { parts, frames: 0, reminded: 0 }); // frames that he has glided for
  }

  /** What he remembers who glides too long by now, in place: `best` of the futures, whose rows came after `before`. */
  remind(best, before) {
    const { encoding, feet, fps, starts, network, layers } = this.parts;
    let place = { x: 0, z: 0, yaw: 0 };
    let last = feet.seen(before, place);
    const rests = clamp(SLIDES * best.going.pace, ...RESTS);
    let rested = false;
    for (const row of best.rows) {
      place = encoding.walk(place, row);
      const now = feet.seen(row, place);
      rested ||= fps * feet.slowest(last, now) < rests;
      last = now;
    }
    this.frames = rested ? 0 : this.frames + best.rows.length;
    if (this.frames < GLIDES * fps) return;
    const pace = best.going.pace;
    const standing = starts.find(({ name }) => pace < STANDING && name === "stand");
    const start = standing ?? starts[pickStart(starts, pace, fps)];
    Object.assign(best, { hidden: layers(start.hidden), cell: layers(start.cell) });
    [best.next] = network.predict([best]);
    this.frames = 0;
    this.reminded++;
  }
}
