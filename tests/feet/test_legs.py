"""Feet are locked alike on all rigs: whatever their axes, rest pose, facing, names and tree."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import pytest
import roma
import torch
from hypothesis import given, settings
from hypothesis import strategies as st
from other_rigs import (
    along_bones,
    facing,
    random_axes,
    redrawn,
    sitting,
    with_joints_between,
)
from rig_names import CONVENTIONS, names_of, renamed

from motionlab import Skeleton, contacts
from motionlab.datasets import gaits
from motionlab.errors import MotionError, SkeletonError
from motionlab.feet.contacts import foot_points, stands_on_floor
from motionlab.feet.legs import PARTS, knee_fronts, leg_joints, legs_alone
from motionlab.solvers import lock_feet

CANONICAL = Skeleton.canonical()
UPPER_BODY = CANONICAL.names[1 : CANONICAL.role("left_upper_leg")]
X, Y = torch.eye(3)[:2]
RIGS = {
    "bones along x": along_bones(CANONICAL, X),
    "bones along y": along_bones(CANONICAL, Y),
    "bones against y": along_bones(CANONICAL, -Y),
    "sitting": sitting(CANONICAL),
    "facing back": roma.rotvec_to_rotmat(torch.pi * Y).expand(CANONICAL.joints, 3, 3),
    "lying": roma.rotvec_to_rotmat(torch.pi / 2 * X).expand(CANONICAL.joints, 3, 3),
    "any": random_axes(CANONICAL, 0),
}


@cache
def walk(speed=1.4, **more):
    return gaits.make(seconds=3, speed=speed, noise=0.5, seed=1, **more)


def sliding(motion):
    """The motion, its feet sliding to the left by 15 cm a second while they rest."""
    aside = 0.15 * torch.arange(len(motion)) / motion.fps
    return replace(
        motion, root_positions=motion.root_positions + aside[:, None] * torch.tensor([1.0, 0, 0])
    )


def centimetres(a, b):
    """How far apart points of two motions are at most."""
    return 100 * float((a.positions() - b.positions()).norm(dim=-1).max())


def rolled(angle):
    """Axes of a rig whose legs are turned about their bones, and that rests in a T all the same."""
    axes = torch.eye(3).repeat(CANONICAL.joints, 1, 1)
    for side in ("left", "right"):
        for part in ("upper_leg", "lower_leg"):
            axes[CANONICAL.role(f"{side}_{part}")] = roma.rotvec_to_rotmat(angle * Y)
    return axes


def straight_legged(motion):
    rotations = motion.rotations.clone()
    for side in ("left", "right"):
        rotations[:, CANONICAL.role(f"{side}_lower_leg")] = torch.eye(3)
    return replace(motion, rotations=rotations)


@pytest.mark.parametrize("rig", [*RIGS, "joints between"])
def test_legs_alone_are_where_those_of_the_whole_body_are(rig):
    if rig == "joints between":
        motion = with_joints_between(walk(), ("left_upper_leg", "right_lower_leg"))
    else:
        motion = redrawn(walk(), RIGS[rig])
    legs, kept = legs_alone(motion.skeleton)
    alone = replace(motion, skeleton=legs, rotations=motion.rotations[:, kept])
    whole, found = leg_joints(motion.skeleton), leg_joints(legs)
    for part in PARTS:
        assert [kept[joint] for joint in found[part]] == whole[part]
        where = (m.positions()[:, joints[part]] for m, joints in ((alone, found), (motion, whole)))
        assert torch.allclose(*where, atol=1e-5)
    assert legs.joints < motion.skeleton.joints
    assert stands_on_floor(legs) == stands_on_floor(motion.skeleton)


def test_a_leg_whose_toes_are_said_to_be_none_has_none_alone():
    skeleton = replace(CANONICAL, roles={"left_toes": "", "right_toes": ""})
    legs, kept = legs_alone(skeleton)
    assert "left_toes" not in legs.roles
    assert foot_points(legs)[1] == legs.role("left_foot")


@pytest.mark.parametrize("rig", RIGS)
def test_what_rests_already_stays_where_it_is(rig):
    motion = redrawn(walk(), RIGS[rig])
    assert centimetres(motion, walk()) < 0.01
    assert centimetres(lock_feet(motion, contacts.label(motion), floor=None), motion) < 0.1


@pytest.mark.parametrize("rig", RIGS)
@pytest.mark.parametrize("floor", [0.0, None])
def test_what_slides_is_held_as_on_the_canonical_rig(rig, floor):
    slides = sliding(walk())
    wanted = lock_feet(slides, walk().contacts, floor=floor)
    other = redrawn(slides, RIGS[rig])
    found = lock_feet(other, walk().contacts, floor=floor)
    assert centimetres(wanted, slides) > 3
    assert centimetres(found, wanted) < 0.5


@pytest.mark.parametrize("angle", [torch.pi / 2, torch.pi, -torch.pi / 2])
def test_a_rig_in_a_T_may_have_rolled_legs(angle):
    motion = redrawn(walk(), rolled(angle))
    assert torch.allclose(motion.skeleton.rest_points, CANONICAL.rest_points, atol=1e-4)
    assert centimetres(lock_feet(motion, floor=None), motion) < 0.1


@pytest.mark.parametrize("axes", [random_axes(CANONICAL, 3), rolled(torch.pi)])
def test_the_front_of_legs_that_never_bend_is_where_the_hips_face(axes):
    plain = straight_legged(walk())
    for motion in (plain, redrawn(plain, axes)):
        fronts = knee_fronts(motion.skeleton, motion.positions(), motion.orientations())
        thighs = plain.orientations()[:, leg_joints(CANONICAL)["upper_leg"]]
        assert (fronts * thighs[..., 2]).sum(-1).min() > 0.97


def test_a_rest_pose_that_is_wrong_of_one_leg_is_asked_about_neither():
    """ACCAD's Male1 crawls, and the doubt about his right leg stays just below what is too much."""
    axes = rolled(torch.pi / 2)
    axes[CANONICAL.role("right_upper_leg")] = roma.rotvec_to_rotmat(0.9 * Y)
    motion = redrawn(walk(), axes)
    fronts = knee_fronts(motion.skeleton, motion.positions(), motion.orientations())
    thighs = walk().orientations()[:, leg_joints(CANONICAL)["upper_leg"]]
    assert (fronts * thighs[..., 2]).sum(-1).min() > 0.97


def test_knees_that_bend_backwards_do_not_say_where_their_front_is():
    """On a rig that rests standing, its rest pose says it, on any other the hips do."""
    back = walk().rotations.clone()
    for side in ("left", "right"):
        knee = CANONICAL.role(f"{side}_lower_leg")
        back[:, knee] = back[:, knee].mT
    broken = replace(walk(), rotations=back)
    thighs = broken.orientations()[:, leg_joints(CANONICAL)["upper_leg"]]
    for axes, least in ((torch.eye(3).expand_as(back[0]), 0.9999), (RIGS["any"], 0.97)):
        motion = redrawn(broken, axes)
        fronts = knee_fronts(motion.skeleton, motion.positions(), motion.orientations())
        assert (fronts * thighs[..., 2]).sum(-1).min() > least


def test_joints_between_those_of_a_leg_go_along():
    parts = ("upper_leg", "lower_leg", "foot")
    roles = tuple(f"{side}_{part}" for side in ("left", "right") for part in parts)
    other = with_joints_between(sliding(walk()), roles)
    found = lock_feet(other, walk().contacts)
    wanted = lock_feet(sliding(walk()), walk().contacts)
    at = [other.skeleton.names.index(name) for name in CANONICAL.names]
    apart = found.positions()[:, at] - wanted.positions()[:, : CANONICAL.joints]
    assert 100 * apart.norm(dim=-1).max() < 0.01


@settings(deadline=None, max_examples=20)
@given(
    which=st.integers(0, 39), seed=st.integers(0, 10_000), yaw=st.floats(-3.2, 3.2),
    convention=st.sampled_from(sorted(CONVENTIONS)),
    between=st.sets(st.sampled_from(("upper_leg", "lower_leg", "foot"))),
)  # fmt: skip
def test_no_rig_moves_a_gait_that_rests(which, seed, yaw, convention, between):
    clips = gaits.load()
    motion = facing(clips[which], yaw)
    motion = renamed(motion, names_of(CONVENTIONS[convention]))
    roles = tuple(f"{side}_{part}" for side in ("left", "right") for part in sorted(between))
    motion = with_joints_between(motion, roles)
    motion = redrawn(motion, random_axes(motion.skeleton, seed))
    assert centimetres(lock_feet(motion, contacts.label(motion), floor=None), motion) < 1


def without_joint(motion, name):
    """The motion on a rig that lacks a joint; what hung on it hangs on the joint above."""
    s = motion.skeleton
    gone = s.names.index(name)
    keep = [joint for joint in range(s.joints) if joint != gone]
    above = [s.parents[gone] if parent == gone else parent for parent in s.parents]
    number = {joint: i for i, joint in enumerate(keep)} | {-1: -1}
    offsets = s.offsets + (torch.tensor(s.parents) == gone)[:, None] * s.offsets[gone]
    ends = [i for i, parent in enumerate(s.end_parents) if parent != gone]
    body = Skeleton(
        tuple(s.names[joint] for joint in keep),
        tuple(number[above[joint]] for joint in keep),
        offsets[keep],
        tuple(number[s.end_parents[end]] for end in ends),
        s.end_offsets[ends],
    )
    return replace(motion, skeleton=body, rotations=motion.rotations[:, keep])


@settings(deadline=None, max_examples=30)
@given(
    seed=st.integers(0, 10_000), yaw=st.floats(-3.2, 3.2),
    gone=st.sets(st.sampled_from(CANONICAL.names[1:]), max_size=3),
    nameless=st.sets(st.sampled_from(CANONICAL.names), max_size=2),
    moved=st.sampled_from(UPPER_BODY), onto=st.sampled_from(CANONICAL.names),
)  # fmt: skip
def test_a_mutilated_rig_is_locked_right_or_refused(seed, yaw, gone, nameless, moved, onto):
    motion = facing(walk(), yaw)
    for name in sorted(gone):
        motion = without_joint(motion, name)
    s = motion.skeleton
    names = [f"Thing{i}" if name in nameless else name for i, name in enumerate(s.names)]
    parents = list(s.parents)
    if {moved, onto} <= {*s.names} and s.names.index(onto) < s.names.index(moved):
        parents[s.names.index(moved)] = s.names.index(onto)
    motion = replace(motion, skeleton=replace(s, names=tuple(names), parents=tuple(parents)))
    motion = redrawn(motion, random_axes(motion.skeleton, seed))
    try:
        locked = lock_feet(motion, contacts.label(motion), floor=None)
    except SkeletonError as error:
        assert len(str(error)) > 40
    else:
        assert centimetres(locked, motion) < 1


def test_a_leg_that_does_not_hang_together_is_named():
    motion = walk()
    parents = list(CANONICAL.parents)
    parents[CANONICAL.role("left_foot")] = 0
    loose = replace(motion, skeleton=replace(CANONICAL, parents=tuple(parents)))
    with pytest.raises(SkeletonError, match=r"left leg .* lower_leg to foot .*roles="):
        lock_feet(loose)
    offsets = CANONICAL.offsets.clone()
    offsets[CANONICAL.role("right_lower_leg")] = 0
    short = replace(motion, skeleton=replace(CANONICAL, offsets=offsets))
    with pytest.raises(SkeletonError, match=r"right leg .* upper_leg to lower_leg"):
        lock_feet(short)


@pytest.mark.parametrize("rig", [rig for rig in RIGS if rig != "facing back"])
def test_heights_above_a_floor_are_not_told_from_a_rest_pose_that_stands_on_none(rig):
    motion = redrawn(walk(), RIGS[rig])
    assert stands_on_floor(CANONICAL) and not stands_on_floor(motion.skeleton)
    with pytest.raises(MotionError, match=r"does not stand on the floor .* leave `floor` out"):
        contacts.label(motion, "speed-height", floor=0.0)
    found = contacts.label(motion, "speed-height")
    assert torch.equal(found, contacts.label(walk(), "speed-height"))


def test_a_rest_pose_with_one_foot_higher_stands_on_no_floor():
    offsets = CANONICAL.offsets.clone()
    offsets[CANONICAL.role("left_upper_leg"), 1] += 0.03
    assert not stands_on_floor(replace(CANONICAL, offsets=offsets))
