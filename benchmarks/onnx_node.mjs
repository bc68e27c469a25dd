// Median milliseconds of the processor for a frame of examples/onnx_walk.mjs, the network with its chance:
//     node onnx_node.mjs FILE.onnx FRAMES
import { readFileSync } from "node:fs";
import * as ort from "../examples/node_modules/onnxruntime-web/dist/ort.node.min.mjs";
import { chance, frames, opened, readAbout } from "../examples/onnx_walk.mjs";

ort.env.wasm.numThreads = 1;
const [file, count] = process.argv.slice(2);
const bytes = readFileSync(file);
const about = readAbout(bytes);
const run = await opened(ort, bytes, about);
const times = [];
let last;
for await (const _ of frames(run, about.starts[0], chance(about))) {
  const { user, system } = process.cpuUsage();
  const now = (user + system) / 1000;
  if (last !== undefined) times.push(now - last);
  last = now;
  if (times.length >= Number(count)) break;
}
console.log(times.sort((a, b) => a - b)[times.length >> 1]);
process.exit();
