// Plays a file, .glb or .bvh, in three.js as a page does: where its bones are at some times, as JSON {loop, stop}, for a mixer that
// begins anew and for one that stops at the end. node three_in_node.mjs FILE TIME...
import { readFileSync } from "node:fs";
import { AnimationMixer, LoopOnce, Vector3 } from "../../web/node_modules/three/build/three.module.js";
import { BVHLoader } from "../../web/node_modules/three/examples/jsm/loaders/BVHLoader.js";
import { GLTFLoader } from "../../web/node_modules/three/examples/jsm/loaders/GLTFLoader.js";

const [path, ...times] = process.argv.slice(2);
console.warn = () => {}; // of tracks without a bone, one line each

async function load() {
  const bytes = readFileSync(path);
  if (path.endsWith(".bvh")) {
    const { skeleton, clip } = new BVHLoader().parse(bytes.toString());
    return { top: skeleton.bones[0], clip, duration: clip.duration };
  }
  const { scene, animations } = await new GLTFLoader().parseAsync(new Uint8Array(bytes).buffer, "");
  return { top: scene, clip: animations[0], duration: animations[0].duration };
}

async function play(stops) {
  const { top, clip } = await load();
  const mixer = new AnimationMixer(top);
  const action = mixer.clipAction(clip);
  if (stops) action.setLoop(LoopOnce).clampWhenFinished = true;
  action.play();
  return times.map((time) => {
    mixer.setTime(Number(time));
    top.updateMatrixWorld(true);
    const places = {};
    top.traverse((node) => { if (node.isBone) places[node.name] = node.getWorldPosition(new Vector3()).toArray(); });
    return places;
  });
}

console.log(JSON.stringify({ loop: await play(false), stop: await play(true), duration: (await load()).duration }));
