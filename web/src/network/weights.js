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
  const size = Kind.BYTES_PER_ELEMENT;
  check("a list", raw.length / size, Math.ceil(raw.length / size));
  return new Kind(bytes.buffer);
}

const floats = (text) => numbers(text, Float32Array);

/** Fails with a sentence: half a file, or one of another network. */
function check(what, found, wanted) {
  if (found !== wanted) throw new Error(`The weights don't fit together: ${what} has ${found} numbers where ${wanted} belong. Build this page again.`);
}

/** A layer whose rows are a multiple of four (see affine.js): `weight`, or `whole` numbers and a scale a row. */
function readLayer({ columns, bias, weight, scales }) {
  const given = floats(bias);
  const rows = 4 * Math.ceil(given.length / 4);
  const layer = { rows, columns, bias: new Float32Array(rows) };
  layer.bias.set(given);
  const sent = scales ? numbers(weight, Int8Array) : floats(weight);
  check("a layer", sent.length, given.length * columns);
  if (scales) return { ...layer, whole: sent, scales: floats(scales) };
  layer.weight = new Float32Array(rows * columns);
  layer.weight.set(sent);
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

/** How many numbers a layer says. */
const says = ({ bias }) => floats(bias).length;

/** How many the last layer of a network does. */
const SAYS = { AcLstm: (_, kept) => kept, LstmGmm: ({ components }, kept) => components * (1 + 2 * kept) };

/** Each layer sees what the one `below` says; an LSTM, with four gates a unit, its own last output as well. */
function checkChain({ enter, lstm, leave }, below, said) {
  for (const layer of enter) {
    check("what a layer sees", layer.columns, below);
    below = says(layer);
  }
  for (const layer of lstm) {
    const width = says(layer) / 4;
    check("what an LSTM sees", layer.columns, below + width);
    below = width;
  }
  check("what the last layer sees", leave.columns, below);
  check("what the last layer says", says(leave), said);
}

/** A refiner of what the network makes (refiner.js), whose channels it shares. */
function readRefiner({ layers, settings, effectors }, fps, kept) {
  const { joints, mean, std } = effectors;
  const toes = settings.slow ? 6 : 0; // how they move along three axes, once more: see refiner.js
  checkChain(layers, kept + floats(mean).length + toes, kept + (settings.reach ? 2 : 0));
  return { layers: readLayers(layers), settings: { ...settings, fps, kept }, effectors: { joints, mean: floats(mean), std: floats(std) } };
}

/** All that a Dreamer needs: the network, the body's encoding, and states to start from. */
export function readWeights(file) {
  const { kind, fps, kept, encoding } = file;
  const starts = file.starts.map(({ name, frame, hidden, cell, noise }) => ({ name, frame: floats(frame), hidden: floats(hidden), cell: floats(cell), noise: floats(noise) }));
  checkChain(file.layers, kept.length, SAYS[kind](file.settings, kept.length));
  const remembered = file.layers.lstm.reduce((sum, layer) => sum + says(layer) / 4, 0);
  for (const { name, frame, hidden, cell } of starts) {
    check(`a frame of the start "${name}"`, frame.length, floats(file.mean).length);
    for (const memory of [hidden, cell]) check(`the memory of the start "${name}"`, memory.length, remembered);
  }
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
