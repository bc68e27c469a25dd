"""Motion: cutting, joining, resampling, mirroring, and what it refuses."""

from __future__ import annotations

import dataclasses
import subprocess
import sys

import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation, Slerp

from motionlab import Motion, MotionLabError, Skeleton, concatenate
from motionlab.errors import MotionError


def wander(frames: int = 12, fps: float = 30, seed: int = 0, labelled: bool = True) -> Motion:
    """The canonical skeleton, tumbling at random but smoothly."""
    rng = np.random.default_rng(seed)
    turns = np.cumsum(rng.normal(scale=0.2, size=(frames, 21, 3)), axis=0)
    rotations = Rotation.from_rotvec(turns.reshape(-1, 3)).as_matrix().reshape(frames, 21, 3, 3)
    return Motion(
        Skeleton.canonical(),
        np.cumsum(rng.normal(scale=0.05, size=(frames, 3)), axis=0),
        rotations,
        fps,
        name="wander",
        source="chance",
        contacts=rng.random((frames, 4)) < 0.5 if labelled else None,
    )


def same(a: Motion, b: Motion, tolerance: float = 0) -> bool:
    return (
        torch.allclose(a.root_positions, b.root_positions, rtol=0, atol=tolerance)
        and torch.allclose(a.rotations, b.rotations, rtol=0, atol=tolerance)
        and (a.contacts is b.contacts is None or torch.equal(a.contacts, b.contacts))
        and a.skeleton.matches(b.skeleton)
        and a.fps == b.fps
    )


def test_sizes_and_repr():
    motion = wander(90)
    assert len(motion) == motion.frames == 90 and motion.seconds == 3
    assert repr(motion) == "Motion('wander', 21 joints, 90 frames, 3.00 s, 30 fps)"
    assert motion.positions().shape == (90, 26, 3)
    assert motion.orientations().shape == (90, 21, 3, 3)
    assert motion.positions().dtype == torch.float32


# -- cutting and joining ------------------------------------------------------------------------


def test_slices():
    motion = wander(20)
    part = motion[5:11]
    assert torch.equal(part.rotations, motion.rotations[5:11])
    assert torch.equal(part.contacts, motion.contacts[5:11])
    assert part.fps == 30 and part.name == "wander" and part.source == "chance"
    assert motion[::2].fps == 15 and len(motion[::2]) == 10
    assert same(motion[-3:], motion[17:]) and len(motion[30:]) == 0
    assert len(motion[:0].positions()) == 0 and len(motion[:0].mirror()) == 0


@pytest.mark.parametrize(
    "index", [3, "a", (1, 2), slice(None, None, -1), slice(0, 5, 0), slice(0.5, 2)]
)
def test_bad_slices(index):
    with pytest.raises(MotionError):
        wander()[index]


@settings(max_examples=20, deadline=None)
@given(cut=st.integers(0, 12))
def test_cut_and_joined_again(cut):
    motion = wander()
    joined = motion[:cut] + motion[cut:]
    assert same(joined, motion)
    torch.testing.assert_close(joined.positions(), motion.positions())


def test_concatenate_any_number():
    motion = wander()
    assert same(concatenate(motion[i : i + 1] for i in range(12)), motion)
    assert concatenate([motion, wander(labelled=False)]).contacts is None


@pytest.mark.parametrize(
    "motions, words",
    [
        ([], "empty"),
        ([wander(), 3], "not 3"),
        ([wander(), wander(fps=60)], r"resample\(30\)"),
        ([wander(), Motion(Skeleton(("a",), (-1,), torch.zeros(1, 3)), torch.zeros(1, 3),
                           torch.eye(3).expand(1, 1, 3, 3), 30)], "skeletons"),
    ],
)  # fmt: skip
def test_what_cannot_be_joined(motions, words):
    with pytest.raises(MotionError, match=words):
        concatenate(motions)


# -- time ---------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "old, new, stride", [(120, 30, 4), (60, 30, 2), (30, 30, 1), (119.99904, 30, 4)]
)
def test_integer_strides_pick_frames(old, new, stride):
    motion = wander(21, fps=old)
    assert same(motion.resample(new), dataclasses.replace(motion[::stride], fps=new))


def test_halfway_between_frames_is_slerp():
    motion = wander(11, fps=30)
    faster = motion.resample(60)
    assert len(faster) == 21 and faster.fps == 60
    assert torch.allclose(faster.rotations[::2], motion.rotations, atol=1e-6)
    assert torch.allclose(faster.root_positions[::2], motion.root_positions, atol=1e-6)
    halfway = (motion.root_positions[1:] + motion.root_positions[:-1]) / 2
    assert torch.allclose(faster.root_positions[1::2], halfway, atol=1e-6)
    for joint in range(21):
        keys = Rotation.from_matrix(motion.rotations[:, joint].double().numpy())
        expected = Slerp(np.arange(11), keys)(np.arange(21) / 2).as_matrix()
        np.testing.assert_allclose(faster.rotations[:, joint].numpy(), expected, atol=2e-6)


@pytest.mark.parametrize("fps", [24, 25, 30, 47.3, 50, 100, 240])
def test_constant_velocities_stay(fps):
    times = torch.arange(61) / 60
    axis = torch.tensor([2.0, -1.0, 2.0]) / 3

    def turn(t):
        return torch.tensor(
            Rotation.from_rotvec(np.outer(t.numpy(), axis.numpy()) * 3.0).as_matrix()
        ).float()

    velocity = torch.tensor([1.0, 0.5, -2.0])
    skeleton = Skeleton(("a",), (-1,), torch.zeros(1, 3))
    motion = Motion(skeleton, times[:, None] * velocity, turn(times)[:, None], 60)
    other = motion.resample(fps)
    times = torch.arange(len(other)) / fps
    assert times[-1] <= 1 + 1e-6 and 1 - times[-1] < 1 / fps
    assert torch.allclose(other.root_positions, times[:, None] * velocity, atol=1e-5)
    assert torch.allclose(other.rotations[:, 0], turn(times), atol=1e-5)


def test_resampled_rotations_are_rotations():
    rotations = wander(30).resample(47).rotations
    assert torch.allclose(rotations.mT @ rotations, torch.eye(3), atol=1e-5)
    assert torch.allclose(torch.linalg.det(rotations), torch.ones(()), atol=1e-5)


@pytest.mark.parametrize("frames", [0, 1, 2])
@pytest.mark.parametrize("fps", [7, 30, 31, 1000])
def test_resampling_very_short_motions(frames, fps):
    other = wander(frames).resample(fps)
    assert other.fps == fps and (len(other) > 0) == (frames > 0)


@pytest.mark.parametrize("fps", [0, -1, float("nan"), float("inf"), None, "fast"])
def test_bad_rates(fps):
    with pytest.raises(MotionError, match="positive number"):
        wander().resample(fps)
    with pytest.raises(MotionError, match="positive number"):
        dataclasses.replace(wander(), fps=fps)


# -- left and right -----------------------------------------------------------------------------


def lopsided() -> Motion:
    """Left and right arm of different lengths and end sites."""
    skeleton = Skeleton(
        ("Hips", "Chest", "LeftArm", "LeftHand", "RightArm", "RightHand", "Head"),
        (-1, 0, 1, 2, 1, 4, 1),
        torch.randn(7, 3, generator=torch.Generator().manual_seed(0)),
        (5, 3, 6),
        torch.randn(3, 3, generator=torch.Generator().manual_seed(1)),
    )
    rotations = Rotation.random(7 * 5, rng=np.random.default_rng(2)).as_matrix()
    return Motion(skeleton, np.random.default_rng(3).normal(size=(5, 3)),
                  rotations.reshape(5, 7, 3, 3), 30)  # fmt: skip


@pytest.mark.parametrize("make", [wander, lopsided])
def test_mirrored_points_are_reflections_of_their_partners(make):
    motion = make()
    mirrored = motion.mirror()
    skeleton = motion.skeleton
    partners = [skeleton.names.index(_other(name)) for name in skeleton.names]
    ends = [skeleton.end_parents.index(partners[p]) + skeleton.joints for p in skeleton.end_parents]
    expected = motion.positions()[:, partners + ends] * torch.tensor([-1.0, 1.0, 1.0])
    torch.testing.assert_close(mirrored.positions(), expected, rtol=0, atol=2e-6)
    assert torch.allclose(torch.linalg.det(mirrored.rotations), torch.ones(()), atol=1e-5)
    if motion.contacts is not None:
        assert torch.equal(mirrored.contacts, motion.contacts[:, [2, 3, 0, 1]])


def _other(name: str) -> str:
    swap = {"Left": "Right", "Right": "Left"}
    return next((swap[side] + name[len(side) :] for side in swap if name.startswith(side)), name)


@pytest.mark.parametrize("make", [wander, lopsided])
def test_mirrored_twice_is_the_same(make):
    assert same(make().mirror().mirror(), make())


# -- what it refuses ----------------------------------------------------------------------------


@pytest.mark.parametrize(
    "change, words",
    [
        (dict(skeleton="biped"), "not a Skeleton"),
        (dict(root_positions=torch.zeros(12, 2)), r"\(12, 2\)"),
        (dict(root_positions=torch.zeros(11, 3)), r"\(frames, 3\)"),
        (dict(root_positions=3.0), r"\(frames, 3\)"),
        (dict(root_positions=None), "must be an array"),
        (dict(root_positions=[[1, 2, 3], [4]]), "must be an array"),
        (dict(rotations=torch.zeros(12, 20, 3, 3)), "21 joints"),
        (dict(rotations=torch.zeros(12, 21, 4)), "21 joints"),
        (dict(rotations="none"), "must be an array"),
        (dict(contacts=torch.zeros(12, 3)), "left heel"),
        (dict(contacts=torch.zeros(4)), "left heel"),
    ],
)
def test_refused(change, words):
    with pytest.raises(MotionError, match=words):
        dataclasses.replace(wander(), **change)


@pytest.mark.parametrize("value", [float("nan"), float("inf"), -float("inf")])
@pytest.mark.parametrize("field", ["root_positions", "rotations"])
def test_values_that_are_no_numbers(field, value):
    values = getattr(wander(), field).clone()
    values[7, 1] = values[9] = value
    with pytest.raises(MotionLabError, match=r"frame 7 .*\(2 such frames"):
        dataclasses.replace(wander(), **{field: values})


def test_numpy_in_and_out():
    motion = wander()
    root, rotations = motion.numpy()
    again = Motion(motion.skeleton, root, rotations, 30, contacts=motion.contacts)
    assert same(again, motion) and root.dtype == np.float32


def test_joining_says_where_skeletons_differ():
    motion = lopsided()
    offsets = motion.skeleton.offsets.clone()
    offsets[0] += 1.0  # the root's does not matter
    offsets[4, 1] += 0.034
    names = ("base", *motion.skeleton.names[1:])
    for change, words in (
        (dict(offsets=offsets), f"offsets of '{motion.skeleton.names[4]}' differ by 3.4 cm"),
        (dict(names=names), f"joint 0 is called '{motion.skeleton.names[0]}' and 'base'"),
        (dict(end_parents=(5, 2, 6)), "end sites hang together"),
    ):
        other = dataclasses.replace(motion, skeleton=dataclasses.replace(motion.skeleton, **change))
        with pytest.raises(MotionError, match=words):
            concatenate([motion, motion, other])
    with pytest.raises(MotionError, match="7 and 21 joints"):
        motion + wander()
    with pytest.raises(MotionError, match="differ by .* cm"):
        concatenate([motion, motion.mirror()])


@pytest.mark.parametrize("given", [wander(), 3, None])
def test_joining_what_is_no_list(given):
    with pytest.raises(MotionError, match="takes a list of motions"):
        concatenate(given)


# -- immutability -------------------------------------------------------------------------------


def test_frozen():
    with pytest.raises(dataclasses.FrozenInstanceError):
        wander().fps = 60


def test_what_operations_return_shares_no_memory():
    motion, untouched = wander(), wander()
    results = [
        motion[:], motion[2:5], motion[::2], motion.mirror(), motion.resample(30),
        motion.resample(15), motion.resample(40), motion + motion, concatenate([motion]),
    ]  # fmt: skip
    for result in results:
        result.root_positions.fill_(9), result.rotations.fill_(9), result.contacts.fill_(True)
    for array in motion.numpy():
        array.fill(9)
    motion.positions().fill_(9), motion.orientations().fill_(9)
    assert same(motion, untouched)


def test_gradients_reach_the_pose():
    motion = wander()
    rotations = motion.rotations.clone().requires_grad_()
    posed = dataclasses.replace(motion, rotations=rotations)
    posed.mirror().resample(20).positions()[..., 1].sum().backward()
    assert rotations.grad.abs().sum() > 0 and torch.isfinite(rotations.grad).all()
    assert repr(posed) and posed.numpy()[1].shape == (12, 21, 3, 3)


def test_a_motion_does_not_change_with_the_array_it_was_made_of():
    root = np.zeros((2, 3), np.float32)
    skeleton = Skeleton(("a",), (-1,), torch.zeros(1, 3))
    motion = Motion(skeleton, root, np.tile(np.eye(3, dtype=np.float32), (2, 1, 1, 1)), 30)
    root += 5
    assert motion.root_positions.abs().max() == 0


def test_tab_completion_finds_what_is_imported_late():
    code = "import motionlab, sys; print(*dir(motionlab)); assert 'pyvista' not in sys.modules"
    found = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True)
    assert {"show", "datasets", "viewer", "Motion", "__version__"} <= set(found.stdout.split())
