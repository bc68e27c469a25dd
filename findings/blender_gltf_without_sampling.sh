#!/usr/bin/env bash
# Blender's glTF exporter turns joints wrongly, without a word, when it is told not to sample.
#
# Blender 5.0.1 (the package bpy, 370 MB), Python 3.11. Seen November 2026.
#
# The BVH importer keeps the file's order of Euler angles (its `rotate_mode` is NATIVE). The glTF exporter
# with "Sampling Animations" off (`export_force_sampling=False`, which keeps the keys and makes smaller
# files) takes the angles of each key for X, Y, Z, whatever the order: bones point up to 60 degrees
# elsewhere. Most BVH files are in other orders. With sampling on, which is the default, or with
# rotate_mode="QUATERNION", all is right.
#
# Exit 0: as described. Exit 1: it changed. Needs python3.11 and a network for the package.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
python3.11 -m venv venv
venv/bin/pip install --quiet bpy==5.0.1

cat >orders.py <<'PY'
import math

import bpy

FILE = """HIERARCHY
ROOT Hips
{{
  OFFSET 0 0 0
  CHANNELS 6 Xposition Yposition Zposition {channels}
  JOINT Knee
  {{
    OFFSET 0 -40 0
    CHANNELS 3 {channels}
    End Site
    {{
      OFFSET 0 -40 0
    }}
  }}
}}
MOTION
Frames: 2
Frame Time: 0.0416667
0 90 0 0 0 0 40 50 60
0 90 0 0 0 0 40 50 60
"""


def shin(frame):
    """Which way the knee's bone points."""
    body = next(each for each in bpy.data.objects if each.type == "ARMATURE")
    bpy.context.scene.frame_set(frame)
    knee = body.pose.bones["Knee"]
    return (body.matrix_world.to_3x3() @ (knee.tail - knee.head)).normalized()


def off(order, rotate_mode, sampled):
    """Degrees between the bone before and after its way through a glTF file."""
    with open("in.bvh", "w") as file:
        file.write(FILE.format(channels=" ".join(f"{axis}rotation" for axis in order)))
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.import_anim.bvh(filepath="in.bvh", rotate_mode=rotate_mode)
    before = shin(2)
    bpy.ops.export_scene.gltf(filepath="out.glb", export_force_sampling=sampled)
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.import_scene.gltf(filepath="out.glb")
    return round(math.degrees(before.angle(shin(2), 0)))


for order in ("XYZ", "ZXY", "ZYX", "YXZ"):
    print(
        "order", order,
        "sampled", off(order, "NATIVE", True),
        "keys", off(order, "NATIVE", False),
        "keys of quaternions", off(order, "QUATERNION", False),
    )
PY
venv/bin/python orders.py | grep "^order" | tee said.txt

diff said.txt - <<'EXPECTED'
order XYZ sampled 0 keys 0 keys of quaternions 0
order ZXY sampled 0 keys 62 keys of quaternions 0
order ZYX sampled 0 keys 49 keys of quaternions 0
order YXZ sampled 0 keys 18 keys of quaternions 0
EXPECTED
echo "As described: without sampling, every order of angles is written as if it were X, Y, Z."
