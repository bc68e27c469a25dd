#!/usr/bin/env bash
# Blender makes the scene a frame longer than the BVH file that it reads, and can't begin it at frame 0.
#
# Blender 5.0.1 (the package bpy, 370 MB), Python 3.11. Seen November 2026.
#
# With `update_scene_duration` the scene ends one frame after the file's last; who exports the scene's range
# gets the last pose twice, and a loop halts there. `frame_start=0` is taken for 1 without a word (but not
# where the scene's end is counted, which therefore fits). So the glTF exporter, for which frame 0 is second 0,
# begins the motion a frame late either way.
# Who brings BVH through Blender: export up to the action's `frame_range`, not the scene's; for glTF set
# `export_anim_slide_to_zero`.
#
# Guessed before it was run: the scene ends with the file, and frame_start=0 puts its first frame at 0.
#
# Exit 0: as described. Exit 1: it changed. Needs python3.11 and a network for the package.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
python3.11 -m venv venv
venv/bin/pip install --quiet bpy==5.0.1

cat >frames.py <<'PY'
import json
import struct

import bpy

FILE = """HIERARCHY
ROOT Hips
{
  OFFSET 0 0 0
  CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation
  End Site
  {
    OFFSET 0 20 0
  }
}
MOTION
Frames: 300
Frame Time: 0.0333333
"""
with open("in.bvh", "w") as file:
    file.write(FILE + "".join(f"0 90 {frame} 0 0 0\n" for frame in range(300)))


def first_key(**options):
    """When a glTF file of what is in the scene begins, in frames."""
    bpy.ops.export_scene.gltf(filepath="out.glb", **options)
    with open("out.glb", "rb") as file:
        file.seek(12)
        size, _ = struct.unpack("<II", file.read(8))
        tree = json.loads(file.read(size))
    keys = tree["accessors"][tree["animations"][0]["samplers"][0]["input"]]
    return round(30 * keys["min"][0])


for start in (1, 0):
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    bpy.ops.import_anim.bvh(
        filepath="in.bvh", frame_start=start, update_scene_fps=True, update_scene_duration=True
    )
    action = bpy.context.object.animation_data.action
    bpy.ops.export_anim.bvh(
        filepath="out.bvh", frame_start=scene.frame_start, frame_end=scene.frame_end
    )
    with open("out.bvh") as file:
        frames = next(line for line in file if line.startswith("Frames:")).strip()
    print("begin at", start, "keys", *map(int, action.frame_range), "scene ends", scene.frame_end)
    print("written again,", frames)
    print("glTF from frame", first_key(), "slid", first_key(export_anim_slide_to_zero=True))
PY
venv/bin/python frames.py | grep -E "^(begin|written|glTF from)" | tee said.txt

diff said.txt - <<'EXPECTED'
begin at 1 keys 1 300 scene ends 301
written again, Frames: 301
glTF from frame 1 slid 0
begin at 0 keys 1 300 scene ends 300
written again, Frames: 300
glTF from frame 1 slid 0
EXPECTED
echo "As described: of 300 frames 301 came out, and none of them is at frame 0."
