// For bench_page.py, under Node: milliseconds of the processor that a whole frame takes with SIMD and without,
// in every round, and how far apart both are after a second. And the network alone in ONNX Runtime, if `peer` is given.
import { readFileSync } from "node:fs";
import { pathToFileURL } from "node:url";
import { Dreamer } from "../web/src/network/dreamer.js";
import { readWeights } from "../web/src/network/weights.js";

const SECOND = 30; // frames

const { script, name, look, settings, frames, rounds, peer } = JSON.parse(readFileSync(process.argv[2], "utf8"));
new Function(readFileSync(script, "utf8"))();
const read = () => readWeights(globalThis.motionlabWeights[name]);
const simd = read();
const { validate } = WebAssembly;
WebAssembly.validate = () => false; // as in a browser without
const plain = read();
WebAssembly.validate = validate;

function cost(dreamer, count) {
  const began = process.cpuUsage();
  for (let frame = 0; frame < count; frame++) dreamer.advance();
  const { user, system } = process.cpuUsage(began);
  return (user + system) / 1000 / count;
}

const found = Object.entries(frames).map(([characters, count]) => {
  const dreamers = [plain, simd].map((weights) => new Dreamer(weights, look, { ...settings, characters: Number(characters) }));
  for (const dreamer of dreamers) dreamer.reach(SECOND); // which also lets it be compiled
  const [one, other] = dreamers.map((dreamer) => dreamer.characters.flatMap(({ input }) => [...input]));
  const apart = Math.max(...one.map((value, i) => Math.abs(value - other[i])));
  const times = dreamers.map(() => []);
  for (let round = 0; round <= rounds; round++) dreamers.forEach((dreamer, i) => times[i].push(cost(dreamer, count)));
  const [slow, fast] = times.map((all) => all.slice(1));
  return [characters, { plain: slow, simd: fast, apart }];
});

/** A frame of one character by turns: the network alone in ONNX Runtime, and a whole frame here. */
async function beside({ module, network, sizes }) {
  const { default: ort } = await import(pathToFileURL(module));
  ort.env.wasm.numThreads = 1;
  const session = await ort.InferenceSession.create(readFileSync(network));
  let inputs = Object.fromEntries(Object.entries(sizes).map(([part, size]) => [part, new ort.Tensor("float32", new Float32Array(size), [1, size])]));
  const [said, ...after] = session.outputNames;
  const step = async () => {
    const outputs = await session.run(inputs);
    const memory = Object.keys(sizes).slice(1);
    inputs = { x: inputs.x, ...Object.fromEntries(memory.map((part, i) => [part, outputs[after[i]]])) };
    return outputs[said];
  };
  const dreamer = new Dreamer(simd, look, { ...settings, characters: 1 });
  const [bare, whole] = [[], []];
  for (let round = 0; round <= rounds; round++) {
    const began = process.cpuUsage();
    for (let frame = 0; frame < frames[1]; frame++) await step();
    const { user, system } = process.cpuUsage(began);
    bare.push((user + system) / 1000 / frames[1]);
    whole.push(cost(dreamer, frames[1]));
  }
  return { bare: bare.slice(1), whole: whole.slice(1) };
}

if (peer) found.push(["peer", await beside(peer)]);
process.stdout.write(JSON.stringify(Object.fromEntries(found)), () => process.exit()); // a runtime's threads stay
