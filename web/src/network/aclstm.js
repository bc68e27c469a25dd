// The dancer of motionlab/models/aclstm.py, a frame at a time: LSTM - LSTM - LSTM - FC.
// Everything here is in normalised units.
import { Linear } from "./affine.js";
import { Lstm } from "./lstm.js";

export class AcLstm {
  /** `layers` and `settings` (kept, staircase) from weights.js. */
  constructor({ lstm, leave }, { kept, staircase }) {
    this.lstm = lstm.map((layer, depth) => new Lstm(layer, depth));
    this.leave = new Linear(leave);
    this.kept = kept;
    this.certain = true; // there is no chance in it: what follows is one frame
    // On a staircase a layer sees what the one below said a frame before: it goes first.
    this.order = staircase ? [...this.lstm].reverse() : this.lstm;
  }

  /** The frame that follows after each of the states (an array) has seen its `input`. */
  step(states) {
    for (const layer of this.order) {
      layer.step(states.map(({ input, hidden }) => hidden[layer.depth - 1] ?? input), states);
    }
    return this.predict(states);
  }

  /** The frame that follows each state, without another step. */
  predict(states) {
    const numbers = this.leave.of(states.map(({ hidden }) => hidden.at(-1)));
    return numbers.map((frame) => frame.slice(0, this.kept)); // rows are filled up to a multiple of four
  }

  /** What follows, as it is. */
  draw({ next }) {
    return next;
  }
}
