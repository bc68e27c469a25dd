// three.js: where its bones are while its mixer plays a BVH or a GLB file.
import { AnimationMixer, LoopOnce, Quaternion, Vector3 } from "three";
import { BVHLoader } from "three/examples/jsm/loaders/BVHLoader.js";
import { GLTFLoader } from "three/examples/jsm/loaders/GLTFLoader.js";
import { clip, numbers, see, way } from "./given.mjs";

globalThis.self = globalThis; // GLTFLoader asks the browser for it

async function loaded() {
  if (way.startsWith("bvh")) {
    const { skeleton, clip: animation } = new BVHLoader().parse(clip("bvh").toString());
    return { root: skeleton.bones[0], animation };
  }
  const bytes = clip("glb");
  const buffer = bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.length);
  const { scene, animations } = await new GLTFLoader().parseAsync(buffer, "");
  return { root: scene, animation: animations[0] };
}

const { root, animation } = await loaded();
const bones = [];
root.traverse((each) => each.isBone && each.name !== "ENDSITE" && bones.push(each));
const mixer = new AnimationMixer(root);
const action = mixer.clipAction(animation);
if (way.endsWith("set")) {
  action.setLoop(LoopOnce);
  action.clampWhenFinished = true;
}
action.play();
const { fps, root: frames } = numbers();
const positions = [], rotations = [];
for (let frame = 0; frame < frames.length; frame += 1) {
  mixer.setTime(frame / fps);
  root.updateMatrixWorld(true);
  positions.push(bones.map((bone) => bone.getWorldPosition(new Vector3()).toArray()));
  rotations.push(bones.map((bone) => bone.getWorldQuaternion(new Quaternion()).toArray()));
}
see({ names: bones.map((bone) => bone.name), fps, positions, rotations });
