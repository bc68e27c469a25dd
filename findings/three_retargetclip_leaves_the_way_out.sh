#!/usr/bin/env bash
# three.js takes a motion to another skeleton without its way over the ground, though all names are given.
#
# three 0.187.0, examples/jsm/utils/SkeletonUtils.js, retargetClip(). Seen November 2026 with node 20.
#
# `names` says which bone is which. Which of them carries the body is asked apart, by `hip`, and that is
# the bone called "hip" if nothing is said: there is none of that name in most rigs (Hips, pelvis,
# mixamorigHips), so no bone moves, and what walked walks on the spot. Without `names` nothing moves at all, although
# both skeletons have the same names. With `fps`, the clip's own rate, there is a key less and most keys lie
# between frames. No warning in any of these.
# Who retargets in three.js: give `names` and `hip`, as the source's rig calls it, and leave `fps` out.
#
# Guessed before it was run: onto the same skeleton, with names, the motion comes out as it went in.
#
# Exit 0: as described. Exit 1: it changed. Needs node, npm and a network for the package.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
npm install --silent --no-save three@0.187.0

cat >retarget.mjs <<'JS'
import { AnimationMixer, BufferGeometry, Float32BufferAttribute, MeshBasicMaterial } from "three";
import { LoopOnce, SkinnedMesh, Vector3 } from "three";
import { BVHLoader } from "three/examples/jsm/loaders/BVHLoader.js";
import { retargetClip } from "three/examples/jsm/utils/SkeletonUtils.js";

const channels = "Zrotation Xrotation Yrotation";
const FILE = `HIERARCHY
ROOT Hips
{
  OFFSET 0 0 0
  CHANNELS 6 Xposition Yposition Zposition ${channels}
  JOINT Knee
  {
    OFFSET 0 -40 0
    CHANNELS 3 ${channels}
    End Site
    {
      OFFSET 0 -40 0
    }
  }
}
MOTION
Frames: 4
Frame Time: 0.5
0 90 0 0 0 0 0 0 0
0 90 50 0 0 0 0 20 0
0 90 100 0 0 0 0 40 0
0 90 150 0 0 0 0 60 0
`;

function body() {
  const { skeleton, clip } = new BVHLoader().parse(FILE);
  const skin = new BufferGeometry();
  skin.setAttribute("position", new Float32BufferAttribute([0, 0, 0], 3));
  const mesh = new SkinnedMesh(skin, new MeshBasicMaterial());
  mesh.add(skeleton.bones[0]);
  mesh.bind(skeleton);
  return { mesh, clip };
}

const names = { Hips: "Hips", Knee: "Knee", ENDSITE: "ENDSITE" };
const ways = {
  "nothing said": {},
  "names": { names },
  "names and hip": { names, hip: "Hips" },
  "names, hip and fps": { names, hip: "Hips", fps: 2 },
};
for (const [way, options] of Object.entries(ways)) {
  const [target, source] = [body(), body()];
  const clip = retargetClip(target.mesh, source.mesh, source.clip, options);
  const mixer = new AnimationMixer(target.mesh);
  const action = mixer.clipAction(clip).setLoop(LoopOnce);
  action.clampWhenFinished = true;
  action.play();
  mixer.setTime(2);
  target.mesh.updateMatrixWorld(true);
  const [hips, knee] = target.mesh.skeleton.bones;
  const ahead = hips.getWorldPosition(new Vector3()).z;
  const bent = (360 / Math.PI) * Math.acos(Math.abs(knee.quaternion.w));
  const keys = clip.tracks[0].times.length;
  console.log(`${way}: ${keys} keys, ends ${Math.round(ahead)} ahead, knee bent by ${Math.round(bent)}`);
}
JS
node retarget.mjs | tee said.txt

diff said.txt - <<'EXPECTED'
nothing said: 4 keys, ends 0 ahead, knee bent by 0
names: 4 keys, ends 0 ahead, knee bent by 60
names and hip: 4 keys, ends 150 ahead, knee bent by 60
names, hip and fps: 3 keys, ends 150 ahead, knee bent by 60
EXPECTED
echo "As described: 150 ahead and 60 degrees went in, and only with names and hip they came out."
