// The refiner of motionlab/models/refiner.py, a frame at a time: FC - LSTM - FC, and the motion itself added.
// It sees, beside a generator's frame, where hands, toes and head are and how they move, and corrects it.
import { Linear } from "./affine.js";
import { Lstm } from "./lstm.js";

const TOES = 2; // of the end effectors, which they begin
const STEPS = 2; // of the last layer's numbers: how far aside and ahead the root should be

export class Refiner {
  /** `weights` as weights.js reads them; `encoding`: JointAngles; `normalizer`: with denormalize and normalize of rows. */
  constructor({ layers, settings, effectors }, encoding, normalizer) {
    Object.assign(this, { effectors, encoding, normalizer, ...settings }); // fps, kept, reach, slow
    [this.enter, this.leave] = [new Linear(layers.enter[0]), new Linear(layers.leave)];
    this.lstm = new Lstm(layers.lstm[0], 0);
  }

  /** What it remembers at the beginning of a motion: its first frame was there before as well. */
  begin(row) {
    const { width } = this.lstm;
    const memory = { hidden: [new Float32Array(width)], cell: [new Float32Array(width)], points: this.points(row) };
    memory.offset = this.offset(this.leave.of(memory.hidden)[0]);
    return memory;
  }

  /** Rows (an array, one a character) as they should have been; their memories go on. */
  refine(rows, memories) {
    const normalized = rows.map((row) => this.normalizer.normalize(row));
    const seen = rows.map((row, k) => Float32Array.from([...normalized[k], ...this.felt(row, memories[k])]));
    const entered = this.enter.of(seen).map((values) => values.map((value) => Math.max(value, 0)));
    this.lstm.step(entered, memories);
    const said = this.leave.of(memories.map(({ hidden }) => hidden[0]));
    return rows.map((row, k) => {
      const refined = this.normalizer.denormalize(normalized[k].map((value, i) => value + said[k][i]));
      if (this.reach) refined.set(this.steps(row, said[k], memories[k]));
      return refined;
    });
  }

  /** Where the end effectors are, seen from the ground below the root: x y z each. */
  points(row) {
    const { encoding, effectors } = this;
    const all = encoding.points(row, encoding.begin(), new Float64Array(3 * encoding.count));
    return effectors.joints.map((joint) => all.slice(3 * joint, 3 * joint + 3));
  }

  /** What it sees of them: places and velocities over the ground, and those of toes once more, enlarged. */
  felt(row, memory) {
    const { effectors, fps, slow } = this;
    const [left, ahead, turn] = row;
    const points = this.points(row);
    const velocities = points.map(([x, y, z], i) => {
      const [u, v, w] = memory.points[i];
      const before = turned(u - left, w - ahead, -turn); // where it was, seen from here
      return [fps * (x - before[0]), fps * (y - v), fps * (z - before[1])];
    });
    memory.points = points;
    const moving = points.flatMap((point, i) => [...point, ...velocities[i]]);
    const toes = slow ? velocities.slice(0, TOES).flat().map((speed) => Math.asinh(speed / slow)) : [];
    return [...moving.map((value, i) => (value - effectors.mean[i]) / effectors.std[i]), ...toes];
  }

  /** Metres aside and ahead that the root should be from its place, in its heading. */
  offset(said) {
    return Array.from(said.slice(this.kept, this.kept + STEPS), (value) => this.reach * Math.tanh(value));
  }

  /** Steps and turn of a root that was, and is, so far from its place. */
  steps([left, ahead, turn], said, memory) {
    const before = memory.offset;
    memory.offset = this.offset(said);
    // a step is seen from the frame before it, and so is the offset of now, turned back to there
    const [x, z] = turned(...memory.offset, turn);
    return [left + x - before[0], ahead + z - before[1], turn];
  }
}

/** x and z turned about the vertical by `yaw` radians, +z towards +x. */
function turned(x, z, yaw) {
  const [sine, cosine] = [Math.sin(yaw), Math.cos(yaw)];
  return [x * cosine + z * sine, z * cosine - x * sine];
}
