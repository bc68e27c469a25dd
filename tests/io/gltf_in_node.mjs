// Runs the Khronos glTF validator for test_gltf.py: what it says of each file named, as JSON.
import { readFileSync } from "node:fs";
import validator from "../../web/node_modules/gltf-validator/index.js";

const said = {};
for (const path of process.argv.slice(2)) {
  const { issues } = await validator.validateBytes(new Uint8Array(readFileSync(path)));
  said[path] = issues.messages.filter(({ severity }) => severity < 2); // errors 0, warnings 1
}
console.log(JSON.stringify(said));
