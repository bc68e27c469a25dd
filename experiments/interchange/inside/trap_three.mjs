// Three things about three.js: offsets under position channels, clips taken to another body, cuts.
import {
  AnimationClip, AnimationMixer, AnimationUtils, BufferGeometry, Float32BufferAttribute, MeshBasicMaterial,
  NumberKeyframeTrack, SkinnedMesh, Vector3,
} from "three";
import { BVHLoader } from "three/examples/jsm/loaders/BVHLoader.js";
import { retargetClip } from "three/examples/jsm/utils/SkeletonUtils.js";
import { clip } from "./given.mjs";

function body(text) {
  const { skeleton, clip: animation } = new BVHLoader().parse(text);
  const skin = new BufferGeometry();
  skin.setAttribute("position", new Float32BufferAttribute([0, 0, 0], 3));
  const mesh = new SkinnedMesh(skin, new MeshBasicMaterial());
  mesh.add(skeleton.bones[0]);
  mesh.bind(skeleton);
  return { mesh, animation, bones: skeleton.bones };
}

function places({ mesh, bones }, animation, time) {
  const mixer = new AnimationMixer(mesh);
  mixer.clipAction(animation).play();
  mixer.setTime(time);
  mesh.updateMatrixWorld(true);
  return bones.map((bone) => bone.getWorldPosition(new Vector3()));
}

const apart = (a, b) => Math.max(...a.map((place, i) => place.distanceTo(b[i])));
const text = clip("bvh").toString();
const turns = "Zrotation Xrotation Yrotation";
const limb = (channels, row) =>
  `HIERARCHY\nROOT Hips\n{\nOFFSET 0 0 0\nCHANNELS 6 Xposition Yposition Zposition ${turns}\nJOINT Knee\n{\n` +
  `OFFSET 0 -40 0\nCHANNELS ${channels} ${turns}\nEnd Site\n{\nOFFSET 0 -40 0\n}\n}\n}\n` +
  `MOTION\nFrames: 1\nFrame Time: 0.0333333\n0 90 0 0 0 0 ${row}\n`;
const bone = (file) => {
  const [hips, knee] = ((it) => places(it, it.animation, 0))(body(file));
  return hips.distanceTo(knee);
};

const retargeted = {};
for (const [way, options] of [["nothing", () => ({})], ["names", (names) => ({ names })],
  ["names and hip", (names) => ({ names, hip: "Hips" })]]) {
  const [target, source] = [body(text), body(text)];
  const names = Object.fromEntries(source.bones.map(({ name }) => [name, name]));
  const taken = retargetClip(target.mesh, source.mesh, source.animation, options(names));
  const time = 0.9 * source.animation.duration;
  retargeted[way] = {
    "moves by (cm)": apart(places(target, taken, 0), places(target, taken, time)),
    "off by (cm)": apart(places(source, source.animation, time), places(target, taken, time)),
  };
}

const numbers = [...Array(301).keys()];
const track = new NumberKeyframeTrack(".x", numbers.map((frame) => frame / 30), numbers);
let wrong = 0;
for (let from = 1; from <= 200; from += 1) {
  const piece = AnimationUtils.subclip(new AnimationClip("a", -1, [track]), "b", from, from + 5, 30);
  const { values } = piece.tracks[0];
  wrong += values[0] !== from || values.length !== 5;
}
console.log(JSON.stringify({
  "bone of 40 with three channels": bone(limb(3, "0 0 0")),
  "bone of 40 with six channels": bone(limb("6 Xposition Yposition Zposition", "0 -40 0 0 0 0")),
  "retargetClip onto the same body": retargeted,
  "wrong cuts of 200": wrong,
}));
