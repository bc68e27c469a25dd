"""`motionlab convert --for`: what is written is what the program needs."""

from __future__ import annotations

import re
from dataclasses import replace
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
    for ending in its.endings:
        capsys.readouterr()
        assert convert("--for", program.upper(), "--out", f"x{ending}") == 0
        said = capsys.readouterr().out
        assert said.endswith(f"note: {its.note(ending, its.root_motion)}.\n")
        assert ("Update Scene FPS" in said) == ("bpy" in its.tried and ending == ".bvh")
        assert ("not tried in" in said) == (not its.tried)
        assert ("in metres: motionlab reads it back with --units m" in said) == (
            ending == ".bvh" and its.units == "m"
        )
        assert Path(f"x{ending}").stat().st_size > 1000
    if ".bvh" in its.endings:
        read = read_bvh("x.bvh", units=its.units, up=its.up)
        torch.testing.assert_close(read.positions(), WALK.positions(), rtol=0, atol=1e-4)


@pytest.mark.parametrize("program", ["unreal", "unity"])
def test_engines_get_a_root(here, program, capsys):
    assert convert("--for", program, "--out", "x.glb") == 0
    assert "let the engine move the character by its root joint" in capsys.readouterr().out
    assert Glb("x.glb").tree["nodes"][Glb("x.glb").tree["scenes"][0]["nodes"][0]]["name"] == "Root"
    for file, way, said in (("y", "in-place", "stays on its spot"), ("z", "None", "no root joint")):
        assert convert("--for", program, "--root-motion", way, "--out", f"{file}.glb") == 0
        assert "Root" not in [node["name"] for node in Glb(f"{file}.glb").tree["nodes"]]
        out = capsys.readouterr().out
        assert said in out and "by its root joint" not in out
    np.testing.assert_allclose(
        Glb("z.glb").worlds(30)[:, 0, :3, 3], WALK.positions()[:, 0], atol=1e-4
    )


@pytest.mark.parametrize("ending", ["glb", "bvh"])
def test_a_root_that_differs_in_capitals_alone_is_one_name_too_many(here, ending, capsys):
    names = ["root", *WALK.skeleton.names[1:]]
    write_bvh(replace(WALK, skeleton=replace(WALK.skeleton, names=names)), "rig.bvh")
    assert main(["convert", "rig.bvh", "--root-motion", "ground", "--out", f"x.{ending}"]) == 0
    assert "called RootMotion, as there is root already" in capsys.readouterr().out
    if ending == "glb":
        found = [node["name"] for node in Glb("x.glb").tree["nodes"]]
        assert "RootMotion" in found and "Root" not in found
    else:
        assert "ROOT RootMotion\n" in Path("x.bvh").read_text()


def test_names_that_change_are_told(here, capsys):
    names = ["mixamorig:" + name for name in WALK.skeleton.names]
    write_bvh(replace(WALK, skeleton=replace(WALK.skeleton, names=names)), "rig.bvh")
    for program, out, of in (
        ("three", "x.bvh", 21),
        ("usd", "x.usda", 26),
        ("blender", "y.bvh", 0),
    ):
        assert main(["convert", "rig.bvh", "--for", program, "--out", out]) == 0
        told = f"{of} of {of} names changed, as mixamorig:Hips to mixamorig_Hips"
        assert (told in capsys.readouterr().out) == bool(of)


def test_without_out_it_goes_into_the_current_folder(here, capsys):
    assert convert("--for", "Blender") == 0
    assert convert("--to", "usda") == 0
    assert main(["convert", "clips", "--for", "usd"]) == 0
    wanted = ("walk.glb", "walk.usda", "clips_usd/a.usda", "clips_usd/more/b.usda")
    assert all((here / name).is_file() for name in wanted)
    for options, said in (
        ([], "into what? Name a file, as --out walk.glb, or a program, as --for blender"),
        (["--to", "bvh", "--force"], "would replace what it reads; name an --out"),
    ):
        assert convert(*options) == 1
        assert said in capsys.readouterr().err
    assert read_bvh("walk.bvh").seconds == 1


def test_help_begins_with_what_is_asked_most_and_offers_no_none(capsys):
    with pytest.raises(SystemExit):
        main(["convert", "--help"])
    said = capsys.readouterr().out
    names = ("out", "for", "to", "units", "rig-units")
    places = [re.search(rf"^\W*--{name} ", said, re.MULTILINE).start() for name in names]
    assert places == sorted(places)
    assert "None|" not in said and "{None" not in said
    assert "--for blender|three|unreal|unity|mujoco|usd" in said


def test_what_does_not_go_together_is_refused(here, capsys):
    for options, words in (
        (["--for", "mujoco", "--out", "x.glb"], "--out x.glb: MuJoCo opens .xml alone; name a"),
        (
            ["--for", "unreal", "--out", "x.bvh"],
            "Unreal opens .glb alone; name a file such as x.glb",
        ),
        (["--for", "usd", "--to", "glb", "--out", "x"], "--to glb: USD opens .usda alone"),
        (
            ["--for", "mujco"],
            "motionlab: --for mujco: did you mean mujoco? There are blender, three, unr",
        ),
        (["--for", "Godot"], "motionlab: --for Godot: Godot opens GLB as it comes"),
        (["--for", "maya"], "motionlab: --for maya: There are blender, three,"),
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
