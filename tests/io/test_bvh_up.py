"""Files whose x or z points up: turned on request, and told if nobody says so."""

from __future__ import annotations

from dataclasses import replace

import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from motionlab import Motion, Skeleton, read_bvh, write_bvh
from motionlab.datasets import gaits
from motionlab.errors import BvhError
from motionlab.kinematics import yaw_matrix

# What a point at (x, y, z) of the file becomes.
TURNED = {
    "y": lambda x, y, z: (x, y, z),
    "-y": lambda x, y, z: (x, -y, -z),
    "z": lambda x, y, z: (x, z, -y),
    "-z": lambda x, y, z: (x, -z, y),
    "x": lambda x, y, z: (-y, x, z),
    "-x": lambda x, y, z: (y, -x, z),
}
OTHER = [axis for axis in TURNED if axis != "y"]


def walk(seconds: float = 1.0) -> Motion:
    return gaits.make(seconds=seconds, speed=1.4, turn_rate=0.4, seed=3)


def matrix(up: str) -> torch.Tensor:
    """Of what `TURNED` does, (3, 3)."""
    return torch.tensor([TURNED[up](*axis) for axis in torch.eye(3).tolist()]).T


def in_file(motion: Motion, up: str) -> Motion:
    """The motion as a program writes it for which `up` points up: all vectors in its axes."""
    turn, skeleton = matrix(up), motion.skeleton
    skeleton = Skeleton(
        skeleton.names, skeleton.parents, skeleton.offsets @ turn, skeleton.end_parents,
        skeleton.end_offsets @ turn, ("XYZ",) * skeleton.joints,
    )  # fmt: skip
    return replace(
        motion,
        skeleton=skeleton,
        root_positions=motion.root_positions @ turn,
        rotations=turn.T @ motion.rotations @ turn,
        contacts=None,
    )


@pytest.mark.parametrize("up", TURNED)
def test_turns_are_rotations_that_bring_the_axis_up(up):
    sign, axis = (-1.0 if "-" in up else 1.0), "xyz".index(up[-1])
    assert torch.linalg.det(matrix(up)) == 1
    assert (matrix(up)[:, axis] * sign).tolist() == [0, 1, 0]


@pytest.mark.parametrize("up", TURNED)
def test_any_axis_may_be_up(up, tmp_path):
    motion, path = walk(), tmp_path / "clip.bvh"
    write_bvh(in_file(motion, up), path)
    raw, read = read_bvh(path, up="y"), read_bvh(path, up=up)
    expected = torch.stack(TURNED[up](*raw.positions().unbind(-1)), -1)
    torch.testing.assert_close(read.positions(), expected)
    torch.testing.assert_close(read.positions(), motion.positions(), rtol=0, atol=1e-5)
    assert read.skeleton.matches(motion.skeleton)  # the rest pose stands upright, too
    torch.testing.assert_close(read.rotations, motion.rotations, rtol=0, atol=1e-5)
    torch.testing.assert_close(read.retarget().positions(), motion.positions(), rtol=0, atol=1e-4)


@settings(max_examples=25, deadline=None)
@given(
    up=st.sampled_from(OTHER),
    orders=st.lists(st.permutations("XYZ").map("".join), min_size=21, max_size=21),
)
def test_written_again_it_is_the_same(up, orders, tmp_path_factory):
    folder = tmp_path_factory.mktemp("up")
    motion = in_file(walk(0.2), up)
    skeleton = motion.skeleton
    skeleton = Skeleton(
        skeleton.names, skeleton.parents, skeleton.offsets, skeleton.end_parents,
        skeleton.end_offsets, tuple(orders),
    )  # fmt: skip
    write_bvh(replace(motion, skeleton=skeleton), folder / "a.bvh")
    read = read_bvh(folder / "a.bvh", up=up)
    write_bvh(read, folder / "b.bvh")
    again = read_bvh(folder / "b.bvh")
    assert again.skeleton.rotation_orders == read.skeleton.rotation_orders
    torch.testing.assert_close(again.positions(), read.positions(), rtol=0, atol=1e-5)


def test_angles_stay_what_they_were(tmp_path):
    """About the turned axes, in the order of the file: "ZXY" of z-up becomes "YXZ" of y-up."""
    write_bvh(in_file(walk(0.2), "z"), tmp_path / "a.bvh")
    text = (tmp_path / "a.bvh").read_text(encoding="utf-8")
    zxy = text.replace("Xrotation Yrotation Zrotation", "Zrotation Xrotation Yrotation")
    (tmp_path / "a.bvh").write_text(zxy, encoding="utf-8")
    read = read_bvh(tmp_path / "a.bvh", up="z")
    assert set(read.skeleton.rotation_orders) == {"YXZ"}
    write_bvh(read, tmp_path / "b.bvh")
    rows = [
        torch.tensor([float(word) for word in path.read_text(encoding="utf-8").split()[-66:]])
        for path in (tmp_path / "a.bvh", tmp_path / "b.bvh")
    ]
    torch.testing.assert_close(rows[1][3:].abs(), rows[0][3:].abs(), rtol=0, atol=2e-4)


def test_a_rest_pose_that_stands_along_y_stays(tmp_path):
    """As of bodies whose root carries the quarter turn into a world of z-up."""
    motion, turn = walk(), matrix("z")
    rotations = motion.rotations.clone()
    rotations[:, 0] = turn.T @ rotations[:, 0]
    lying = replace(motion, root_positions=motion.root_positions @ turn, rotations=rotations)
    write_bvh(lying, tmp_path / "clip.bvh")
    read = read_bvh(tmp_path / "clip.bvh", up="z")
    assert read.skeleton.matches(motion.skeleton)
    torch.testing.assert_close(read.positions(), motion.positions(), rtol=0, atol=1e-5)
    torch.testing.assert_close(read.retarget().positions(), motion.positions(), rtol=0, atol=1e-4)


@pytest.mark.parametrize("up", ["w", "Z", "+z", "", "yz", 2, ["z"]])
def test_what_is_no_axis(up, tmp_path):
    with pytest.raises(BvhError, match="'y', '-y', 'z', '-z', 'x', '-x'"):
        read_bvh(tmp_path / "need_not_be_there.bvh", up=up)


# -- said wrongly ---------------------------------------------------------------------------------


@pytest.mark.parametrize("true", TURNED)
@pytest.mark.parametrize("said", OTHER)
def test_a_wrong_axis_is_told_with_the_right_one(true, said, tmp_path):
    write_bvh(in_file(walk(), true), tmp_path / "clip.bvh")
    if said == true:
        read_bvh(tmp_path / "clip.bvh", up=said)
        return
    with pytest.warns(UserWarning) as caught:
        read_bvh(tmp_path / "clip.bvh", up=said)
    (text,) = [str(warning.message) for warning in caught]
    assert text.startswith(f"{tmp_path / 'clip.bvh'}: read with up={said!r} ")
    assert f"read it with up={true!r}" in text


def test_who_crawls_about_in_a_file_of_another_axis_is_no_wrong_axis(tmp_path):
    """The trunk lies, but along no axis for long."""
    motion = gaits.make(seconds=3.4, speed=0)[:100]
    rotations = motion.rotations.clone()
    yaw = yaw_matrix(torch.linspace(0, 6, 100))
    rotations[:, 0] = yaw @ matrix("z").T @ rotations[:, 0]
    write_bvh(in_file(replace(motion, rotations=rotations), "z"), tmp_path / "clip.bvh")
    read_bvh(tmp_path / "clip.bvh", up="z")


# -- nobody says so -------------------------------------------------------------------------------


@pytest.mark.parametrize("up", OTHER)
@pytest.mark.parametrize("yaw", [0.0, 2.0])
def test_a_body_that_is_never_upright_is_told(up, yaw, tmp_path):
    motion, turn = walk(), yaw_matrix(torch.tensor(yaw))
    rotations = motion.rotations.clone()
    rotations[:, 0] = turn @ rotations[:, 0]
    motion = replace(motion, root_positions=motion.root_positions @ turn.T, rotations=rotations)
    write_bvh(in_file(motion, up), tmp_path / "clip.bvh")
    with pytest.warns(UserWarning) as caught:
        read_bvh(tmp_path / "clip.bvh")
    (said,) = [str(warning.message) for warning in caught]
    assert said.startswith(str(tmp_path / "clip.bvh"))
    assert f"trunk points along {up} " in said and f"up={up!r}" in said
    for axis in (up, "y"):  # said, so no warning
        read_bvh(tmp_path / "clip.bvh", up=axis)


@pytest.mark.parametrize("upright, told", [(0, True), (1, True), (10, False), (100, False)])
def test_who_stands_up_once_is_no_body_of_another_axis(upright, told, tmp_path):
    motion = gaits.make(seconds=3.4, speed=0)[:100]
    rotations = motion.rotations.clone()
    rotations[upright:, 0] = matrix("z").T @ rotations[upright:, 0]
    write_bvh(replace(motion, rotations=rotations), tmp_path / "clip.bvh")
    if told:
        with pytest.warns(UserWarning) as warned:  # of the jump, too
            read_bvh(tmp_path / "clip.bvh")
        assert any("up='z'" in str(each.message) for each in warned)
    else:
        read_bvh(tmp_path / "clip.bvh")


def test_of_joints_that_nobody_knows_nothing_is_said(tmp_path):
    motion = in_file(walk(0.2), "z")
    names = tuple(f"bone{i}" for i in range(motion.skeleton.joints))
    skeleton = Skeleton(names, motion.skeleton.parents, motion.skeleton.offsets)
    write_bvh(replace(motion, skeleton=skeleton), tmp_path / "clip.bvh")
    assert read_bvh(tmp_path / "clip.bvh").skeleton.names == names
    read = read_bvh(tmp_path / "clip.bvh", up="z")  # turned all the same
    torch.testing.assert_close(
        read.positions(), walk(0.2).positions()[:, : len(names)], rtol=0, atol=1e-5
    )


def test_a_rest_pose_that_stands_already_stays_also_if_its_roles_had_to_be_said(tmp_path):
    motion = walk()
    turn = matrix("z")
    carried = motion.rotations.clone()
    carried[:, 0] = turn.T @ carried[:, 0]  # the root carries the quarter turn
    motion = replace(
        motion, root_positions=motion.root_positions @ turn, rotations=carried, contacts=None
    )
    names = tuple(f"bone{joint}" for joint in range(motion.skeleton.joints))
    table = {role: names[joint] for role, joint in motion.skeleton.roles.items()}
    write_bvh(motion, tmp_path / "known.bvh")
    write_bvh(
        replace(motion, skeleton=replace(motion.skeleton, names=names)), tmp_path / "said.bvh"
    )
    known = read_bvh(tmp_path / "known.bvh", up="z")
    said = read_bvh(tmp_path / "said.bvh", up="z", roles=table)
    assert torch.equal(said.skeleton.offsets, known.skeleton.offsets)
    assert torch.allclose(known.skeleton.offsets[1:], motion.skeleton.offsets[1:], atol=1e-6)
    assert said.skeleton.roles == known.skeleton.roles
    turned = read_bvh(tmp_path / "said.bvh", up="z")  # nobody knows where its trunk is
    assert (turned.positions() - known.positions()).abs().max() < 1e-4


@pytest.mark.parametrize("up", TURNED)
@pytest.mark.parametrize("root_motion", [None, "ground"])
def test_written_with_an_axis_up_it_is_read_with_it(up, root_motion, tmp_path):
    motion, path = walk(), tmp_path / "clip.bvh"
    write_bvh(motion, path, up=up, units="in", root_motion=root_motion)
    read, raw = (read_bvh(path, units="in", up=axis) for axis in (up, "y"))
    torch.testing.assert_close(read.positions(), motion.positions(), rtol=0, atol=1e-5)
    expected = torch.stack(TURNED[up](*raw.positions().unbind(-1)), -1)  # the file itself is turned
    torch.testing.assert_close(expected, motion.positions(), rtol=0, atol=1e-5)
    torch.testing.assert_close(read.rotations, motion.rotations, rtol=0, atol=1e-5)
    assert read.skeleton.rotation_orders == motion.skeleton.rotation_orders


def test_what_is_no_axis_is_not_written(tmp_path):
    with pytest.raises(BvhError, match="up='w' is no axis"):
        write_bvh(walk(0.1), tmp_path / "clip.bvh", up="w")
    assert not list(tmp_path.iterdir())
