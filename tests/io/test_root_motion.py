"""Way and heading on a root joint, or left out: no joint moves for it, in either format."""

from __future__ import annotations

from dataclasses import replace

import any_rig
import numpy as np
import pytest
import torch
from glb_reader import Glb
from hypothesis import given, settings
from hypothesis import strategies as st

from motionlab import Motion, Skeleton, read_bvh, read_gltf, write_bvh, write_gltf
from motionlab.datasets import gaits
from motionlab.errors import MotionError
from motionlab.io.root_motion import in_place, split
from motionlab.kinematics import heading

TURNING = gaits.make(seconds=2, speed=1.4, turn_rate=0.8, name="turning")


def assert_same_points(a: Motion, b: Motion, metres: float = 1e-4) -> None:
    assert a.skeleton.point_names == b.skeleton.point_names
    torch.testing.assert_close(a.positions(), b.positions(), rtol=0, atol=metres)


@given(
    degrees=st.floats(-180, 180), x=st.floats(-9, 9), z=st.floats(-9, 9), seed=st.integers(0, 99)
)
@settings(max_examples=12, deadline=None)
def test_in_place_forgets_where_and_whither_and_nothing_else(degrees, x, z, seed):
    body = any_rig.drawn(TURNING, any_rig.random_axes(21, seed))  # however its axes lie
    found, wanted = in_place(any_rig.moved(body, degrees, (x, 0, z))), in_place(TURNING)
    torch.testing.assert_close(found.positions(), wanted.positions(), rtol=0, atol=2e-4)
    hips = found.positions()[:, 0]
    assert hips[:, [0, 2]].abs().max() < 1e-5
    torch.testing.assert_close(hips[:, 1], TURNING.positions()[:, 0, 1])
    apart = lambda m: (m.positions()[:, :, None] - m.positions()[:, None]).norm(dim=-1)
    torch.testing.assert_close(apart(found), apart(TURNING), rtol=0, atol=1e-4)


def test_it_faces_ahead_and_is_told_apart_exactly():
    parts = split(TURNING)
    whole = parts.way[:, None] + (parts.turn[:, None] @ parts.body.positions()[..., None])[..., 0]
    torch.testing.assert_close(whole, TURNING.positions(), rtol=0, atol=1e-5)
    assert parts.way[:, 1].abs().max() == 0
    assert heading(parts.body.rotations[:, 0]).abs().max() < 0.2  # pelvis against shoulders
    assert parts.body.contacts is TURNING.contacts
    # the root turns as the way does, without most of the pelvis' to and fro
    sway = lambda yaw: (torch.diff(yaw) * TURNING.fps - 0.8).abs().max()
    assert sway(heading(parts.turn)) < 0.6 * sway(heading(TURNING.rotations[:, 0]))


@pytest.mark.parametrize("source", ["canonical", "odd axes", "root above hips", "no arms"])
def test_a_root_on_the_floor_moves_no_joint(tmp_path, source):
    motion = TURNING
    if source == "odd axes":
        motion = any_rig.drawn(motion, any_rig.random_axes(21, 0))
    if source == "root above hips":
        motion = with_root(motion)
    if source == "no arms":
        names = [f"part{i}" if "Arm" in n else n for i, n in enumerate(motion.skeleton.names)]
        motion = replace(motion, skeleton=replace(motion.skeleton, names=names))
    write_bvh(motion, tmp_path / "a.bvh", root_motion="ground")
    assert_same_points(read_bvh(tmp_path / "a.bvh"), motion)  # which folds the root

    write_gltf(motion, tmp_path / "a.glb", root_motion="ground")
    if (
        source != "root above hips"
    ):  # whose root is a joint of the body, and one that only carries it
        assert_same_points(read_gltf(tmp_path / "a.glb"), motion)
    glb = Glb(tmp_path / "a.glb")
    worlds = glb.worlds(len(motion))
    joints = motion.skeleton.points
    places = motion.positions().numpy()
    assert np.abs(worlds[:, :joints, :3, 3] - places).max() < 1e-5
    (root,) = (i for i, node in enumerate(glb.tree["nodes"]) if node.get("children") == [0])
    hips = places[:, motion.skeleton.roles["hips"]]
    assert np.abs(worlds[:, root, :3, 3] - hips * [1, 0, 1]).max() < 1e-5
    assert np.abs(worlds[:, root, 1, :3] - [0, 1, 0]).max() < 1e-6  # upright
    write_gltf(motion, tmp_path / "b.glb")
    usual = Glb(tmp_path / "b.glb")
    assert np.abs(glb.posed(len(motion)) - usual.posed(len(motion))).max() < 1e-4
    assert glb.tree["skins"][0]["joints"][-1] == root


def test_what_stands_in_the_bvh_file(tmp_path):
    write_bvh(TURNING, tmp_path / "a.bvh", root_motion="ground")
    head, _, rows = (tmp_path / "a.bvh").read_text().partition("MOTION\n")
    assert head.startswith("HIERARCHY\nROOT Root\n{") and head.count("ROOT") == 1
    assert "\tJOINT Hips\n" in head and head.count("{") == head.count("}") and head.endswith("}\n")
    numbers = np.array([row.split() for row in rows.splitlines()[2:]], float)
    assert numbers.shape == (60, 6 + 3 + 3 * 21)
    parts = split(TURNING)
    assert np.abs(numbers[:, :3] / 100 - parts.way.numpy()).max() < 1e-6
    assert np.abs(np.deg2rad(numbers[:, 3]) - heading(parts.turn).numpy()).max() < 1e-6
    assert np.abs(numbers[:, 6:9:2]).max() < 1e-3  # the hips stay above the root


@pytest.mark.parametrize("suffix", ["bvh", "glb"])
def test_in_place_in_files(tmp_path, suffix):
    write = {"bvh": write_bvh, "glb": write_gltf}[suffix]
    write(TURNING, tmp_path / f"a.{suffix}", root_motion="in-place")
    write(in_place(TURNING), tmp_path / f"b.{suffix}")
    assert (tmp_path / f"a.{suffix}").read_bytes() == (tmp_path / f"b.{suffix}").read_bytes()


def test_names_that_are_taken_and_words_that_are_none(tmp_path):
    names = ["Root", *TURNING.skeleton.names[1:]]
    write_bvh(
        replace(TURNING, skeleton=replace(TURNING.skeleton, names=names)),
        tmp_path / "a.bvh",
        root_motion="ground",
    )
    assert "ROOT RootMotion\n" in (tmp_path / "a.bvh").read_text()
    for write, name in ((write_bvh, "b.bvh"), (write_gltf, "b.glb")):
        with pytest.raises(
            MotionError, match="root_motion='floor' is not known; use 'in-place' or"
        ):
            write(TURNING, tmp_path / name, root_motion="floor")
        assert not (tmp_path / name).exists()


def with_root(motion: Motion) -> Motion:
    """The motion with the hips 10 cm behind a root that they hang on."""
    s, back = motion.skeleton, torch.tensor([[0.0, 0.0, -0.1]])
    skeleton = Skeleton(
        ["Reference", *s.names],
        [-1, *(parent + 1 for parent in s.parents)],
        torch.cat([torch.zeros(1, 3), back, s.offsets[1:]]),
        [parent + 1 for parent in s.end_parents],
        s.end_offsets,
    )
    turns = torch.cat([torch.eye(3).expand(len(motion), 1, 3, 3), motion.rotations], 1)
    return replace(
        motion, skeleton=skeleton, rotations=turns, root_positions=motion.root_positions - back
    )
