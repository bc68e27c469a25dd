// Runs the Khronos glTF validator for test_gltf.py: what it says of each file named, as JSON.
import { readFileSync } from "node:fs";
import validator from "../../web/node_modules/gltf-validator/index.js";

const said = {};
for (const path of process.argv.slice(2)) {
  const { issues } = await validator.validateBytes(new Uint8Array(readFileSync(path)));
  // errors 0, warnings 1; and nodes that carry nothing, which tools clear away
  said[path] = issues.messages.filter(({ severity, code }) => severity < 2 || code === "NODE_EMPTY");
}
console.log(JSON.stringify(said));
