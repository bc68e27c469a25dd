// gltf-transform: a GLB file through one of its functions.
import { NodeIO } from "@gltf-transform/core";
import * as functions from "@gltf-transform/functions";
import { back, folder, way } from "./given.mjs";

const io = new NodeIO();
const document = await io.read(`${folder}/clip.glb`);
if (way !== "read and write") await document.transform(functions[way]());
back(await io.writeBinary(document));
