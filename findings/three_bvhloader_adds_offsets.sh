#!/usr/bin/env bash
# three.js doubles bones of BVH files whose joints have position channels of their own.
#
# three 0.187.0, examples/jsm/loaders/BVHLoader.js. Seen November 2026 with node 20 and Python 3.11.
#
# In BVH a position channel takes the place of the joint's OFFSET: so bvhio 1.5.4 reads it, and so do
# bvhsdk 0.2.1, upc-pymotion 0.3.4 and Blender 5.0.1. BVHLoader adds the two. Files with six channels on
# every joint repeat the OFFSET there (Bandai Namco's set, many exporters): each bone comes out twice as
# long. A ROOT with an OFFSET that is not zero stands too high by it. Neither is warned of.
# Who shows such files in a page: set the OFFSETs' part of the tracks to zero, or write three channels.
#
# Exit 0: as described. Exit 1: it changed. Needs node, npm, python3 and a network for the packages.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
npm install --silent --no-save three@0.187.0
python3 -m venv venv
venv/bin/pip install --quiet bvhio==1.5.4

cat >three_channels.bvh <<'BVH'
HIERARCHY
ROOT Hips
{
  OFFSET 0 0 0
  CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation
  JOINT Knee
  {
    OFFSET 0 -40 0
    CHANNELS 3 Zrotation Xrotation Yrotation
    End Site
    {
      OFFSET 0 -40 0
    }
  }
}
MOTION
Frames: 1
Frame Time: 0.0333333
0 90 0 0 0 0 0 0 0
BVH
sed -e 's/CHANNELS 3/CHANNELS 6 Xposition Yposition Zposition/' \
  -e 's/^0 90 0 0 0 0 0 0 0$/0 90 0 0 0 0 0 -40 0 0 0 0/' three_channels.bvh >six_channels.bvh
sed '0,/OFFSET 0 0 0/s//OFFSET 0 90 0/' three_channels.bvh >root_offset.bvh

cat >three.mjs <<'JS'
import { readFileSync } from "node:fs";
import { AnimationMixer, Vector3 } from "three";
import { BVHLoader } from "three/examples/jsm/loaders/BVHLoader.js";
for (const file of process.argv.slice(2)) {
  const { skeleton, clip } = new BVHLoader().parse(readFileSync(file, "utf8"));
  const root = skeleton.bones[0];
  const mixer = new AnimationMixer(root);
  mixer.clipAction(clip).play();
  mixer.setTime(0);
  root.updateMatrixWorld(true);
  const heights = skeleton.bones.slice(0, 2).map((bone) => bone.getWorldPosition(new Vector3()).y);
  console.log(file, ...heights.map(Math.round));
}
JS
cat >others.py <<'PY'
import sys

import bvhio

for file in sys.argv[1:]:
    root = bvhio.readAsHierarchy(file)
    root.loadPose(0)
    print(file, *(round(joint.PositionWorld.y) for joint, _, _ in root.layout()[:2]))
PY

files=(three_channels.bvh six_channels.bvh root_offset.bvh)
node three.mjs "${files[@]}" | tee three.txt
echo "bvhio:"
venv/bin/python others.py "${files[@]}" | tee others.txt

# Heights of hips and knee: 90 and 50, whichever way the file says it.
diff others.txt - <<'EXPECTED'
three_channels.bvh 90 50
six_channels.bvh 90 50
root_offset.bvh 90 50
EXPECTED
diff three.txt - <<'EXPECTED'
three_channels.bvh 90 50
six_channels.bvh 90 10
root_offset.bvh 180 140
EXPECTED
echo "As described: three.js adds OFFSET to position channels."
