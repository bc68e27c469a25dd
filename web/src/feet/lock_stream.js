// Feet held still while motion comes, some frames behind it: motionlab/feet/lock_stream.py, for rows of JointAngles on the
// floor y = 0. Only legs and the root's height are changed; feet keep the way they point.
import { product, transposed, turned } from "../kinematics.js";
import { Foot } from "./holding.js";
import { apart, knee, needed, plus, toesUp, turn } from "./one_leg.js";

const SIDES = [0, 1]; // left, right
const [HIP, KNEE, ANKLE, TOES] = [0, 1, 2, 3];
const STAYS = [1, 0, 0, 0, 1, 0, 0, 0, 1];
const multiply = (a, b) => product(a, b, new Float64Array(9));
const moves = (shift) => shift.some((value) => value !== 0);

export class LockStream {
  /**
   * `known`, of motionlab/viewer/live/steer_settings.py: `joints` (upper leg, lower leg, foot, toes, each left and right),
   * `fronts` of knees in the frames of thighs, heights `flat` of resting toes, `ahead`, `settle` and `rules`, in frames.
   */
  constructor(encoding, fps, known) {
    Object.assign(this, { encoding, fps, ...known, waiting: [], peaks: null });
    const { parents, end_parents, end_offsets } = encoding.body;
    this.above = this.joints.map((part) => part.map((joint) => parents[joint]));
    this.tips = this.joints[TOES].map((joint) => end_offsets[end_parents.indexOf(joint)] ?? [0, 0, 0]);
    this.feet = SIDES.map(() => new Foot(this.rules));
    this.bell = bell(this.rules.sure);
    this.scratch = new Float64Array(3 * encoding.count);
  }

  /** Take a frame {row, place, ...}; gives the one of `ahead` frames ago, whose row is another now, or none: a list. */
  push(frame) {
    this.take(frame);
    return this.waiting.length > this.ahead ? [this.give()] : [];
  }

  /** The frames that wait, at the end of a stream. */
  finish() {
    return [...this.waiting].map(() => this.give());
  }

  // -- one frame ----------------------------------------------------------------------------------

  take(frame) {
    const { encoding: { turns, contacts }, joints, above, scratch } = this;
    this.encoding.points(frame.row, frame.place, scratch);
    const copied = (rows) => rows.map((row) => row.map((joint) => turns[joint].slice()));
    const [own, parent] = [copied(joints), copied(above)];
    const at = joints.map((part) => part.map((joint) => Array.from(scratch.slice(3 * joint, 3 * joint + 3))));
    const before = this.waiting.at(-1);
    this.waiting.push({
      frame, own, parent, at,
      fronts: SIDES.map((i) => turned(own[HIP][i], this.fronts[i])),
      tips: SIDES.map((i) => turned(own[TOES][i], this.tips[i])),
      down: SIDES.map((i) => frame.row[contacts + i] > 0.5),
      steps: SIDES.map((i) => (before ? apart(at[TOES][i], before.at[TOES][i]) : Infinity)),
      longest: SIDES.map((i) => apart(at[KNEE][i], at[HIP][i]) + apart(at[ANKLE][i], at[KNEE][i])),
    });
  }

  /** The oldest frame that waits, its feet locked. */
  give() {
    const shifts = SIDES.map((i) => this.shifts(i));
    const down = this.sink(shifts);
    return this.bend(this.waiting.shift(), SIDES.map((i) => shifts[i][0]), down);
  }

  /** How far one foot is to be moved, in this frame and, as it looks, in the next ones. */
  shifts(i) {
    const { waiting, fps, flat: { [i]: flat } } = this;
    const steps = [...waiting.map((one) => one.steps[i]), Infinity];
    const speeds = waiting.map((_, k) => fps * Math.min(steps[k], steps[k + 1]));
    const toes = waiting.map(({ at }) => at[TOES][i]);
    const shifts = this.feet[i].shifts(waiting.map(({ down }) => down[i]), speeds, toes, flat);
    shifts.forEach((shift, k) => { // no foot goes into the floor
      const lowest = Math.min(toes[k][1] - flat, waiting[k].at[ANKLE][i][1]) + shift[1];
      shift[1] += Math.max(-lowest, 0);
    });
    return shifts;
  }

  /**
   * Metres that the root comes down for both legs to reach their ankles: the most of what was needed lately and will be,
   * under a bell. Feet that ease into a contact may be short of their way, those that are held are not.
   */
  sink(shifts) {
    const { feet, settle } = this;
    const ahead = this.waiting.slice(0, this.rules.sure + 1).map((one, k) => SIDES.map((i) => (
      k < feet[i].easing ? 0 : needed(one.at[HIP][i], one.at[ANKLE][i], shifts[i][k], one.longest[i]))));
    const most = Math.max(...ahead.flat());
    const memory = settle + this.bell.length;
    this.peaks = [...(this.peaks ?? Array(memory).fill(most)), most].slice(-memory);
    if (!this.peaks.some(Boolean)) return 0;
    const last = this.peaks.length;
    const eased = this.bell.reduce((sum, share, k) => sum + share * Math.max(...this.peaks.slice(last - k - 1 - settle, last - k)), 0);
    return Math.max(eased, ...SIDES.filter((i) => feet[i].place).map((i) => ahead[0][i]));
  }

  /** The frame, its legs turned so that they reach their ankles. */
  bend({ frame, own, parent, at, fronts, tips }, shifts, down) {
    const lifts = SIDES.map((i) => toesUp(tips[i], at[TOES][i][1] + shifts[i][1]));
    const moved = down !== 0 || shifts.some(moves);
    if (!moved && !lifts.some(Boolean)) return frame;
    const row = frame.row.slice();
    row[3] -= down; // the root's height
    for (const i of SIDES) {
      const [thigh, shank] = moved ? this.turns(at.map((part) => part[i]), shifts[i], down, fronts[i]) : [STAYS, STAYS];
      const turns = [thigh, shank, STAYS, lifts[i] ?? STAYS];
      this.joints.forEach((part, p) => {
        // each joint in the frame of the one above, which has turned as well
        const relative = p ? multiply(transposed(turns[p - 1]), turns[p]) : turns[p];
        const local = multiply(transposed(parent[p][i]), multiply(relative, own[p][i]));
        row.set(this.encoding.numbersOf(part[i], local), this.encoding.columnOf(part[i]));
      });
    }
    return { ...frame, row };
  }

  /** Turns of one leg's thigh and shank, in the world. */
  turns([hip, kneeWas, ankle], shift, down, front) {
    if (down === 0 && !moves(shift)) return [STAYS, STAYS];
    const [thigh, shin] = [plus(kneeWas, -1, hip), plus(ankle, -1, kneeWas)];
    const reach = plus(plus(ankle, 1, shift), -1, hip);
    reach[1] += down;
    const there = knee(thigh, shin, reach, front);
    return [turn(thigh, there), turn(shin, plus(reach, -1, there))];
  }
}

/** Shares of a binomial bell of most + 1 frames. */
function bell(most) {
  const shares = [1];
  for (let k = 0; k < most; k++) shares.push((shares[k] * (most - k)) / (k + 1));
  return shares.map((share) => share / 2 ** most);
}
