// Babylon.js: where its bones are while it plays a GLB file, without a picture.
import { NullEngine, Quaternion, Scene, SceneLoader, Vector3 } from "@babylonjs/core";
import "@babylonjs/loaders/glTF/index.js";
import { clip, numbers, see, way } from "./given.mjs";

const scene = new Scene(new NullEngine());
scene.useRightHandedSystem = way === "right-handed";
const url = `data:;base64,${clip("glb").toString("base64")}`;
await SceneLoader.AppendAsync("", url, scene, undefined, ".glb");
const { fps, root: frames, names } = numbers();
const nodes = names.map((name) => scene.getTransformNodeByName(name)).filter(Boolean);
const [group] = scene.animationGroups;
group.start(false);
group.pause();
const positions = [], rotations = [];
for (let frame = 0; frame < frames.length; frame += 1) {
  group.goToFrame((60 * frame) / fps); // glTF's seconds are sixtieths here
  nodes.forEach((node) => node.computeWorldMatrix(true));
  const there = nodes.map((node) => {
    const [at, turn] = [new Vector3(), new Quaternion()];
    node.getWorldMatrix().decompose(new Vector3(), turn, at);
    return [at.asArray(), turn.asArray()];
  });
  positions.push(there.map(([at]) => at));
  rotations.push(there.map(([, turn]) => turn));
}
see({ names: nodes.map((node) => node.name), fps, positions, rotations });
scene.dispose();
