"""Legs stay as stretched as they were: straight ones, kicking ones, and those that stand."""

from __future__ import annotations

from dataclasses import replace

import pytest
import roma
import torch

from motionlab import Motion, Skeleton
from motionlab.datasets import gaits
from motionlab.feet.planting import Foot, Sole
from motionlab.retargeting.hips import follow

CANONICAL = Skeleton.canonical()
SIDES = ("left", "right")


def actor(ankles: float = 1.0, thighs: float = 1.0) -> Skeleton:
    """A body with lower ankles than the canonical one's, and longer thighs."""
    offsets = CANONICAL.offsets.clone()
    for side in SIDES:
        offsets[CANONICAL.role(f"{side}_toes"), 1] *= ankles
        offsets[CANONICAL.role(f"{side}_lower_leg")] *= thighs
    return replace(CANONICAL, offsets=offsets, roles=None)


def knees(motion: Motion) -> torch.Tensor:
    """Angles (frames, 2) in degrees between thighs and shanks, negative where bent backwards."""
    points, world = motion.positions(), motion.orientations()
    bends = []
    for side in SIDES:
        hip, knee, foot = (
            motion.skeleton.role(f"{side}_{part}") for part in ("upper_leg", "lower_leg", "foot")
        )
        thigh, shank = points[:, knee] - points[:, hip], points[:, foot] - points[:, knee]
        left = (torch.linalg.cross(thigh, shank) * world[:, hip, :, 0]).sum(-1)
        bends.append(torch.atan2(left, (thigh * shank).sum(-1)))
    return torch.rad2deg(torch.stack(bends, -1))


def lowered(motion: Motion) -> Motion:
    """The motion with its lowest toe on the floor in every frame."""
    toes = [motion.skeleton.role(f"{side}_toes") for side in SIDES]
    down = motion.positions()[:, toes, 1].amin(1) - 0.0251
    return replace(motion, root_positions=motion.root_positions - down[:, None] * torch.eye(3)[1])


def kicking(body: Skeleton) -> Motion:
    """The left leg stands, the right one is swung up to the front and down, both straight."""
    frames = 90
    rotations = torch.eye(3).repeat(frames, body.joints, 1, 1)
    angle = -1.6 * torch.sin(torch.linspace(0, torch.pi, frames)) ** 2 - 0.5
    rotations[:, body.role("right_upper_leg")] = roma.rotvec_to_rotmat(
        torch.stack([angle, 0 * angle, 0 * angle], -1)
    )
    return lowered(Motion(body, torch.zeros(frames, 3), rotations, 30))


def straight_legged(body: Skeleton, share: float) -> Motion:
    """A walk whose knees bend a share of what they did, feet turned in the world as they were."""
    gait = next(motion for motion in gaits.load() if motion.name == "walk_1.3")
    rotations, world = gait.rotations.clone(), gait.orientations()
    for side in SIDES:
        thigh, knee, foot = (body.role(f"{side}_{x}") for x in ("upper_leg", "lower_leg", "foot"))
        bend = share * roma.rotmat_to_rotvec(rotations[:, knee])
        rotations[:, knee] = roma.rotvec_to_rotmat(bend)
        rotations[:, foot] = (world[:, thigh] @ rotations[:, knee]).mT @ world[:, foot]
    return lowered(replace(gait, skeleton=body, rotations=rotations, contacts=None))


@pytest.mark.parametrize("ankles", [0.6, 1.3])
def test_a_leg_that_kicks_bends_no_knee(ankles):
    motion = kicking(actor(ankles))
    found = motion.retarget()
    assert knees(found).abs().max() < 5
    assert knees(found).diff(dim=0).abs().max() < 3
    assert found.contacts[:, :2].float().mean() > 0.95
    assert not found.contacts[20:70, 2:].any()


@pytest.mark.parametrize("ankles", [0.6, 1.3])
def test_the_leg_that_kicks_goes_as_far_up_as_it_did(ankles):
    motion = kicking(actor(ankles))
    height = lambda m: m.positions()[45, m.skeleton.role("right_foot"), 1]
    assert abs(height(motion.retarget()) - height(motion)) < 0.06


@pytest.mark.parametrize("share", [0.05, 0.3])
@pytest.mark.parametrize("body", [actor(0.7), actor(0.7, 1.15), actor(1.3)])
def test_straight_legs_stay_straight(body, share):
    motion = straight_legged(body, share)
    found = motion.retarget()
    before, after = knees(motion), knees(found)
    stands = found.contacts[:, [0, 2]]
    assert stands.float().mean() > 0.08
    assert (after[stands].median() - before[stands].median()).abs() < 1
    assert (after.diff(dim=0).abs() - before.diff(dim=0).abs()).max() < 7
    assert after.min() > -3
    jerks = lambda angles: angles.diff(n=2, dim=0).square().mean().sqrt()
    assert jerks(after) < 1.2 * jerks(before) + (0.7 if share < 0.1 else 0)  # 1.6 is straight


def test_a_held_foot_is_held_while_hips_follow():
    found = straight_legged(actor(0.7, 1.15), 0.3).retarget()
    feet = [CANONICAL.role(f"{side}_{part}") for side in SIDES for part in ("foot", "toes")]
    step = found.positions()[:, feet].diff(dim=0).norm(dim=-1)
    assert step[found.contacts[1:] & found.contacts[:-1]].max() < 1e-3


def test_a_foot_about_to_stand_pulls_the_hips_as_it_will_then():
    """A foot on its toes lies wherever its heel has not risen yet; hips had leant towards it."""
    frames, sole = 40, torch.tensor([0.0, -0.0749, 0.0906])
    flat = Sole(sole, torch.zeros(3), torch.tensor([0.1, 0.0251]))
    contacts = torch.ones(frames, 2, dtype=torch.bool)
    feet, starts = [], torch.tensor([[[0.1, 0.87, 0.0]], [[-0.1, 0.87, 0.0]]]).repeat(1, frames, 1)
    for x in (0.1, -0.1):
        ankle = torch.tensor([x, 0.1, 0.0]).repeat(frames, 1)
        eye = torch.eye(3).repeat(frames, 1, 1)
        feet.append(Foot(ankle, eye, eye, contacts, torch.zeros(frames, 3), flat))
    stretch = (starts - torch.stack([foot.ankle for foot in feet])).norm(dim=-1)
    rises = contacts.clone()
    rises[:20, 0] = False
    ankle = feet[1].ankle.clone()
    ankle[:20, 1] += 0.04  # on its toes, before `let_go` has seen to its heel
    feet[1] = replace(feet[1], ankle=ankle, contacts=rises)
    assert follow(feet, starts, stretch, 30).norm(dim=-1).max() < 1e-3
