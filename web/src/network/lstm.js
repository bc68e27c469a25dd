// An LSTM layer, a frame at a time.
import { Linear } from "./affine.js";
import { SimdLayer } from "./simd.js";

const sigmoid = (x) => 1 / (1 + Math.exp(-x));

export class Lstm {
  /** `layer` multiplies [from below, own h] in one go; `depth` says which of a state's memories are its own. */
  constructor(layer, depth) {
    this.gates = new Linear(layer);
    this.depth = depth;
    this.width = layer.rows / 4;
    this.below = layer.columns - this.width;
    this.joined = [];
  }

  /** Every state remembers what its character's `inputs` bring. */
  step(inputs, states) {
    states.forEach(({ hidden }, k) => {
      this.joined[k] ??= new Float32Array(this.below + this.width);
      this.joined[k].set(inputs[k]);
      this.joined[k].set(hidden[this.depth], this.below);
    });
    const gates = this.gates.of(this.joined.slice(0, states.length));
    const faster = this.gates.layer instanceof SimdLayer ? this.gates.layer : this;
    states.forEach(({ hidden, cell }, k) => faster.remember(gates[k], hidden[this.depth], cell[this.depth]));
  }

  /** `gates` holds input, forget, cell and output, one after the other, as torch's. */
  remember(gates, hidden, cell) {
    const n = this.width;
    for (let i = 0; i < n; i++) {
      cell[i] = sigmoid(gates[n + i]) * cell[i] + sigmoid(gates[i]) * Math.tanh(gates[2 * n + i]);
      hidden[i] = sigmoid(gates[3 * n + i]) * Math.tanh(cell[i]);
    }
  }
}
