"""Where a person stands is found in the clips of a rig, and tells the axes of all of them."""

from __future__ import annotations

import re
from dataclasses import replace

import pytest
import roma
import torch
from hypothesis import given, settings
from hypothesis import strategies as st
from other_axes import redrawn

from motionlab import Motion, Skeleton
from motionlab.datasets import gaits
from motionlab.errors import RetargetError
from motionlab.retargeting import rest_alignment
from motionlab.retargeting.flat_feet import Stance
from motionlab.retargeting.stance import find_stance, stances

CANONICAL = Skeleton.canonical()
# A second each of walking, of standing, of walking on.
WALKS = gaits.make(seconds=4, speed=1.3)
STANDS = gaits.make(seconds=2, speed=0.0)


def t_pose(frames: int = 1) -> Motion:
    turns = torch.eye(3).expand(frames, CANONICAL.joints, 3, 3)
    return Motion(CANONICAL, torch.zeros(frames, 3), turns, 30.0, name="T")


def apart(found: Motion, wanted: Motion) -> float:
    """Centimetres, of the joint that is farthest off."""
    return 100 * float((found.positions() - wanted.positions()).norm(dim=-1).max())


@settings(max_examples=8, deadline=None)
@given(seed=st.integers(0, 1000), before=st.integers(1, 90), size=st.floats(0.7, 1.3))
def test_it_is_found_wherever_it_is_and_however_axes_lie(seed, before, size):
    clip = WALKS[:before] + STANDS[:25] + WALKS[before:]
    other = [redrawn(motion, seed, size) for motion in (WALKS, replace(clip, name="one"), WALKS)]
    stance = find_stance(other)
    found = re.fullmatch(r"one, ([\d.]+) to ([\d.]+) s", stance.name)
    first, last = (float(word) for word in found.groups())
    assert len(stance) in (14, 15, 16)
    assert before / 30 - 0.06 <= first < last <= (before + 25) / 30 + 0.06


def test_moments_of_several_clips_and_of_a_long_one_are_taken():
    clips = [redrawn(replace(STANDS, name=f"clip {i}"), 1) for i in range(12)]
    assert find_stance(clips).name.count("; ") == 7  # eight of twelve
    long = redrawn(replace(gaits.make(seconds=35, speed=0.0), name="long"), 1)
    assert [name.split(",")[0] for name in find_stance([long]).name.split("; ")] == ["long"] * 4


def test_a_t_pose_is_better_than_hanging_arms():
    clips = [redrawn(replace(motion, contacts=None), 1) for motion in (STANDS, t_pose(), STANDS)]
    stance = find_stance(clips)
    assert len(stance) == 1 and stance.name.startswith("T, ")


def test_nobody_stands():
    crouched = gaits.make(seconds=2, speed=0.0)
    bend = torch.eye(3)[None].repeat(len(crouched), 1, 1)
    bend[:, 1, 1] = bend[:, 2, 2] = 0.5
    bend[:, 2, 1], bend[:, 1, 2] = 0.75**0.5, -(0.75**0.5)
    rotations = crouched.rotations.clone()
    for knee in ("left_lower_leg", "right_lower_leg"):
        joint = CANONICAL.index(knee)
        rotations[:, joint] = rotations[:, joint] @ bend
    lying = crouched.rotations.clone()
    lying[:, 0] = torch.tensor([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]]) @ lying[:, 0]
    for motion in (WALKS, replace(crouched, rotations=rotations), replace(STANDS, rotations=lying)):
        assert find_stance([motion]) is None
    assert find_stance([]) is None and find_stance([STANDS[:0]]) is None


def test_clips_of_one_rig_get_the_same_axes():
    wanted = [gaits.make(seconds=3, speed=speed) for speed in (0.7, 1.2, 1.9)] + [STANDS]
    clips = [redrawn(motion, 7) for motion in wanted]
    found = stances(clips, CANONICAL)
    assert len(found.said) == 1 and "4 clips" in found.said[0]
    (stance,) = {id(each): each for each in found.references}.values()
    for clip, motion in zip(clips, wanted, strict=True):
        brought = clip.retarget(reference=stance)
        assert apart(brought, motion) < 4  # knees, which are a little bent where the gait stands


def test_each_rig_gets_its_own_and_one_that_stands_needs_none():
    clips = [redrawn(STANDS, 1), WALKS, redrawn(STANDS, 2), redrawn(WALKS, 1), redrawn(WALKS, 2)]
    found = stances(clips, CANONICAL)
    a, none, b, again, and_again = (its.motion for its in found.references)
    assert none is None and a is again and b is and_again and a is not b
    assert a.skeleton.names[0].startswith("rig1") and b.skeleton.names[0].startswith("rig2")
    assert len(found.said) == 2 and all("2 clips" in said for said in found.said)


def test_a_rest_pose_that_stands_needs_none_wherever_it_faces():
    quarter = torch.tensor([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]])
    body = replace(
        CANONICAL,
        offsets=CANONICAL.offsets @ quarter.T,
        end_offsets=CANONICAL.end_offsets @ quarter.T,
    )
    turned = quarter @ WALKS.rotations @ quarter.T
    clip = Motion(body, WALKS.root_positions @ quarter.T, turned, WALKS.fps)
    found = stances([clip, clip], CANONICAL)
    assert [its.motion for its in found.references] == [None, None] and found.said == []
    assert max(abs(its) for its in found.references[0].flat) < 0.02  # radians: as at rest


def test_a_clip_that_lies_spoils_no_axes():
    lying = torch.tensor([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])
    clip = redrawn(WALKS, 1)
    turned = clip.rotations.clone()
    turned[:, 0] = lying @ turned[:, 0]
    fallen = replace(clip, rotations=turned, root_positions=clip.root_positions @ lying.T)
    alone, beside = stances([clip], CANONICAL), stances([fallen, clip, fallen], CANONICAL)
    rotations = [clip.retarget(reference=its).rotations for its in
                 (alone.references[0], beside.references[1])]  # fmt: skip
    torch.testing.assert_close(*rotations, rtol=0, atol=1e-5)


def test_a_clip_too_small_to_be_retargeted_takes_nothing_from_its_rig():
    clip = redrawn(WALKS, 1)
    small = replace(clip.skeleton, offsets=clip.skeleton.offsets / 100)
    found = stances([replace(clip, skeleton=small), clip], CANONICAL)
    assert found.references[1].motion is not None


def test_another_actor_of_the_rig_has_its_axes():
    clips = [redrawn(STANDS, 3), redrawn(WALKS, 3, 1.2)]
    one, other = stances(clips, CANONICAL).references
    assert one is other and one.motion is not None
    assert apart(clips[1].retarget(reference=other), WALKS) < 2


def test_where_nobody_stands_all_clips_are_asked_together():
    clips = [redrawn(gaits.make(seconds=3, speed=s, seed=i), 5) for i, s in enumerate((1, 1.5, 2))]
    found = stances(clips, CANONICAL)
    (stance,) = {id(each): each for each in found.references}.values()
    assert (
        len(stance.motion) == 1
        and "nobody stands" in found.said[0]
        and "reference=" in found.said[0]
    )
    axes = [rest_alignment.alignment(clip, CANONICAL, stance.motion) for clip in clips]
    assert all(torch.equal(a[role], axes[0][role]) for a in axes for role in a)


def test_limbs_that_lie_along_axes_are_rounded_to_quarter_turns():
    """As most programs draw them; a bent and twisted arm, or one that never bends, tells them too."""
    turns = torch.eye(3).repeat(CANONICAL.joints, 1, 1)
    for joint, name in enumerate(CANONICAL.names):
        if "Arm" in name or "Hand" in name:
            turns[joint] = roma.euler_to_rotmat("X", torch.tensor([torch.pi / 2]))
        elif "Leg" in name:
            turns[joint] = roma.euler_to_rotmat("Z", torch.tensor([-torch.pi / 2]))
    clips = []
    for i, speed in enumerate((1.0, 1.6)):
        motion = gaits.make(seconds=3, speed=speed, seed=i, arm_swing=i)
        rotations = motion.rotations.clone()
        hand = CANONICAL.index("left_hand")
        rotations[:, hand] = rotations[:, hand] @ roma.euler_to_rotmat("X", torch.tensor([0.7]))
        clips.append(redrawn(replace(motion, rotations=rotations), turns))
    found = stances(clips, CANONICAL)
    assert "as its bones lie along them" in found.said[0]
    axes = rest_alignment.alignment(clips[0], CANONICAL, found.references[0].motion)
    for role, joint in CANONICAL.roles.items():
        if "arm" in role or "hand" in role or "er_leg" in role:
            torch.testing.assert_close(axes[role], turns[joint].mT, rtol=0, atol=1e-3)


def test_a_reference_is_taken_where_it_fits():
    clips = [redrawn(STANDS, 1), redrawn(WALKS, 2)]
    given_ = redrawn(t_pose(), 2)
    found = stances(clips, CANONICAL, given_)
    assert found.references[1].motion.skeleton is given_.skeleton
    assert len(found.references[1].motion) == 1
    assert found.references[0].motion.skeleton is clips[0].skeleton
    assert apart(clips[1].retarget(reference=found.references[1]), WALKS) < 2


def test_what_is_said_to_stand_may_stand_with_bent_knees():
    turns = t_pose().rotations.clone()
    for side in ("left", "right"):
        for part, degrees in (("upper_leg", -15.0), ("lower_leg", 32.0), ("foot", -17.0)):
            bend = torch.tensor([degrees, 0.0, 0.0]).deg2rad()
            turns[:, CANONICAL.role(f"{side}_{part}")] = roma.rotvec_to_rotmat(bend)
    bent = redrawn(replace(t_pose(), rotations=turns), 1)
    assert find_stance([bent]) is None  # nobody would look for it among a folder's clips
    found = stances([redrawn(WALKS, 1)], CANONICAL, bent)
    assert len(found.references[0].motion) == 1 and not found.said


def test_a_reference_that_tells_nothing_is_refused():
    clips = [redrawn(STANDS, 1), redrawn(WALKS, 1)]
    with pytest.raises(RetargetError, match="another rig than all 2 clips"):
        stances(clips, CANONICAL, redrawn(STANDS, 2))
    with pytest.raises(RetargetError, match="at no time does the body stand"):
        stances(clips, CANONICAL, clips[1])


def test_rigs_that_cannot_be_retargeted_are_left_to_retarget():
    other = Skeleton(("a", "b"), (-1, 0), torch.zeros(2, 3))
    odd = Motion(other, torch.zeros(3, 3), torch.eye(3).expand(3, 2, 3, 3), 30.0)
    assert stances([odd, odd], CANONICAL).references == [Stance(), Stance()]
    for target in (other, "canonical"):
        assert stances([redrawn(STANDS, 1), redrawn(WALKS, 1)], target).references == [Stance()] * 2
