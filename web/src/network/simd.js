// Layers whose weights are whole numbers of a byte, worked out by simd.wat where a browser can: eight times as
// fast as plain JavaScript, and as exact. Whatever they are multiplied with is rounded twice: to whole numbers
// of 14 bits or 15 and a sign, and what is lacking then, too. With the first alone, a thing that is fed back
// to itself (a motion) is another after a second.
import bytes from "./simd.wat";

const ROWS = 16; // that simd.wat has at once; layers are filled up with zeros
const MOST = 32767; // of 16 bits
const MOST_SUM = 2 ** 31 - 1;
const MOST_WEIGHT = 127; // see network_weights.py
const PAGE = 65536; // bytes that a memory is measured in

let module; // compiled once a page

const filled = (count, by) => by * Math.ceil(count / by);
const end = (array) => array.byteOffset + array.byteLength;

/** simd.wat with a memory of so many bytes; null if browser or page forbid it, or there is no room. */
function begin(size) {
  try {
    if (!globalThis.WebAssembly?.validate(bytes)) return null;
    module ??= new WebAssembly.Module(bytes);
    const memory = new WebAssembly.Memory({ initial: Math.ceil(size / PAGE) });
    return { memory, code: new WebAssembly.Instance(module, { network: { memory } }).exports };
  } catch {
    return null;
  }
}

/** A network's layers (rows, columns, bias, whole, scales) for simd.wat, in a memory of its own; null if that can't be. */
export function simdLayers(layers) {
  if (layers.some(({ whole }) => !whole)) return null;
  const begun = begin(layers.flatMap(parts).reduce((sum, part) => sum + bytesOf(part), 0));
  if (!begun) return null;
  const { memory, code } = begun;
  let used = 0;
  return layers.map((layer) => {
    const arrays = parts(layer).map((part) => {
      const [name, Kind, count] = part;
      const array = new Kind(memory.buffer, used, count);
      used += bytesOf(part);
      return [name, array];
    });
    return new SimdLayer(layer, Object.fromEntries(arrays), code);
  });
}

/** What a layer needs of a memory: name, kind of array, how many. */
function parts({ rows, columns }) {
  const [tall, wide] = [filled(rows, ROWS), filled(columns, 4)];
  const units = filled(rows / 4, 4); // of an LSTM
  return [
    ["weights", Int8Array, tall * filled(columns, 2)],
    ["scales", Float32Array, tall],
    ["biases", Float32Array, tall],
    ["input", Float32Array, wide],
    ["rounded", Int16Array, 2 * wide],
    ["output", Float32Array, tall],
    ["cell", Float32Array, units],
    ["hidden", Float32Array, units],
  ];
}

const bytesOf = ([, Kind, count]) => filled(count * Kind.BYTES_PER_ELEMENT, 16);

export class SimdLayer {
  /** `arrays` of the memory, by the names above; `code` is what simd.wat exports. */
  constructor({ rows, columns, bias, whole, scales }, arrays, code) {
    Object.assign(this, { rows, columns, arrays, code });
    this.said = arrays.output.subarray(0, rows);
    this.most = Math.min(Math.floor(MOST_SUM / (MOST_WEIGHT * columns)), MOST); // no sum of so many is too large
    arrays.scales.set(scales);
    arrays.biases.set(bias);
    for (let at = 0; at < whole.length; at++) arrays.weights[this.place(Math.floor(at / columns), at % columns)] = whole[at];
  }

  /** Where simd.wat looks for a weight: sixteen rows of two columns, of the next two, and so on. */
  place(row, column) {
    const [within, odd] = [row % ROWS, column % 2];
    return (row - within) * filled(this.columns, 2) + (column - odd) * ROWS + 2 * within + odd;
  }

  /** outputs[k] = weight · inputs[k] + bias for every character k; all NaN where an input is no number. */
  affine(inputs, outputs) {
    const { weights, scales, biases, input, rounded, output } = this.arrays;
    const last = rounded.byteOffset + 4 * filled(this.columns, 2);
    inputs.forEach((values, k) => {
      input.set(values);
      const unit = this.code.round(input.byteOffset, end(input), rounded.byteOffset, this.most);
      this.code.affine(
        weights.byteOffset, scales.byteOffset, biases.byteOffset, rounded.byteOffset, last, output.byteOffset, end(output),
        unit, unit / (2 * this.most),
      );
      outputs[k].set(this.said);
    });
  }

  /** What an LSTM remembers, as `remember` in lstm.js. */
  remember(gates, hidden, cell) {
    const { output, cell: kept, hidden: told } = this.arrays;
    output.set(gates);
    kept.set(cell);
    this.code.remember(output.byteOffset, cell.byteLength, kept.byteOffset, end(kept), told.byteOffset);
    cell.set(kept.subarray(0, cell.length));
    hidden.set(told.subarray(0, hidden.length));
  }
}
