// weight · x + bias, where all the time goes: more than a million products a frame. In plain JavaScript four
// rows at once, and two characters at once, so that a number that was fetched is used often; simd.js is faster.
import { SimdLayer } from "./simd.js";

/** A linear layer and what it said last. */
export class Linear {
  /** `layer` from weights.js; its rows are a multiple of four. */
  constructor(layer) {
    this.layer = layer;
    this.outputs = [];
  }

  /** An output for each character's input. The next call writes over it. */
  of(inputs) {
    const outputs = inputs.map((_, k) => (this.outputs[k] ??= new Float32Array(this.layer.rows)));
    if (this.layer instanceof SimdLayer) this.layer.affine(inputs, outputs);
    else affine(this.layer, inputs, outputs);
    return outputs;
  }
}

/** outputs[k] = weight · inputs[k] + bias for every character k. */
function affine({ weight, bias, columns }, inputs, outputs) {
  let k = 0;
  for (; k + 1 < inputs.length; k += 2) two(weight, bias, columns, inputs[k], outputs[k], inputs[k + 1], outputs[k + 1]);
  if (k < inputs.length) one(weight, bias, columns, inputs[k], outputs[k]);
}

function one(weight, bias, n, x, y) {
  for (let row = 0; row < bias.length; row += 4) {
    let p = bias[row], q = bias[row + 1], r = bias[row + 2], s = bias[row + 3];
    const a = row * n, b = a + n, c = b + n, d = c + n;
    for (let i = 0; i < n; i++) {
      const v = x[i];
      p += weight[a + i] * v;
      q += weight[b + i] * v;
      r += weight[c + i] * v;
      s += weight[d + i] * v;
    }
    y[row] = p, y[row + 1] = q, y[row + 2] = r, y[row + 3] = s;
  }
}

function two(weight, bias, n, x, y, u, z) {
  for (let row = 0; row < bias.length; row += 4) {
    let p = bias[row], q = bias[row + 1], r = bias[row + 2], s = bias[row + 3];
    let e = p, f = q, g = r, h = s;
    const a = row * n, b = a + n, c = b + n, d = c + n;
    for (let i = 0; i < n; i++) {
      const v = x[i], t = u[i];
      const k = weight[a + i], l = weight[b + i], m = weight[c + i], o = weight[d + i];
      p += k * v, q += l * v, r += m * v, s += o * v;
      e += k * t, f += l * t, g += m * t, h += o * t;
    }
    y[row] = p, y[row + 1] = q, y[row + 2] = r, y[row + 3] = s;
    z[row] = e, z[row + 1] = f, z[row + 2] = g, z[row + 3] = h;
  }
}
