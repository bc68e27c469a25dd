// The weights as motionlab/viewer/live/network_weights.py writes them, read back. They come as a script,
// because a page opened from disk may load scripts and nothing else.

const SHELF = "motionlabWeights"; // where the scripts put what they bring

/** Load a script of weights; the promise fails with a plain sentence. */
export function loadWeights({ name, script }) {
  const there = globalThis[SHELF]?.[name];
  if (there) return Promise.resolve(there);
  // pages of a book may lie in folders; the theme says where the root is
  const root = document.documentElement.dataset.content_root ?? "";
  const element = Object.assign(document.createElement("script"), { src: root + script });
  return new Promise((resolve, reject) => {
    element.onload = () => (globalThis[SHELF]?.[name] ? resolve(globalThis[SHELF][name]) : reject(new Error(`${script} holds no weights named ${name}.`)));
    element.onerror = () => reject(new Error(`The weights are missing: ${script} is not beside this page.`));
    document.head.append(element);
  });
}

/** Bytes of base64 text as an array of the given kind. */
function numbers(text, Kind) {
  const raw = atob(text);
  const bytes = new Uint8Array(raw.length);
  for (let i = 0; i < raw.length; i++) bytes[i] = raw.charCodeAt(i);
  return new Kind(bytes.buffer);
}

const floats = (text) => numbers(text, Float32Array);

/** A matrix whose rows are a multiple of four (see affine.js); int8 rows have a scale each. */
function readLayer({ columns, bias, weight, scales }) {
  const given = floats(bias);
  const rows = 4 * Math.ceil(given.length / 4);
  const layer = { rows, columns, bias: new Float32Array(rows), weight: new Float32Array(rows * columns) };
  layer.bias.set(given);
  if (!scales) {
    layer.weight.set(floats(weight));
    return layer;
  }
  const scale = floats(scales);
  const small = numbers(weight, Int8Array);
  for (let at = 0; at < small.length; at++) layer.weight[at] = small[at] * scale[Math.floor(at / columns)];
  return layer;
}

/** All that a Dreamer needs: the network, the body's encoding, and states to start from. */
export function readWeights(file) {
  const { kind, fps, kept, encoding } = file;
  const { enter, lstm, leave } = file.layers;
  const starts = file.starts.map(({ name, frame, hidden, cell, noise }) => ({ name, frame: floats(frame), hidden: floats(hidden), cell: floats(cell), noise: floats(noise) }));
  return {
    kind,
    fps,
    starts,
    encoding,
    layers: { enter: enter.map(readLayer), lstm: lstm.map(readLayer), leave: readLayer(leave) },
    settings: { ...file.settings, kept: kept.length },
    normalizer: { kept, mean: floats(file.mean), std: floats(file.std) },
  };
}
