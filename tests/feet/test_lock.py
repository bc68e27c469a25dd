"""Locked feet hold still, nothing else jumps, and wrong labels do no more than harm."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import roma
import torch
from hypothesis import given, settings
from hypothesis import strategies as st
from other_rigs import random_axes, redrawn

from motionlab import Skeleton, contacts, load
from motionlab.datasets import gaits
from motionlab.errors import ModelError
from motionlab.feet.contacts import foot_points
from motionlab.feet.legs import PARTS, leg_joints
from motionlab.feet.lock import STRAIGHT, lock
from motionlab.feet.marks import clean, longest
from motionlab.metrics import foot_skate
from motionlab.roles import SIDES
from motionlab.solvers import lock_feet

TOES = [1, 3]


def sliding(seconds=4.0, speed=1.4, slide=0.15, seed=0, **more):
    """A gait whose feet slide to the left while they rest, and its exact contacts (frames, 2)."""
    motion = gaits.make(seconds=seconds, speed=speed, noise=0.5, seed=seed, **more)
    aside = slide * torch.arange(len(motion)) / motion.fps
    root = motion.root_positions + aside[:, None] * torch.tensor([1.0, 0.0, 0.0])
    return replace(motion, root_positions=root), motion.contacts[:, TOES]


def toes_of(motion):
    return motion.positions()[:, [foot_points(motion.skeleton)[i] for i in TOES]]


def held_steps(motion, down):
    """Millimetres that toes move from frame to frame while they are held throughout."""
    held = clean(down, motion.fps)
    steps = 1000 * toes_of(motion).diff(dim=0).norm(dim=-1)
    return steps[held[1:] & held[:-1]]


def peak_acceleration(motion):
    points = motion.positions()
    return float((points[2:] - 2 * points[1:-1] + points[:-2]).norm(dim=-1).max() * motion.fps**2)


@pytest.mark.parametrize("speed", [0.8, 1.4, 2.8])
@pytest.mark.parametrize("turn_rate", [0.0, 0.6])
def test_what_slid_holds_still_and_nothing_pops(speed, turn_rate):
    motion, down = sliding(speed=speed, turn_rate=turn_rate)
    assert held_steps(motion, down).mean() > 3
    locked = lock_feet(motion, down)
    assert held_steps(locked, down).max() < 0.1
    assert peak_acceleration(locked) < 1.1 * peak_acceleration(motion)
    assert locked.positions()[..., 1].min() > -1e-3
    before, after = (foot_skate(m.positions(), down, m.skeleton, m.fps) for m in (motion, locked))
    assert before > 12 and after < 0.5
    # the way and the arms are left alone, but for how high the root is
    assert torch.equal(locked.root_positions[:, [0, 2]], motion.root_positions[:, [0, 2]])
    arms = [motion.skeleton.index(name) for name in ("left_upper_arm", "right_hand", "head")]
    assert torch.equal(locked.rotations[:, arms], motion.rotations[:, arms])


def test_a_leg_that_was_straight_does_not_snap():
    model, refiner = load("lstm-gmm-contacts"), load("refiner-contacts")
    runs = [i for i, n in enumerate(model.start_names) if n.startswith("run") and "m/s" in n]
    with torch.no_grad():
        features = refiner(
            model.generate(
                300, model.starts, generator=torch.Generator().manual_seed(3), **model.sampling
            )
        )
    for start in runs:  # some of whose legs are quite straight
        dream = model.encoding.to_motion(features[start])
        locked = lock_feet(dream, floor=None)
        assert peak_acceleration(locked) < 1.2 * peak_acceleration(dream)


def test_a_body_that_rises_is_not_pulled_down_by_feet_that_are_said_to_stand():
    """A network that tells of contacts while legs are stretched would have it go on its knees."""
    stand = gaits.make(seconds=4, speed=0.0, noise=0.0)
    up = 0.1 * torch.sin(torch.pi * torch.arange(len(stand)) / stand.fps)
    root = stand.root_positions + up[:, None] * torch.tensor([0.0, 1.0, 0.0])
    down = torch.ones(len(stand), 2, dtype=torch.bool)
    risen = replace(stand, root_positions=root)
    free, kept = (
        (root - lock_feet(risen, down, **how).root_positions)[:, 1].max()
        for how in ({}, {"deepest": 0.05})
    )
    assert free > 0.1 and kept < 0.07  # some for easing in and out, and for a smooth way
    with pytest.raises(ModelError, match="deepest"):
        lock_feet(risen, down, deepest=float("nan"))


def test_feet_that_keep_their_heights_are_held_without_the_body_coming_down():
    """A foot rolls, and its toes rise by a centimetre while they rest; a leg reaches no farther down."""
    motion, down = sliding(slide=0.1)
    bobs = 0.012 * torch.sin(5 * torch.pi * torch.arange(len(motion)) / motion.fps)
    root = motion.root_positions + bobs[:, None] * torch.tensor([0.0, 1.0, 0.0])
    motion = replace(motion, root_positions=root)
    locked = lock_feet(motion, down, level=False)
    held = clean(down, motion.fps)
    along = toes_of(locked).diff(dim=0)[..., [0, 2]].norm(dim=-1)
    assert along[held[1:] & held[:-1]].max() < 1e-4
    assert torch.allclose(toes_of(locked)[..., 1], toes_of(motion)[..., 1], atol=1e-4)
    sunk, sunk_to_floor = (
        float((root - its.root_positions)[:, 1].max())
        for its in (locked, lock_feet(motion, down, floor=None))
    )
    assert sunk < 0.5 * sunk_to_floor


def test_a_foot_that_was_let_go_is_not_taken_up_again_in_the_same_contact():
    held = torch.tensor([1, 1, 1, 1, 1, 1, 0, 1, 1, 1], dtype=torch.bool)
    marks = torch.tensor([1, 0, 1, 1, 0, 1, 0, 0, 1, 0], dtype=torch.bool)
    kept = torch.tensor([0, 0, 1, 1, 0, 0, 0, 0, 1, 0], dtype=torch.bool)
    none, equal = torch.zeros(10, dtype=torch.bool), marks & (torch.arange(10) != 3)
    first = torch.tensor([1, 0, 0, 0, 0, 0, 0, 0, 1, 0], dtype=torch.bool)
    found = longest(torch.stack([marks, none], 1), torch.stack([held, held], 1))
    assert torch.equal(found, torch.stack([kept, none], 1))
    assert torch.equal(longest(equal[:, None], held[:, None])[:, 0], first)


def test_feet_keep_the_way_they_point_and_bones_their_length():
    motion, down = sliding()
    locked = lock_feet(motion, down)
    feet = [motion.skeleton.index(f"{side}_foot") for side in ("left", "right")]
    turned = locked.orientations()[:, feet].mT @ motion.orientations()[:, feet]
    assert torch.allclose(turned, torch.eye(3).expand_as(turned), atol=1e-5)
    eye = locked.rotations.mT @ locked.rotations
    assert torch.allclose(eye, torch.eye(3).expand_as(eye), atol=1e-5)


def test_what_is_locked_stays_as_it_is():
    still = gaits.make(seconds=4, speed=1.4, noise=0.5, seed=3)
    locked = lock_feet(still)
    assert (locked.positions() - still.positions()).abs().max() < 1e-4
    motion, down = sliding()
    once = lock_feet(motion, down)
    assert (lock_feet(once, down).positions() - once.positions()).abs().max() < 1e-4


@pytest.mark.parametrize("name", ["run_3.0_stop", "walk_0.6", "go_and_halt"])
def test_where_nothing_slides_labels_by_speed_pull_no_foot_out_of_the_air(name):
    (motion,) = (clip for clip in gaits.load() if clip.name == name)
    found = contacts.label(motion)
    assert (found & ~motion.contacts)[:, TOES].any()
    moved = lock_feet(motion, found, floor=None).positions() - motion.positions()
    assert moved.norm(dim=-1).max() < 0.01


def test_knees_bend_forward():
    motion, down = sliding(speed=2.8)
    locked = lock_feet(motion, down)
    for side in ("left", "right"):
        knee = locked.rotations[:, locked.skeleton.index(f"{side}_lower_leg")]
        pitch = torch.atan2(knee[:, 2, 1], knee[:, 1, 1])  # about x: above 0 is bent backwards up
        assert pitch.min() > -0.02


def legs_of(motion):
    """Knees and ankles (frames, 2, 3) as seen from their hips, left first."""
    joints, points = leg_joints(motion.skeleton), motion.positions()
    hips, knees, ankles = (points[:, joints[part]] for part in PARTS[:3])
    return knees - hips, ankles - hips


def lifted(motion, thigh, splay, knee, seconds=(1.0, 2.0)):
    """The motion, its left leg in another pose for a while, turned by radians from hanging down.

    thigh : ahead; splay : aside; knee : folded, below 0 bent backwards.
    """
    at = torch.arange(len(motion)) / motion.fps
    begin, end = seconds
    share = ((at - begin) / 0.3).minimum((end - at) / 0.3).clamp(0, 1)
    turns = {
        "left_upper_leg": torch.tensor([-thigh, 0.0, splay]),
        "left_lower_leg": torch.tensor([knee, 0.0, 0.0]),
    }
    rotations = motion.rotations.clone()
    for name, turn in turns.items():
        joint = motion.skeleton.role(name)
        was = roma.rotmat_to_unitquat(rotations[:, joint])
        pose = roma.rotmat_to_unitquat(roma.rotvec_to_rotmat(turn))
        mixed = [roma.unitquat_slerp(q, pose, s, True) for q, s in zip(was, share, strict=True)]
        rotations[:, joint] = roma.unitquat_to_rotmat(torch.stack(mixed))
    return replace(motion, rotations=rotations)


def kick(**more):
    """`sliding`, the left leg off the floor and in a pose for a while; and its contacts."""
    motion, down = sliding()
    down = down.clone()
    down[int(0.7 * motion.fps) : int(2.3 * motion.fps), 0] = False
    return lifted(motion, **more), down


@pytest.mark.parametrize("thigh", [1.4, 2.4])
@pytest.mark.parametrize("knee", [1.5, 2.65])
@pytest.mark.parametrize("leans", [-0.03, 0.03])
def test_a_knee_raised_in_front_stays_there(thigh, knee, leans):
    """Where thighs lean at rest, in metres, and legs fold up, a front points backwards from a leg."""
    motion, down = kick(thigh=thigh, splay=0.0, knee=knee)
    offsets = motion.skeleton.offsets.clone()
    for part, forward in (("lower_leg", leans), ("foot", -leans)):
        offsets[[motion.skeleton.role(f"{side}_{part}") for side in SIDES], 2] += forward
    motion = replace(motion, skeleton=replace(motion.skeleton, offsets=offsets))
    locked = lock_feet(motion, down)
    (was, ankle), (found, now) = legs_of(motion), legs_of(locked)
    went = (found - was).norm(dim=-1)
    assert went.max() < 0.1
    assert (
        went <= 2 * least_moves(was, ankle, now) + 1.1 * (now - ankle).norm(dim=-1) + 5e-4
    ).all()


def least_moves(knee, ankle, now):
    """How far knees (..., 3) must go at least for ankles that go from `ankle` to `now`.

    They may lie on a circle about the line from hip to ankle; all are seen from the hip.
    """
    thigh, shank = knee.norm(dim=-1), (ankle - knee).norm(dim=-1)
    far = now.norm(dim=-1)
    along = ((thigh**2 + far**2 - shank**2) / (2 * far)).clamp(-thigh, thigh)
    beside = (thigh**2 - along**2).clamp(min=0).sqrt()
    line = now / far[..., None]
    level = (knee * line).sum(-1)
    return torch.hypot(level - along, (knee - level[..., None] * line).norm(dim=-1) - beside)


@settings(deadline=None, max_examples=20)
@given(
    thigh=st.floats(-0.6, 2.6), splay=st.floats(-0.5, 1.2), knee=st.floats(-1.0, 2.7),
    aired=st.booleans(), slide=st.floats(-0.3, 0.3), seed=st.integers(0, 10_000),
)  # fmt: skip
def test_no_knee_goes_much_farther_than_its_foot(thigh, splay, knee, aired, slide, seed):
    """Unmoved feet leave their legs; bent knees stay on the side to which they bent."""
    down = kick(thigh=0.0, splay=0.0, knee=0.0)[1] if aired else sliding()[1]
    motion = lifted(sliding(slide=slide)[0], thigh, splay, knee)
    motion = redrawn(motion, random_axes(motion.skeleton, seed))
    locked = lock_feet(motion, down, floor=None)
    (was, ankle), (found, now) = legs_of(motion), legs_of(locked)
    went, foot = (found - was).norm(dim=-1), (now - ankle).norm(dim=-1)
    assert (went[foot < 1e-6] < 5e-4).all()
    line = ankle / ankle.norm(dim=-1, keepdim=True)
    bent = (was - (was * line).sum(-1, keepdim=True) * line).norm(dim=-1) > 2 * STRAIGHT
    if knee >= 0:  # a knee behind its leg may come out in front
        assert (went <= 2 * least_moves(was, ankle, now) + 1.1 * foot + 5e-4)[bent].all()


def test_a_knee_that_bends_backwards_is_not_turned_round():
    motion, down = kick(thigh=0.3, splay=0.0, knee=-0.6)
    (was, _), (found, _) = (legs_of(m) for m in (motion, lock_feet(motion, down)))
    assert (found - was)[int(1.3 * motion.fps) : int(1.7 * motion.fps), 0].norm(dim=-1).max() < 0.01


def test_a_batch_is_its_motions_one_by_one():
    many = [sliding(speed=v, seed=i) for i, v in enumerate((0.9, 1.4, 2.8))]
    place, turns = lock(
        many[0][0].skeleton,
        torch.stack([m.root_positions for m, _ in many]),
        torch.stack([m.rotations for m, _ in many]),
        torch.stack([down for _, down in many]),
        30,
    )
    for i, (motion, down) in enumerate(many):
        alone = lock_feet(motion, down)
        assert torch.allclose(place[i], alone.root_positions, atol=1e-5)
        assert torch.allclose(turns[i], alone.rotations, atol=1e-4)


@settings(deadline=None, max_examples=15)
@given(seed=st.integers(0, 1000), wrong=st.sampled_from([0.05, 0.2, 0.5]))
def test_wrong_labels_give_a_worse_gait_that_stays_whole(seed, wrong):
    motion, down = sliding(seed=seed)
    chance = torch.Generator().manual_seed(seed)
    flipped = down ^ (torch.rand(down.shape, generator=chance) < wrong)
    moved = lock_feet(motion, flipped).positions() - motion.positions()
    assert moved.isfinite().all() and moved.norm(dim=-1).max() < 0.5


def test_labels_that_say_nothing():
    motion, down = sliding()
    unlabelled = lock_feet(motion, torch.zeros_like(down))
    assert (unlabelled.positions() - motion.positions()).abs().max() < 1e-4
    stuck = lock_feet(motion, torch.ones_like(down)).positions() - motion.positions()
    assert stuck.isfinite().all() and stuck.norm(dim=-1).max() < 0.5


def test_the_floor_is_where_it_is_said_to_be_or_where_toes_rest():
    motion, down = sliding()
    high = replace(motion, root_positions=motion.root_positions + torch.tensor([0.0, 0.1, 0.0]))
    for floor in (0.1, None):
        locked = lock_feet(high, down, floor=floor)
        expected = lock_feet(motion, down).positions() + torch.tensor([0.0, 0.1, 0.0])
        assert (locked.positions() - expected).norm(dim=-1).max() < 0.005
    lower = lock_feet(high, down).positions()  # the floor is at 0: down to it
    assert (
        abs(float(lower[..., 1].min() - lock_feet(motion, down).positions()[..., 1].min())) < 5e-3
    )


def test_a_rest_pose_that_hangs_from_its_root_has_a_floor_too():
    motion, down = sliding()
    skeleton = motion.skeleton
    lifted = skeleton.offsets.clone()
    lifted[0] = 0
    hanging = replace(skeleton, offsets=lifted)
    same = replace(motion, skeleton=hanging)
    assert torch.allclose(same.positions(), motion.positions(), atol=1e-5)
    locked = lock_feet(same, down, floor=None).positions()
    # its lowest joint stands for the sole, which is up to 3 cm lower
    assert (locked - lock_feet(motion, down, floor=None).positions()).norm(dim=-1).max() < 0.03


def test_gaps_are_filled_and_flickers_left_out():
    row = torch.tensor([int(x) for x in "0011110111100010000"]).bool()[:, None].repeat(1, 2)
    joined = "".join(str(int(x)) for x in clean(row, 30)[:, 0])
    assert joined == "0011111111100000000"


def test_own_contacts_and_those_of_both_parts_of_a_foot_are_understood():
    motion, down = sliding()
    four = torch.zeros(len(motion), 4, dtype=torch.bool)
    four[:, TOES] = down
    same = lock_feet(motion, down).positions()
    assert torch.equal(lock_feet(motion, four).positions(), same)
    assert torch.equal(lock_feet(replace(motion, contacts=four)).positions(), same)
    found = lock_feet(motion, contacts.label(motion))
    assert found.positions().isfinite().all()


def test_a_foot_without_a_toe_joint_is_held_by_its_end():
    skeleton = gaits.make(seconds=1).skeleton
    toes = [skeleton.index(f"{side}_toes") for side in ("left", "right")]
    keep = [joint for joint in range(skeleton.joints) if joint not in toes]
    number = {joint: i for i, joint in enumerate(keep)} | {-1: -1}
    ends = [i for i, joint in enumerate(skeleton.end_parents) if joint not in toes]
    short = Skeleton(
        tuple(skeleton.names[j] for j in keep),
        tuple(number[skeleton.parents[j]] for j in keep),
        skeleton.offsets[keep],
        (
            *(number[skeleton.end_parents[i]] for i in ends),
            *(number[skeleton.parents[t]] for t in toes),
        ),
        torch.cat([skeleton.end_offsets[ends], skeleton.offsets[toes]]),
    )
    motion, down = sliding()
    cut = replace(motion, skeleton=short, rotations=motion.rotations[:, keep], contacts=None)
    locked = lock_feet(cut, down)
    assert held_steps(cut, down).mean() > 3
    assert held_steps(locked, down).max() < 0.1


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"contacts": torch.zeros(10, 2, dtype=torch.bool)}, r"shape \(10, 2\)"),
        ({"contacts": np.zeros((120, 2))}, "float64"),
        ({"contacts": torch.zeros(120, 3, dtype=torch.bool)}, r"\(120, 2\) for both toes"),
        ({"blend": -1.0}, "blend -1.0 s"),
        ({"floor": float("nan")}, "floor nan m"),
    ],
)
def test_what_cannot_be_locked_is_said(wrong, message):
    motion, down = sliding()
    with pytest.raises(ModelError, match=message):
        lock_feet(motion, **{"contacts": down} | wrong)
    with pytest.raises(ModelError, match="has no contacts"):
        lock_feet(replace(motion, contacts=None))
