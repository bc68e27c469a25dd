// Runs examples/onnx_walk.mjs for test_onnx_walk.py: with a runtime, or with answers that Python's gave.
import { readFileSync } from "node:fs";
import * as walk from "../../examples/onnx_walk.mjs";

const { files, start, chance, answers } = JSON.parse(readFileSync(process.argv[2], "utf8"));
const bytes = files.map((file) => readFileSync(file));
const [about, its] = bytes.map(walk.readAbout);
let apart = 0;

/** What was answered to the next question in a network's name, and how far this one is from it. */
function heard(name) {
  const known = answers.filter(([its]) => its === name).values();
  return (inputs) => {
    const [, asked, answer] = known.next().value;
    for (const [part, values] of Object.entries(asked)) values.forEach((value, i) => (apart = Math.max(apart, Math.abs(value - inputs[part][i]))));
    return Object.fromEntries(Object.entries(answer).map(([part, values]) => [part, Float32Array.from(values)]));
  };
}

const runtime = async () => {
  const ort = await import("../../examples/node_modules/onnxruntime-web/dist/ort.node.min.mjs");
  return [await walk.opened(ort, bytes[0], about), await walk.opened(ort, bytes[1], its)];
};
const [walker, refiner] = answers ? [heard("walker"), heard("refiner")] : await runtime();
const rows = walk.refined(refiner, its, walk.frames(walker, about.starts[start], chance));
const made = [];
for await (const pose of walk.poses(about, rows)) made.push(pose);

let state = 1;
const uniform = () => (state = (state * 48271) % 2147483647) / 2147483647;
const drawn = { noise: [], gumbel: [] };
for (const { noise, gumbel } of walk.chance(about, uniform)) {
  drawn.noise.push(...noise);
  drawn.gumbel.push(...gumbel);
  if (drawn.noise.length > 50000) break;
}
const seeded = [0, 0, 1].map(walk.mulberry32).map((uniform) => [uniform(), uniform(), uniform()]);
console.log(JSON.stringify({ bvh: walk.bvh(about, made), apart, drawn, seeded }));
