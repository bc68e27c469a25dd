"""Opens a dance in Blender and renders it: writes book/static/dance_in_blender.jpg.

    python -m experiments.aclstm.render [runs/dances/dance.glb] [--threads 2]

For an environment of its own, with Python 3.11 and nothing but Blender: `pip install bpy==5.0.1`. The
file is one of experiments/aclstm/gltf.py's. All poses stand in one scene, a second apart.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import bpy
from mathutils import Vector

ROOT = Path(__file__).resolve().parents[2]
FPS, POSES, APART = 30, 7, 1.15  # pictures a second, bodies, metres between them
SIZE, SAMPLES = (1400, 420), 64


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("file", nargs="?", type=Path, default=ROOT / "runs/dances/dance.glb")
    parser.add_argument("--output", type=Path, default=ROOT / "book/static/dance_in_blender.jpg")
    parser.add_argument("--threads", type=int, default=2)
    chosen = parser.parse_args()
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.render.fps = FPS
    bpy.ops.import_scene.gltf(filepath=str(chosen.file))
    body = next(o for o in bpy.data.objects if any(m.type == "ARMATURE" for m in o.modifiers))
    rig = next(o for o in bpy.data.objects if o.type == "ARMATURE")
    (action,) = bpy.data.actions
    print(f"{len(rig.data.bones)} bones, {len(body.data.vertices)} vertices, ", end="")
    print(f"{action.frame_range[1] + 1:.0f} frames")
    for number in range(POSES):
        scene.frame_set(number * FPS)
        stand(body, rig, number)
    for shown in (body, rig):
        shown.hide_render = True
    light(scene)
    film(scene, chosen.threads)
    scene.render.filepath = str(chosen.output)
    bpy.ops.render.render(write_still=True)


def stand(body, rig, number: int) -> None:
    """A copy of the body as it is now, in its place in the row."""
    graph = bpy.context.evaluated_depsgraph_get()
    mesh = bpy.data.meshes.new_from_object(body.evaluated_get(graph))
    copy = bpy.data.objects.new(f"pose {number}", mesh)
    bpy.context.scene.collection.objects.link(copy)
    hips = rig.matrix_world @ rig.pose.bones[0].head
    copy.matrix_world = body.matrix_world.copy()
    copy.location += Vector((APART * (number - (POSES - 1) / 2) - hips.x, -hips.y, 0))


def light(scene) -> None:
    """A floor, a sun, a bright sky."""
    bpy.ops.mesh.primitive_plane_add(size=60)
    sun = bpy.data.objects.new("sun", bpy.data.lights.new("sun", "SUN"))
    sun.data.energy, sun.data.angle, sun.rotation_euler = 3.0, 0.1, (0.7, 0.3, 0.4)
    scene.collection.objects.link(sun)
    scene.world = bpy.data.worlds.new("sky")
    scene.world.use_nodes = True
    sky = scene.world.node_tree.nodes["Background"]
    sky.inputs["Color"].default_value, sky.inputs["Strength"].default_value = (0.9, 0.94, 1, 1), 0.8


def film(scene, threads: int) -> None:
    """A camera that sees the whole row, and how the picture is made."""
    camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    camera.data.lens = 60
    camera.location = Vector((0, -13.5, 2.2))
    aim = Vector((0, 0, 0.78)) - camera.location
    camera.rotation_euler = aim.to_track_quat("-Z", "Y").to_euler()
    scene.collection.objects.link(camera)
    scene.camera = camera
    scene.render.engine = "CYCLES"
    scene.cycles.samples, scene.cycles.seed = SAMPLES, 0
    scene.render.threads_mode, scene.render.threads = "FIXED", threads
    scene.render.resolution_x, scene.render.resolution_y = SIZE
    scene.render.image_settings.file_format = "JPEG"
    scene.render.image_settings.quality = 85


if __name__ == "__main__":
    main()
