"""`motionlab convert --for`: what is written is what the program needs."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import torch
from glb_reader import Glb
from three_in_node import in_three, three_plays

from motionlab import read_bvh, write_bvh
from motionlab.__main__ import main
from motionlab.commands.programs import PROGRAMS
from motionlab.datasets import gaits

WALK = gaits.make(seconds=1, speed=1.2, name="walk")


def convert(*options: str) -> int:
    return main(["convert", "walk.bvh", *options])


@pytest.mark.parametrize("program", PROGRAMS)
def test_every_format_of_a_program_is_written(here, program, capsys):
    its = PROGRAMS[program]
    (here / "for").mkdir()
    assert convert("--for", program, "--out", "for") == 0
    assert [file.name for file in Path("for").iterdir()] == [f"walk{its.endings[0]}"]
    assert capsys.readouterr().out.endswith(f"note: {its.note}.\n")
    for ending in its.endings:
        assert convert("--for", program, "--out", f"x{ending}") == 0
        assert Path(f"x{ending}").stat().st_size > 1000
    if ".bvh" in its.endings:
        read = read_bvh("x.bvh", units=its.units, up=its.up)
        torch.testing.assert_close(read.positions(), WALK.positions(), rtol=0, atol=1e-4)


@pytest.mark.parametrize("program", ["unreal", "unity"])
def test_engines_get_a_root(here, program):
    assert convert("--for", program, "--out", "x.glb") == 0
    assert Glb("x.glb").tree["nodes"][Glb("x.glb").tree["scenes"][0]["nodes"][0]]["name"] == "Root"
    assert convert("--for", program, "--root-motion", "in-place", "--out", "y.glb") == 0
    assert "Root" not in [node["name"] for node in Glb("y.glb").tree["nodes"]]


def test_what_does_not_go_together_is_refused(here, capsys):
    for options, words in (
        (["--for", "mujoco", "--out", "x.glb"], "--out x.glb: ends in none of .xml"),
        (["--for", "usd", "--to", "glb", "--out", "x"], "--to glb: this program opens .usda"),
        (["--for", "three", "--rig-axes", "--out", "x.bvh"], "leave one of them out"),
        (["--out", "x.usda", "--root-motion", "ground"], "no root joint on the floor"),
    ):
        assert convert(*options) == 1
        assert words in capsys.readouterr().err
    assert not list(here.glob("x*"))


@in_three
@pytest.mark.parametrize("ending", PROGRAMS["three"].endings)
def test_in_three(here, ending):
    names = ["rig:" + name for name in WALK.skeleton.names]
    body = WALK.skeleton
    write_bvh(type(WALK)(type(body)(names, body.parents, body.offsets, body.end_parents, body.end_offsets), WALK.root_positions, WALK.rotations, 30), "walk.bvh")  # fmt: skip
    assert convert("--for", "three", "--out", f"x{ending}") == 0
    (places,) = three_plays(here / f"x{ending}", (len(WALK) - 1) / 30)["stop"]
    found = {name.replace("rig", "").strip("_:"): at for name, at in places.items()}
    for joint, name in enumerate(body.names):
        np.testing.assert_allclose(found[name], WALK.positions()[-1, joint].numpy(), atol=1e-4)


@pytest.mark.filterwarnings(
    "ignore::pytest.PytestUnraisableExceptionWarning"
)  # it leaves files open
@pytest.mark.parametrize("ending", PROGRAMS["blender"].endings)
def test_in_blender(here, ending):
    bpy = pytest.importorskip("bpy", reason="needs pip install bpy, in Python 3.11")
    assert convert("--for", "blender", "--out", f"x{ending}") == 0
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene, file = bpy.context.scene, str(here / f"x{ending}")
    scene.render.fps = 24 if ending == ".bvh" else 30
    first = 0
    if ending == ".glb":
        bpy.ops.import_scene.gltf(filepath=file)
    elif ending == ".usda":
        bpy.ops.wm.usd_import(filepath=file)
    else:
        first = 1
        bpy.ops.import_anim.bvh(filepath=file, update_scene_fps=True, update_scene_duration=True)
    assert scene.render.fps == 30
    (armature,) = (each for each in bpy.data.objects if each.type == "ARMATURE")
    for frame in (0, 7, 29):
        scene.frame_set(frame + first)
        posed = armature.evaluated_get(bpy.context.evaluated_depsgraph_get())
        for joint, name in enumerate(WALK.skeleton.names):
            x, y, z = posed.matrix_world @ posed.pose.bones[name].head
            expected = WALK.positions()[frame, joint].numpy()
            np.testing.assert_allclose((x, z, -y), expected, atol=1e-4)
