"""Motion onto rigs of any rest pose, axes, facing and names: as onto their standing twins."""

from __future__ import annotations

from dataclasses import replace

import any_rig
import pytest
import rig_names
import torch
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from motionlab import Motion, Skeleton
from motionlab.datasets import gaits
from motionlab.errors import RetargetError
from motionlab.retargeting import onto_rig, retarget
from motionlab.retargeting.joints_between import reaxed
from motionlab.retargeting.onto_rig import standing

CANONICAL = Skeleton.canonical()
WALK = gaits.make(seconds=1.5, speed=1.3, turn_rate=0.4, name="walk")
LARGER = replace(CANONICAL, offsets=1.15 * CANONICAL.offsets, end_offsets=1.15 * CANONICAL.end_offsets)  # fmt: skip
WANTED = retarget(WALK, LARGER)
NAMES = list(rig_names.CONVENTIONS.values())


def stance(skeleton: Skeleton = LARGER, frames: int = 1) -> Motion:
    """A person who stands in a T-pose."""
    turns = torch.eye(3).expand(frames, skeleton.joints, 3, 3)
    return Motion(skeleton, torch.zeros(frames, 3), turns, 30, name="rig")


def apart(found: Motion, wanted: Motion = WANTED) -> float:
    """Metres, at most."""
    return float((found.positions() - wanted.positions()).norm(dim=-1).max())


@given(
    seed=st.integers(0, 999), degrees=st.floats(-180, 180), names=st.sampled_from(NAMES),
    source=st.integers(0, 999),
)  # fmt: skip
@settings(max_examples=12, deadline=None)
def test_axes_facing_and_names_may_be_any(seed, degrees, names, source):
    """A frame in which the body stands tells how the rig's axes lie, wherever it faces."""
    body = any_rig.moved(stance(), degrees, (1, 0, 2))
    rig = any_rig.drawn(body, any_rig.random_axes(21, seed), rig_names.names_of(names))
    found = onto_rig(WALK, rig)
    assert found.skeleton is rig.skeleton
    assert apart(found) < 1e-3
    assert torch.equal(found.contacts, WANTED.contacts)


@given(seed=st.integers(0, 999))
@settings(max_examples=12, deadline=None)
def test_a_rest_pose_that_stands_may_face_anywhere_and_lie(seed):
    """Turned as a whole: no frame is needed."""
    turn = any_rig.random_axes(1, seed).repeat(21, 1, 1)  # less would be taken for a lean
    assume(turn[0, 1, 1] < 0.97)
    rig = stance(any_rig.drawn(stance(), turn).skeleton)
    assert apart(onto_rig(WALK, rig)) < 1e-3


@pytest.mark.parametrize("degrees", [-170, -60, -20, 5, 45, 90])
def test_a_rest_pose_may_be_turned_about_the_vertical(degrees):
    """By little, too, which retarget alone lets pass."""
    rig = stance(any_rig.drawn(stance(), any_rig.about_y(degrees).repeat(21, 1, 1)).skeleton)
    assert apart(onto_rig(WALK, rig)) < 1e-3


def test_a_standing_rest_pose_is_taken_as_it_is():
    assert torch.equal(standing(stance()), torch.eye(3).repeat(21, 1, 1))
    assert apart(onto_rig(WALK, stance())) == 0
    assert onto_rig(WALK, stance(CANONICAL)) is WALK


def test_axes_along_the_bones_are_told_by_motion_alone():
    """As LAFAN1's and many a game's: nobody stands in the file, but somebody walks."""
    axes = torch.eye(3).repeat(21, 1, 1)
    quarter = any_rig.random_axes(1, 0)[0] * 0 + torch.tensor([[0.0, 1, 0], [-1, 0, 0], [0, 0, 1]])
    for joint, name in enumerate(CANONICAL.names):
        if "Leg" in name or name in ("Spine", "Chest", "Neck", "Head"):
            axes[joint] = quarter
    rig = any_rig.drawn(retarget(gaits.make(seconds=4, speed=1.2), LARGER), axes)
    assert apart(onto_rig(WALK, rig)) < 0.03


def test_joints_without_a_role_stay_as_they_mostly_are():
    """A twist joint with axes of its own, and fingers: no part of the body bends at them."""
    longer = Skeleton(
        [*LARGER.names, "twist", "finger"],
        [*LARGER.parents, LARGER.index("LeftUpperLeg"), LARGER.index("LeftHand")],
        torch.cat([LARGER.offsets, torch.tensor([[0.0, -0.2, 0.0], [0.1, 0.0, 0.0]])]),
        LARGER.end_parents,
        LARGER.end_offsets,
    )
    rig = any_rig.drawn(stance(longer), any_rig.random_axes(23, 5))
    found = onto_rig(WALK, rig).positions()
    torch.testing.assert_close(found[:, :21], WANTED.positions()[:, :21], rtol=0, atol=1e-3)
    hand, finger = found[:, LARGER.index("LeftHand")], found[:, 22]
    torch.testing.assert_close((finger - hand).norm(dim=-1), torch.full([len(WALK)], 0.1))
    tip = found[:, 23 + LARGER.end_parents.index(LARGER.index("LeftHand"))]
    straight = torch.cosine_similarity(finger - hand, tip - hand)
    assert straight.min() > 0.999  # as where it stands


def test_feet_may_end_at_the_ankle():
    """They stand where they do with toes of human size, which is not so far from there."""
    kept = [i for i, name in enumerate(LARGER.names) if "Toes" not in name]
    bare = Skeleton(
        [LARGER.names[i] for i in kept],
        [kept.index(LARGER.parents[i]) if i else -1 for i in kept],
        LARGER.offsets[kept],
    )
    found = onto_rig(WALK, any_rig.drawn(stance(bare), any_rig.random_axes(19, 2)))
    assert found.skeleton.end_parents == ()
    torch.testing.assert_close(found.positions(), WANTED.positions()[:, kept], rtol=0, atol=2e-3)


def test_other_axes_are_the_same_body():
    axes = any_rig.random_axes(21, 3)
    twin = reaxed(any_rig.drawn(stance(), axes).skeleton, axes)
    torch.testing.assert_close(twin.offsets[1:], LARGER.offsets[1:], rtol=0, atol=1e-6)
    torch.testing.assert_close(twin.end_offsets, LARGER.end_offsets, rtol=0, atol=1e-6)


def test_what_is_refused():
    sitting = any_rig.drawn(stance(), any_rig.random_axes(21, 1)).skeleton
    with pytest.raises(RetargetError, match="'rig'.*how this rig stands can't be told.*one frame"):
        onto_rig(WALK, stance(sitting))
    with pytest.raises(RetargetError, match="target skeleton has no joint for left_hand"):
        onto_rig(WALK, stance(replace(LARGER, roles={"left_hand": ""})))
    for wrong in ((WALK, LARGER), ("walk", stance())):
        with pytest.raises(RetargetError, match="takes two motions"):
            onto_rig(*wrong)
