// For bench_page.py, under Node: milliseconds of the processor that a whole frame takes with SIMD and without,
// in every round, and how far apart both are after a second.
import { readFileSync } from "node:fs";
import { Dreamer } from "../web/src/network/dreamer.js";
import { readWeights } from "../web/src/network/weights.js";

const SECOND = 30; // frames

const { script, name, look, settings, frames, rounds } = JSON.parse(readFileSync(process.argv[2], "utf8"));
new Function(readFileSync(script, "utf8"))();
const read = () => readWeights(globalThis.motionlabWeights[name]);
const simd = read();
WebAssembly.validate = () => false; // as in a browser without
const plain = read();

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
process.stdout.write(JSON.stringify(Object.fromEntries(found)));
