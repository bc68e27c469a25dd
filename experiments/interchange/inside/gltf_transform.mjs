// gltf-transform: a GLB file through one of its functions.
import { NodeIO } from "@gltf-transform/core";
import * as functions from "@gltf-transform/functions";
import { back, folder, way } from "./given.mjs";

const io = new NodeIO();
const document = await io.read(`${folder}/clip.glb`);
const [name, set] = way.split(", ");
const options = set ? { keepLeaves: true } : {};
if (name !== "read and write") await document.transform(functions[name](options));
back(await io.writeBinary(document));
