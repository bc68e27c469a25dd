// The generator of motionlab/models/lstm_gmm.py, a frame at a time: FC - FC - LSTM - LSTM - FC.
// Everything here is in normalised units.
import { affine } from "./affine.js";
import { toMixture } from "./mixture.js";

const relu = (x) => Math.max(x, 0);
const sigmoid = (x) => 1 / (1 + Math.exp(-x));

export class LstmGmm {
  /** `weights` from weights.js. */
  constructor(weights) {
    Object.assign(this, weights); // width, components, kept, skip, reach, floor, layers
    this.scratch = [];
  }

  /** The states of characters (an array) after each has seen its `input`, and what may follow. */
  step(states) {
    const rooms = states.map((_, k) => (this.scratch[k] ??= this.room()));
    const { enter, lstm, leave } = this.layers;
    affine(enter[0], states.map((state) => state.input), rooms.map((room) => room.first));
    for (const room of rooms) apply(relu, room.first);
    affine(enter[1], rooms.map((room) => room.first), rooms.map((room) => room.second));
    for (const room of rooms) apply(relu, room.second);
    lstm.forEach((layer, depth) => {
      states.forEach(({ hidden }, k) => {
        // [x, h] times one matrix instead of x and h times one each
        rooms[k].joined.set(depth ? hidden[depth - 1] : rooms[k].second);
        rooms[k].joined.set(hidden[depth], this.width);
      });
      affine(layer, rooms.map((room) => room.joined), rooms.map((room) => room.gates));
      states.forEach((state, k) => this.remember(rooms[k].gates, state.hidden[depth], state.cell[depth]));
    });
    affine(leave, states.map((state) => state.hidden[1]), rooms.map((room) => room.numbers));
    return states.map((state, k) => toMixture(rooms[k].numbers, state.input, this));
  }

  /** What may follow a state, without another step. */
  predict(state) {
    const { numbers } = (this.scratch[0] ??= this.room());
    affine(this.layers.leave, [state.hidden[1]], [numbers]);
    return toMixture(numbers, state.input, this);
  }

  /** One LSTM layer: `gates` holds input, forget, cell and output, one after the other, as torch's. */
  remember(gates, hidden, cell) {
    const n = this.width;
    for (let i = 0; i < n; i++) {
      cell[i] = sigmoid(gates[n + i]) * cell[i] + sigmoid(gates[i]) * Math.tanh(gates[2 * n + i]);
      hidden[i] = sigmoid(gates[3 * n + i]) * Math.tanh(cell[i]);
    }
  }

  room() {
    const { enter, lstm, leave } = this.layers;
    const sizes = { first: enter[0].rows, second: enter[1].rows, joined: 2 * this.width, gates: lstm[0].rows, numbers: leave.rows };
    return Object.fromEntries(Object.entries(sizes).map(([name, size]) => [name, new Float32Array(size)]));
  }
}

function apply(change, values) {
  for (let i = 0; i < values.length; i++) values[i] = change(values[i]);
}
