"""Blender: BVH or glTF in and out, as it comes or with what has to be set."""

import bpy
from given import BACK_BVH, BACK_GLB, BVH, FOLDER, GLB, WAY, see


def seen_in_scene():
    """Tell where bones are in each frame of the action: in metres, z up."""
    scene = bpy.context.scene
    body = next(each for each in bpy.data.objects if each.type == "ARMATURE")
    first, last = map(int, body.animation_data.action.frame_range)
    positions, rotations = [], []
    for frame in range(first, last + 1):
        scene.frame_set(frame)
        there = [body.matrix_world @ bone.matrix for bone in body.pose.bones]
        positions.append([list(matrix.translation) for matrix in there])
        turns = [matrix.to_quaternion() for matrix in there]
        rotations.append([[turn.x, turn.y, turn.z, turn.w] for turn in turns])
    rate = scene.render.fps / scene.render.fps_base
    names = [bone.name for bone in body.pose.bones]
    see(names=names, fps=rate, positions=positions, rotations=rotations)


bpy.ops.wm.read_factory_settings(use_empty=True)
scene = bpy.context.scene
if WAY == "bvh":
    bpy.ops.import_anim.bvh(filepath=BVH)
    bpy.ops.export_anim.bvh(filepath=BACK_BVH)
if WAY == "bvh, set":
    bpy.ops.import_anim.bvh(
        filepath=BVH, update_scene_fps=True, update_scene_duration=True, global_scale=0.01
    )
    # the scene's own end is one frame too late
    first, last = map(int, bpy.context.object.animation_data.action.frame_range)
    bpy.ops.export_anim.bvh(filepath=BACK_BVH, frame_start=first, frame_end=last, global_scale=100)
if WAY == "glb":
    bpy.ops.import_scene.gltf(filepath=GLB)
    bpy.ops.export_scene.gltf(filepath=BACK_GLB)
if WAY in ("bvh to glb", "bvh to glb, set"):
    options = {"update_scene_fps": True, "update_scene_duration": True, "global_scale": 0.01}
    bpy.ops.import_anim.bvh(filepath=BVH, **options)
    bpy.ops.export_scene.gltf(filepath=BACK_GLB, export_anim_slide_to_zero=WAY.endswith("set"))
if WAY in ("fbx", "fbx, set", "usd"):
    options = {"update_scene_fps": True, "update_scene_duration": True, "global_scale": 0.01}
    bpy.ops.import_anim.bvh(filepath=BVH, **options)
    path = str(FOLDER / f"through.{WAY[:3]}")
    lossless = {"add_leaf_bones": False, "bake_anim_simplify_factor": 0.0}
    if WAY.startswith("fbx"):
        bpy.ops.export_scene.fbx(filepath=path, **(lossless if WAY.endswith("set") else {}))
    else:
        bpy.ops.wm.usd_export(filepath=path, export_animation=True)
    bpy.ops.wm.read_factory_settings(use_empty=True)
    if WAY.startswith("fbx"):
        bpy.ops.import_scene.fbx(filepath=path)
    else:
        bpy.ops.wm.usd_import(filepath=path)
    seen_in_scene()
if WAY == "glb, set":
    import json
    import struct

    with open(GLB, "rb") as file:  # the rate of a glTF file stands nowhere: take it from the keys
        file.seek(12)
        size, _ = struct.unpack("<II", file.read(8))
        tree = json.loads(file.read(size))
    sampler = tree["animations"][0]["samplers"][0]
    keys = tree["accessors"][sampler["input"]]
    scene.render.fps = round((keys["count"] - 1) / (keys["max"][0] - keys["min"][0]))
    bpy.ops.import_scene.gltf(filepath=GLB)
    bpy.ops.export_scene.gltf(filepath=BACK_GLB)
