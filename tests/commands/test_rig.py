"""`motionlab retarget --onto`, `convert --skeleton`: which rigs are read, and how what is brought to
them is written."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import any_rig
import pytest
import rig_names
import tiny_acclaim
import torch

from motionlab import Motion, Skeleton, read_amc, read_bvh, write_bvh, write_gltf
from motionlab.__main__ import main
from motionlab.commands.rig import brought_onto
from motionlab.datasets import gaits

WALK = gaits.make(seconds=1, speed=1.2, name="walk")


def same(found: Motion, wanted: Motion, metres: float = 1e-4) -> bool:
    return bool((found.positions() - wanted.positions()).abs().max() < metres)


@pytest.mark.parametrize(
    "command", [["retarget", "--no-rig-axes", "--onto"], ["convert", "--skeleton"]]
)
def test_onto_another_rig(here, capsys, command):
    """Whose axes lie anyhow, in metres; a person stands in its only frame."""
    wanted = replace(WALK.skeleton, offsets=1.2 * WALK.skeleton.offsets)
    stance = Motion(wanted, torch.zeros(1, 3), torch.eye(3).repeat(1, 21, 1, 1), 30)
    names = rig_names.names_of(rig_names.CONVENTIONS["unreal"])
    write_bvh(any_rig.drawn(stance, any_rig.random_axes(21, 0), names), "rig.bvh", units="m")
    name, *options = command
    assert main([name, "walk.bvh", *options, "rig.bvh", "--rig-units", "m", "--out", "x.bvh"]) == 0
    out = capsys.readouterr().out
    assert "onto rig, from foot to head 1.34 m and now 1.61 m" in out and "note" not in out
    found = read_bvh("x.bvh")
    assert list(found.skeleton.names) == names
    assert same(found, read_bvh("walk.bvh").retarget(wanted), 1e-3)


def test_in_the_axes_and_the_unit_of_the_rig(here, capsys):
    """So that it drops onto the rig: read as the rig is, it is the motion."""
    taller = replace(WALK.skeleton, offsets=1.2 * WALK.skeleton.offsets)
    stance = Motion(taller, torch.zeros(1, 3), torch.eye(3).repeat(1, 21, 1, 1), 30)
    write_bvh(any_rig.drawn(stance, any_rig.random_axes(21, 0)), "rig.bvh", units="in", up="z")
    rig = ["rig.bvh", "--rig-units", "in", "--rig-up", "z"]
    wanted = read_bvh("walk.bvh").retarget(taller)
    for command in (["retarget", "--onto"], ["convert", "--rig-axes", "--skeleton"]):
        assert main([command[0], "walk.bvh", *command[1:], *rig, "--out", "x.bvh", "--force"]) == 0
        assert "as the rig's file is: z up, units in" in capsys.readouterr().out
        assert same(read_bvh("x.bvh", units="in", up="z"), wanted, 1e-3)
        assert header("x.bvh") == header("rig.bvh")
    assert main(["retarget", "walk.bvh", "--no-rig-axes", "--onto", *rig, "--out", "y.bvh"]) == 0
    assert "unlike the rig's file, y up and in centimetres" in capsys.readouterr().out
    assert same(read_bvh("y.bvh"), wanted, 1e-3)
    assert main(["retarget", "walk.bvh", "--onto", *rig, "--out", "x.glb"]) == 0
    assert "rig's file" not in capsys.readouterr().out  # GLB is y up, in metres, whoever writes it
    assert main(["convert", "x.glb", "--out", "z.bvh"]) == 0
    assert same(read_bvh("z.bvh"), wanted, 1e-3)


def header(path) -> list[str]:
    """The words of a hierarchy."""
    return Path(path).read_text(encoding="utf-8").partition("MOTION")[0].split()


def test_a_skeleton_file_of_acclaim_s_is_a_rig(here, capsys):
    (here / "body.asf").write_text(tiny_acclaim.asf())
    (here / "body.amc").write_text(tiny_acclaim.amc(tiny_acclaim.sway(1)))
    for command in (["retarget", "--onto"], ["convert", "--skeleton"]):
        assert (
            main([command[0], "walk.bvh", *command[1:], "body.asf", "--out", "x.bvh", "--force"])
            == 0
        )
        assert "onto body, from foot to head 1.34 m and now" in capsys.readouterr().out
        found = read_bvh("x.bvh")
        assert found.skeleton.matches(read_amc("body.amc", fps=120).skeleton)
        back = found.retarget(Skeleton.canonical())
        hips = lambda motion: motion.positions()[:, motion.skeleton.role("hips")]
        assert (hips(back) - hips(WALK)).abs().max() < 0.05
    (here / "bad.asf").write_text("no skeleton")
    assert main(["retarget", "walk.bvh", "--onto", "bad.asf", "--out", "y.bvh"]) == 1
    assert "bad.asf, line 1" in capsys.readouterr().err


def test_which_animation_is_asked_for(here, capsys):
    """Of a file to read and of a rig's."""
    write_gltf(WALK, "one.glb")
    data = (here / "one.glb").read_bytes()
    end = 20 + int.from_bytes(data[12:16], "little")
    tree = json.loads(data[20:end])
    tree["animations"] = [{**tree["animations"][0], "name": name} for name in ("Walk", "Run")]
    text = json.dumps(tree).encode()
    text += b" " * (-len(text) % 4)
    sizes = [
        (len(data) - end + 20 + len(text)).to_bytes(4, "little"),
        len(text).to_bytes(4, "little"),
    ]
    both = data[:8] + sizes[0] + sizes[1] + data[16:20] + text + data[end:]
    (here / "two.glb").write_bytes(both)
    for command, option in (
        ("convert two.glb", "--animation"),
        ("retarget walk.bvh --onto two.glb", "--rig-animation"),
    ):
        assert main([*command.split(), "--out", "x.bvh"]) == 1
        assert f"{option}=Walk" in capsys.readouterr().err
        assert main([*command.split(), option, "Run", "--out", "x.bvh", "--force"]) == 0
        assert same(read_bvh("x.bvh"), WALK, 1e-3)


@pytest.mark.parametrize("path", ["folder/tiny.bvh", "folder"])
@pytest.mark.parametrize("command", ["clean", "retarget"])
def test_units_come_before_what_they_spoil(here, capsys, command, path):
    """A body of 1 cm has bones that are none; to name them first would lead astray."""
    (here / "folder").mkdir()
    write_bvh(WALK, "folder/tiny.bvh", units="m")
    out = "done" if path == "folder" else "x.bvh"
    assert main([command, path, "--out", out]) == 1
    said = capsys.readouterr().err
    assert "tiny.bvh: looks as if read wrongly; read it with --units=m. As it is now: " in said
    assert said.index("--units=m") < said.index("bone")


def test_units_of_a_rig_come_before_what_they_spoil(here, capsys):
    write_bvh(WALK, "tiny.bvh", units="m")
    assert main(["retarget", "walk.bvh", "--onto", "tiny.bvh", "--out", "x.bvh"]) == 1
    said = capsys.readouterr().err
    assert said.startswith("motionlab: tiny.bvh: from foot to head")
    assert said.index("--rig-units=m") < said.index("no bone")


def test_what_dips_below_the_floor_is_told():
    """Feet are kept on the floor; hands of a body with arms three times as long are not."""
    walk = gaits.make(seconds=1)
    offsets, roles = walk.skeleton.offsets.clone(), walk.skeleton.roles
    for side in ("left", "right"):
        for part in ("lower_arm", "hand"):
            offsets[roles[f"{side}_{part}"]] *= 3
    ape = replace(walk, skeleton=replace(walk.skeleton, offsets=offsets), name="ape")
    moved, said = brought_onto(walk, ape)
    hands = [roles["left_hand"], roles["right_hand"]]
    lowest = -100 * moved.positions()[:, hands, 1].min()
    assert lowest > 10
    assert len(said) == 2 and said[1].endswith(" s)")
    assert f"Hand up to {lowest:.0f} cm below the floor (at 0." in said[1]
    assert len(brought_onto(ape, None)[1]) == 1  # on arms of a person's length they are above it
    assert len(brought_onto(walk, replace(ape, skeleton=walk.skeleton))[1]) == 1
