// WebAssembly text to bytes, for build.js and for Node (wat_in_node.js).
import { readFileSync } from "node:fs";
import wabt from "wabt";

const { parseWat } = await wabt();

/** The bytes of the module that stands in a .wat file. */
export function compile(path) {
  const parsed = parseWat(path, readFileSync(path, "utf8"));
  const { buffer } = parsed.toBinary({});
  parsed.destroy();
  return buffer;
}
