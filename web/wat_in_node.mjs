// Lets Node import .wat files as build.js lets esbuild: `node --import` this before what needs them.
import { registerHooks } from "node:module";
import { fileURLToPath } from "node:url";
import { compile } from "./wat.js";

registerHooks({
  load(url, context, next) {
    if (!url.endsWith(".wat")) return next(url, context);
    const source = `export default Uint8Array.from([${compile(fileURLToPath(url))}]);`;
    return { format: "module", source, shortCircuit: true };
  },
});
