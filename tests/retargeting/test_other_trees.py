"""Rigs hang their joints in trees of many kinds: the same body moves, whatever the tree."""

from __future__ import annotations

import random

import pytest
import torch
from other_rigs import along_bones, facing, random_axes, redrawn
from other_trees import CHANGES, regrown
from rig_names import CONVENTIONS, names_of

from motionlab import Motion, Skeleton, contacts
from motionlab.datasets import gaits
from motionlab.errors import RetargetError, SkeletonError
from motionlab.retargeting.joints_between import settled
from motionlab.roles import SIDES
from motionlab.solvers import lock_feet

CANONICAL = Skeleton.canonical()
GAITS = {motion.name: motion for motion in gaits.load()}
BONES = (
    ("upper_arm", "lower_arm"),
    ("lower_arm", "hand"),
    ("upper_leg", "lower_leg"),
    ("lower_leg", "foot"),
)
AXES = ("as they were", "of new joints any", "any", "along bones")


def centimetres(found: Motion, wanted: Motion) -> float:
    """Largest distance of two points."""
    return float(100 * (found.positions() - wanted.positions()).norm(dim=-1).max())


def axes_drawn(motion: Motion, axes: str, convention: str, seed: int) -> Motion:
    """The motion on a rig whose joints' axes lie another way."""
    if axes == "as they were":
        return motion
    skeleton, turn = motion.skeleton, random_axes(motion.skeleton, seed)
    if axes == "of new joints any":
        own = names_of(CONVENTIONS[convention])
        for joint, name in enumerate(skeleton.names):
            if name in own:
                turn[joint] = torch.eye(3)
    return redrawn(motion, along_bones(skeleton, torch.eye(3)[0]) if axes == AXES[3] else turn)


def check(motion: Motion, rig: Motion, own: list[str]) -> None:
    """The body's own joints are where they were; what is made of it is right, or refused."""
    places = rig.positions()
    for joint, name in enumerate(own):
        if name in rig.skeleton.names:
            was = places[:, rig.skeleton.names.index(name)] - motion.positions()[:, joint]
            assert was.norm(dim=-1).max() < 1e-3
    assert centimetres(rig.retarget(), motion) < 2
    assert centimetres(lock_feet(rig, contacts.label(rig), floor=None), rig) < 1


@pytest.mark.parametrize("axes", ["as they were", "any"])
@pytest.mark.parametrize("change", CHANGES)
def test_every_change_is_understood(change, axes):
    motion = GAITS["walk_1.3_turn_right_0.3"][:60]
    rig = axes_drawn(regrown(motion, {change}, "unreal", 0), axes, "unreal", 0)
    check(motion, rig, names_of(CONVENTIONS["unreal"]))


@pytest.mark.parametrize("seed", range(20))
def test_many_changes_are_right_or_refused(seed):
    """Of each of twenty gaits one rig, drawn by a seed: its tree, names, axes, and where it faces."""
    chance = random.Random(seed)
    changes = set(chance.sample(sorted(CHANGES), chance.randint(1, 6)))
    convention, axes = chance.choice(sorted(CONVENTIONS)), chance.choice(AXES)
    motion = facing(GAITS[sorted(GAITS)[2 * seed]], chance.uniform(-3.2, 3.2))
    rig = axes_drawn(regrown(motion, changes, convention, seed), axes, convention, seed)
    try:
        check(motion, rig, names_of(CONVENTIONS[convention]))
    except (RetargetError, SkeletonError) as error:
        assert "roles=" in str(error)


def test_only_joints_that_fold_a_limb_at_rest_get_other_axes():
    motion = GAITS["walk_1.3"][:30]
    rig = regrown(motion, {"joints_in_limbs", "more_spine"}, "unreal", 1)
    assert settled(rig) is rig
    odd = axes_drawn(rig, "of new joints any", "unreal", 1)
    again = settled(odd)
    assert centimetres(again, odd) < 0.01
    pairs = [(f"{side}_{a}", f"{side}_{b}") for side in SIDES for a, b in BONES]
    lie = lambda m: torch.stack([m.skeleton.below(*pair) for pair in pairs])
    assert (lie(odd) - lie(rig)).norm(dim=-1).max() > 0.1
    assert torch.allclose(lie(again), lie(rig), atol=1e-3)
    own = [odd.skeleton.names.index(name) for name in names_of(CONVENTIONS["unreal"])]
    assert torch.allclose(again.orientations()[:, own], odd.orientations()[:, own], atol=1e-5)
