// Bundles src/ into the two files that motionlab ships (called by ../hatch_build.py):
//   player.js  a classic script for built pages: works from disk, asks the network for nothing;
//   widget.js  the same player as an ES module for anywidget.
import { fileURLToPath } from "node:url";
import { build } from "esbuild";
import { compile } from "./wat.js";

const at = (path) => fileURLToPath(new URL(path, import.meta.url));

// A .wat file is imported as the bytes of its module: a page opened from disk may load no .wasm.
const wat = {
  name: "wat",
  setup({ onLoad }) {
    onLoad({ filter: /\.wat$/ }, ({ path }) => ({ contents: compile(path), loader: "binary" }));
  },
};

const common = {
  bundle: true,
  minify: true,
  target: "es2020",
  charset: "utf8",
  legalComments: "eof",
  loader: { ".css": "text" },
  plugins: [wat],
  logLevel: "warning",
};

for (const [entry, format, file] of [["page", "iife", "player"], ["widget", "esm", "widget"]]) {
  const outfile = at(`../src/motionlab/viewer/live/static/${file}.js`);
  await build({ ...common, entryPoints: [at(`src/${entry}.js`)], format, outfile });
}
