"""`write_bvh(..., like=)`: motion below the header of its rig's own file."""

from __future__ import annotations

import re
from dataclasses import replace

import pytest
import roma
import torch

from motionlab import Motion, Skeleton, read_bvh, write_bvh
from motionlab.datasets import gaits
from motionlab.errors import BvhError

WALK = gaits.make(seconds=0.5, speed=1.4, turn_rate=0.4, seed=3)
BODY = Skeleton.canonical()
ORDERS = ("Zrotation Yrotation Xrotation", "Xrotation Zrotation Yrotation")
# x, y, z of the body in the axes of a file whose axis is up
AXES = {"y": (0, 1, 2), "z": (2, 0, 1)}


def header(up: str = "y", unit: float = 0.01) -> str:
    """A rig's hierarchy as text: offsets of nine digits, a root that turns before it moves."""
    lines, children = ["HIERARCHY"], {}
    for joint, parent in enumerate(BODY.parents):
        children.setdefault(parent, []).append(joint)

    def offset(vector) -> str:
        x, y, z = (float(vector[axis]) / unit + 1.2345e-4 for axis in AXES[up])
        return f"OFFSET {x:.9g} {y:.9g}  {z:.9g}"

    def put(joint: int, depth: int) -> None:
        kind = "JOINT" if depth else "ROOT"
        moves = "" if depth else " Xposition Zposition Yposition"
        lines.append(f"{kind} {BODY.names[joint]}")
        lines.extend(["{", offset(BODY.offsets[joint])])
        lines.append(f"CHANNELS {3 + 3 * (not depth)} {ORDERS[joint % 2]}{moves}")
        for below in children.get(joint, []):
            put(below, depth + 1)
        for end, parent in enumerate(BODY.end_parents):
            if parent == joint:
                lines.extend(["End Site", "{", offset(BODY.end_offsets[end]), "}"])
        lines.append("}")

    put(0, 0)
    return "\n".join(lines)


def rig_file(path, text: str, row: dict[int, float] | None = None) -> None:
    """One frame at rest; row : what is not zero, by column."""
    width = sum(int(count) for count in re.findall(r"CHANNELS (\d+)", text))
    values = " ".join(f"{(row or {}).get(column, 0):g}" for column in range(width))
    path.write_text(f"{text}\nMOTION\nFrames: 1\nFrame Time: 0.04\n{values}\n", encoding="utf-8")


def on(rig: Motion, motion: Motion = WALK) -> Motion:
    return replace(motion, skeleton=rig.skeleton, contacts=None)


def plain(path) -> list[list[str]]:
    """The words of the hierarchy, line by line."""
    head = path.read_text(encoding="utf-8").partition("MOTION")[0]
    return [line.split() for line in head.split("\n") if line.split()]


def check_same(found: Motion, wanted: Motion) -> None:
    assert found.fps == wanted.fps and found.skeleton.names == wanted.skeleton.names
    torch.testing.assert_close(found.positions(), wanted.positions(), rtol=0, atol=1e-5)
    torch.testing.assert_close(found.rotations, wanted.rotations, rtol=0, atol=1e-5)


@pytest.mark.parametrize(("up", "units", "unit"), [("z", "in", 0.0254), ("y", "cm", 0.01)])
@pytest.mark.parametrize("root_motion", [None, "ground", "in-place"])
def test_the_header_stays_to_the_letter(tmp_path, up, units, unit, root_motion):
    rig_file(tmp_path / "rig.bvh", header(up, unit))
    rig = read_bvh(tmp_path / "rig.bvh", units=units, up=up)
    out = tmp_path / "out.bvh"
    motion = on(rig)
    write_bvh(motion, out, units=units, up=up, like=tmp_path / "rig.bvh", root_motion=root_motion)
    found = read_bvh(out, units=units, up=up)
    head, expected = plain(out), plain(tmp_path / "rig.bvh")
    if root_motion == "ground":
        assert head[1] == ["ROOT", "Root"] and head[5:-1] == [["JOINT", "Hips"], *expected[2:]]
    else:
        assert head == expected
    if root_motion == "in-place":
        assert found.positions()[:, 0, [0, 2]].abs().max() < 1e-5
    else:
        check_same(found, motion)


def test_a_root_that_carries_the_body_and_what_else_hangs_there_stay(tmp_path):
    """As Unreal's: a root with a pelvis and targets for feet, of which the body alone is read."""
    body = header().partition("ROOT ")[2]
    text = (
        "HIERARCHY\nROOT root\n{\nOFFSET 0 3 0\nCHANNELS 3 Zrotation Xrotation Yrotation\n"
        "JOINT ik_foot_root\n{\nOFFSET 0 1 0\nCHANNELS 3 Zrotation Xrotation Yrotation\n"
        "End Site\n{\nOFFSET 0 1 0\n}\n}\n"
        f"JOINT {body}\n}}"
    )
    path, out = tmp_path / "rig.bvh", tmp_path / "out.bvh"
    rig_file(path, text, {9: 50.0, 10: 3.0, 11: 90.0})
    with pytest.warns(UserWarning, match="ik_foot_root"):
        rig = read_bvh(path)
    assert rig.skeleton.names == BODY.names
    write_bvh(on(rig), out, like=path)
    head, expected = plain(out), plain(path)
    channels = head[4]
    assert channels[1] == "6" and channels[2:5] == ["Xposition", "Yposition", "Zposition"]
    assert head[:4] + head[5:] == expected[:4] + expected[5:]  # the root may move now, no more
    with pytest.warns(UserWarning, match="ik_foot_root"):
        check_same(read_bvh(out), on(rig))


def test_channels_are_added_where_the_motion_needs_them(tmp_path):
    text = header().split("\n")
    for name, channels in (
        ("LeftLowerLeg", "1 Xrotation"),
        ("LeftFoot", "1 Xrotation"),
        ("Neck", "7 Xposition Yposition Zposition Yscale Yrotation Xrotation Zrotation"),
    ):
        (where,) = (i for i, line in enumerate(text) if line == f"JOINT {name}")
        text[where + 3] = f"CHANNELS {channels}"
    path, out = tmp_path / "rig.bvh", tmp_path / "out.bvh"
    rig_file(path, "\n".join(text))
    with pytest.warns(UserWarning, match="scaled"):
        rig = read_bvh(path)
    assert rig.skeleton.offsets[3].abs().max() < 1e-6  # the neck is where its channels say
    rotations = WALK.rotations.clone()
    names = list(rig.skeleton.names)
    rotations[:, names.index("LeftLowerLeg")] = roma.rotvec_to_rotmat(
        torch.linspace(0, 1, len(WALK))[:, None] * torch.tensor([1.0, 0, 0])
    )
    motion = replace(on(rig), rotations=rotations)
    write_bvh(motion, out, like=path)
    head = dict(zip(map(tuple, plain(out)), plain(out)[3:], strict=False))
    assert head["JOINT", "LeftLowerLeg"] == ["CHANNELS", "1", "Xrotation"]
    assert head["JOINT", "LeftFoot"][1] in ("2", "3")
    assert head["JOINT", "Neck"][1:5] == ["6", "Xposition", "Yposition", "Zposition"]
    check_same(read_bvh(out), motion)


def test_a_rest_pose_that_stands_along_y_in_a_file_of_z_up_stays(tmp_path):
    path, out = tmp_path / "rig.bvh", tmp_path / "out.bvh"
    rig_file(path, header(), {2: 90.0})
    rig = read_bvh(path, up="z")
    assert float(rig.positions()[0, rig.skeleton.role("head"), 1]) > 0.4
    write_bvh(on(rig), out, up="z", like=path)
    assert plain(out) == plain(path)
    check_same(read_bvh(out, up="z"), on(rig))


def test_a_file_of_another_rig_is_refused(tmp_path):
    path, out = tmp_path / "rig.bvh", tmp_path / "out.bvh"
    rig_file(path, header().replace("JOINT Neck", "JOINT Nacken"))
    with pytest.raises(BvhError, match="rig.bvh: is no file of the motion's rig: .*'Nacken'"):
        write_bvh(WALK, out, like=path)
    with pytest.raises(BvhError, match="none.bvh: can't be opened"):
        write_bvh(WALK, out, like=tmp_path / "none.bvh")
    assert not out.exists()
