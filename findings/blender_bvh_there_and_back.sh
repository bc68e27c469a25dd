#!/usr/bin/env bash
# A BVH file that goes through Blender comes back lying on its back and, at 120 fps, five times slower.
#
# Blender 5.0.1 (the package bpy, 370 MB), Python 3.11. Seen November 2026.
#
# Blender's importer takes y for up. Its exporter writes Blender's own axes, z up, and has no setting for
# it: imported again, by Blender or by anything else that takes y for up, the body lies. The importer also
# puts one frame of the file on one frame of the scene (24 fps), whatever `Frame Time` says, unless
# `use_fps_scale` or `update_scene_fps` is set; the exporter then writes the scene's rate. Who
# reads files that passed through Blender: take z for up, and ask for the rate.
#
# Exit 0: as described. Exit 1: it changed. Needs python3.11 and a network for the package.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
python3.11 -m venv venv
venv/bin/pip install --quiet bpy==5.0.1

cat >before.bvh <<'BVH'
HIERARCHY
ROOT Hips
{
  OFFSET 0 0 0
  CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation
  JOINT Head
  {
    OFFSET 0 60 0
    CHANNELS 3 Zrotation Xrotation Yrotation
    End Site
    {
      OFFSET 0 20 0
    }
  }
}
MOTION
Frames: 3
Frame Time: 0.00833333
0 90 0 0 0 0 0 0 0
0 90 1 0 0 0 0 0 0
0 90 2 0 0 0 0 0 0
BVH

cat >through.py <<'PY'
import bpy

bpy.ops.wm.read_factory_settings(use_empty=True)


def imported(path):
    """Bring a file in; the rise of its head above its hips, in Blender's z, which is up there."""
    bpy.ops.import_anim.bvh(filepath=path)
    body = bpy.context.object
    bpy.context.scene.frame_set(1)
    hips, head = (body.matrix_world @ body.pose.bones[name].head for name in ("Hips", "Head"))
    return round(head.z - hips.z)


settings = bpy.ops.export_anim.bvh.get_rna_type().properties.keys()
print("rise of the head, imported:", imported("before.bvh"))
bpy.ops.export_anim.bvh(filepath="after.bvh", frame_start=1, frame_end=3)
print("rise of the head, imported again:", imported("after.bvh"))
print("exporter's settings for axes:", [name for name in settings if "axis" in name])
PY
venv/bin/python through.py | grep -E "^(rise|exporter)" | tee said.txt
grep "Frame Time" after.bvh | tee rate.txt
awk '/OFFSET/ { printf "OFFSET %.0f %.0f %.0f\n", $2 + 0.001, $3 + 0.001, $4 + 0.001 }' after.bvh | tee offsets.txt

diff said.txt - <<'EXPECTED'
rise of the head, imported: 60
rise of the head, imported again: 0
exporter's settings for axes: []
EXPECTED
diff offsets.txt - <<'EXPECTED'
OFFSET 0 0 0
OFFSET 0 0 60
OFFSET 0 0 20
EXPECTED
diff rate.txt - <<'EXPECTED'
Frame Time: 0.041667
EXPECTED
echo "As described: y up and 120 fps went in, z up and 24 fps came out."
