// What a script in a program's own environment is given, and how it tells what it saw.
import { readFileSync, writeFileSync } from "node:fs";

export const [folder, way] = process.argv.slice(2);
export const clip = (kind) => readFileSync(`${folder}/clip.${kind}`);
export const numbers = () => JSON.parse(clip("json"));
export const back = (bytes) => writeFileSync(`${folder}/back.glb`, bytes);
export const see = (seen) => writeFileSync(`${folder}/seen.json`, JSON.stringify(seen));
