// The weights as motionlab/viewer/live/network_weights.py writes them, read back. They come as a script,
// because a page opened from disk may load scripts and nothing else.
import { simdLayers } from "./simd.js";

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

/** A layer whose rows are a multiple of four (see affine.js): `weight`, or `whole` numbers and a scale a row. */
function readLayer({ columns, bias, weight, scales }) {
  const given = floats(bias);
  const rows = 4 * Math.ceil(given.length / 4);
  const layer = { rows, columns, bias: new Float32Array(rows) };
  layer.bias.set(given);
  if (scales) return { ...layer, whole: numbers(weight, Int8Array), scales: floats(scales) };
  layer.weight = new Float32Array(rows * columns);
  layer.weight.set(floats(weight));
  return layer;
}

/** The same with `weight`, for plain JavaScript. */
function multiplied({ whole, scales, ...layer }) {
  if (!whole) return layer;
  const weight = new Float32Array(layer.rows * layer.columns);
  for (let at = 0; at < whole.length; at++) weight[at] = whole[at] * scales[Math.floor(at / layer.columns)];
  return { ...layer, weight };
}

/** All layers of a network, for simd.wat where it can run. */
export function readLayers({ enter, lstm, leave }) {
  const read = [...enter, ...lstm, leave].map(readLayer);
  const layers = simdLayers(read) ?? read.map(multiplied);
  return { enter: layers.slice(0, enter.length), lstm: layers.slice(enter.length, -1), leave: layers.at(-1) };
}

/** A refiner of what the network makes (refiner.js), whose channels it shares. */
function readRefiner({ layers, settings, effectors }, fps, kept) {
  const { joints, mean, std } = effectors;
  return { layers: readLayers(layers), settings: { ...settings, fps, kept }, effectors: { joints, mean: floats(mean), std: floats(std) } };
}

/** All that a Dreamer needs: the network, the body's encoding, and states to start from. */
export function readWeights(file) {
  const { kind, fps, kept, encoding } = file;
  const starts = file.starts.map(({ name, frame, hidden, cell, noise }) => ({ name, frame: floats(frame), hidden: floats(hidden), cell: floats(cell), noise: floats(noise) }));
  return {
    kind,
    fps,
    starts,
    encoding,
    layers: readLayers(file.layers),
    settings: { ...file.settings, kept: kept.length },
    refiner: file.refiner && readRefiner(file.refiner, fps, kept.length),
    normalizer: { kept, mean: floats(file.mean), std: floats(file.std) },
  };
}
