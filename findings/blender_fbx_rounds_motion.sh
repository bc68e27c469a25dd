#!/usr/bin/env bash
# Blender's FBX exporter moves the end of a limb by a centimetre unless it is told not to simplify.
#
# Blender 5.0.1 (the package bpy, 370 MB), Python 3.11. Seen November 2026.
#
# "Simplify" (`bake_anim_simplify_factor`) is 1.0 by default: keys are left out where curves seem straight.
# How far that may be off is an angle, joint by joint, so that it adds up along a chain to hands and toes. No
# warning, and frames and rate look right. With 0.0 all frames are kept. Who takes motion from Blender to an
# engine by FBX: set Simplify to 0, and measure where feet are.
#
# Guessed before it was run: below a millimetre, as what is left out should not be seen.
#
# Exit 0: as described. Exit 1: it changed. Needs python3.11 and a network for the package.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
python3.11 -m venv venv
venv/bin/pip install --quiet bpy==5.0.1

cat >simplified.py <<'PY'
import math

import bpy

JOINTS, FRAMES = 6, 240  # a chain of bones of 0.4 m, each swinging in its own time, at 120 fps
CHANNELS = "Zrotation Xrotation Yrotation"


def text():
    head = f"HIERARCHY\nROOT Bone0\n{{\nOFFSET 0 0 0\nCHANNELS 6 Xposition Yposition Zposition {CHANNELS}\n"
    for joint in range(1, JOINTS):
        head += f"JOINT Bone{joint}\n{{\nOFFSET 0 0.4 0\nCHANNELS 3 {CHANNELS}\n"
    head += "End Site\n{\nOFFSET 0 0.4 0\n}\n" + JOINTS * "}\n"
    rows = []
    for frame in range(FRAMES):
        swings = [15 * math.sin((1 + 0.3 * joint) * math.tau * frame / 120) for joint in range(JOINTS)]
        rows.append("0 1 0 " + " ".join(f"0 {angle:.6f} 0" for angle in swings))
    return f"{head}MOTION\nFrames: {FRAMES}\nFrame Time: 0.00833333\n" + "\n".join(rows) + "\n"


def heads():
    """Where the last bone begins, frame by frame."""
    body = next(each for each in bpy.data.objects if each.type == "ARMATURE")
    found = []
    for frame in range(1, FRAMES + 1):
        bpy.context.scene.frame_set(frame)
        found.append(body.matrix_world @ body.pose.bones[f"Bone{JOINTS - 1}"].head)
    return found


with open("in.bvh", "w") as file:
    file.write(text())
for options in ({}, {"bake_anim_simplify_factor": 0.0}):
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.import_anim.bvh(filepath="in.bvh", update_scene_fps=True, update_scene_duration=True)
    before = heads()
    bpy.ops.export_scene.fbx(filepath="out.fbx", **options)
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.import_scene.fbx(filepath="out.fbx")
    worst = 1000 * max((a - b).length for a, b in zip(before, heads(), strict=True))
    print("simplify", options.get("bake_anim_simplify_factor", "as it is"), f"largest error {worst:.1f} mm")
PY
venv/bin/python simplified.py | grep "^simplify" | tee said.txt

diff said.txt - <<'EXPECTED'
simplify as it is largest error 11.4 mm
simplify 0.0 largest error 0.0 mm
EXPECTED
echo "As described: FBX as Blender writes it by itself is off, and exact if it is not simplified."
