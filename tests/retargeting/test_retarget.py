"""Retargeting: identity, scale, feet on the ground and still, errors; real clips of each source."""

from __future__ import annotations

from dataclasses import replace

import pytest
import roma
import torch
from other_axes import in_axes

from motionlab import Motion, Skeleton, datasets
from motionlab.datasets import gaits, loader, locomotion
from motionlab.errors import RetargetError
from motionlab.io.bvh import parse_bvh
from motionlab.retargeting.flat_feet import Stance
from motionlab.retargeting.rest_alignment import alignment, stands
from motionlab.retargeting.retarget import _retarget, retarget

CANONICAL = Skeleton.canonical()
FEET = [CANONICAL.index(j) for j in ("left_foot", "left_toes", "right_foot", "right_toes")]
NAMES = ("walk_1.3", "run_3.0", "start_1.3", "run_2.6_turn_left_0.6", "walk_0.8_turn_right_0.5")


@pytest.fixture(scope="module")
def gait() -> dict[str, Motion]:
    return {motion.name: motion for motion in gaits.load() if motion.name in NAMES}


def renamed(motion: Motion, factor: float = 1.0, turn: torch.Tensor | None = None) -> Motion:
    """The motion on a body `factor` times as large whose joints' axes lie another way.

    turn : (joints, 3, 3), each joint's new axes in its old ones.
    """
    s = motion.skeleton
    turn = torch.eye(3).expand(s.joints, 3, 3) if turn is None else turn
    offsets, ends, rotations = in_axes(motion, turn)
    names = tuple(name.replace("Hips", "pelvis") for name in s.names)
    body = Skeleton(names, s.parents, factor * offsets, s.end_parents, factor * ends)
    return replace(
        motion, skeleton=body, root_positions=factor * motion.root_positions, rotations=rotations
    )


def assert_same(found: Motion, wanted: Motion, millimetres: float, degrees: float) -> None:
    apart = (found.positions() - wanted.positions()).norm(dim=-1).max()
    turned = roma.rotmat_geodesic_distance(found.orientations(), wanted.orientations())
    assert 1000 * apart < millimetres
    assert torch.rad2deg(turned).max() < degrees


def still(motion: Motion) -> float:
    """Largest movement in metres of a heel or toe from one frame in contact to the next."""
    feet = motion.positions()[:, FEET]
    step = (feet[1:] - feet[:-1]).norm(dim=-1)
    return float(step[motion.contacts[1:] & motion.contacts[:-1]].max())


def knee_bends(motion: Motion) -> torch.Tensor:
    """Angles (frames, 2) by which knees bend, negative if backwards, about the thigh's left."""
    points, world = motion.positions(), motion.orientations()
    bends = []
    for side in ("left", "right"):
        hip, knee, foot = (
            motion.skeleton.index(f"{side}_{part}") for part in ("upper_leg", "lower_leg", "foot")
        )
        thigh, shank = points[:, knee] - points[:, hip], points[:, foot] - points[:, knee]
        cross = torch.linalg.cross(thigh, shank)
        bends.append(torch.atan2((cross * world[:, hip, :, 0]).sum(-1), (thigh * shank).sum(-1)))
    return torch.stack(bends, -1)


# -- made motion ----------------------------------------------------------------------------------


def test_onto_its_own_skeleton_is_the_identity(gait):
    for motion in gait.values():
        assert motion.retarget() is motion
        assert motion.retarget(CANONICAL) is motion


@pytest.mark.parametrize("name", NAMES)
def test_all_steps_together_leave_a_canonical_motion_as_it_is(gait, name):
    motion = gait[name]
    found = _retarget(motion, CANONICAL, Stance())
    assert_same(found, motion, 1.0, 0.1)
    assert torch.equal(found.contacts, motion.contacts)


@pytest.mark.parametrize("factor", [0.8, 1.2])
def test_a_larger_body_walks_the_same_at_its_scale(gait, factor):
    motion = gait["walk_1.3"]
    found = retarget(renamed(motion, factor))
    # contacts, given with the motion, put the feet down; way and pose scale back
    assert_same(found, motion, 1.0, 0.1)
    assert (found.fps, found.name, found.source) == (motion.fps, motion.name, motion.source)


def test_joint_axes_drawn_another_way_change_nothing(gait):
    """The rest pose is no body then, but a reference tells."""
    motion = gait["walk_1.3"]
    random = roma.random_rotmat(CANONICAL.joints, generator=torch.Generator().manual_seed(0))
    other = renamed(motion, 1.0, random)
    assert stands(motion.skeleton) and not stands(other.skeleton)
    standing = Motion(CANONICAL, torch.zeros(1, 3), torch.eye(3).expand(1, 21, 3, 3), 30)
    found = retarget(other, reference=renamed(standing, 1.0, random))
    assert_same(found, motion, 1.0, 0.1)


def test_axes_along_the_bones_are_found_without_a_reference(gait):
    motion = gait["walk_1.3"]
    turns = torch.eye(3).repeat(CANONICAL.joints, 1, 1)
    for joint, name in enumerate(CANONICAL.names):
        if "Leg" in name or name in ("Spine", "Chest", "Neck", "Head"):
            turns[joint] = roma.euler_to_rotmat("Z", torch.tensor([-torch.pi / 2]))
    other = renamed(motion, 1.0, turns)
    found = alignment(other, CANONICAL, None)
    for role, joint in CANONICAL.roles.items():
        if "leg" in role or role in ("spine", "chest", "neck", "head"):
            assert torch.allclose(found[role], turns[joint].mT, atol=1e-3), role


def test_a_tilted_floor_is_levelled_and_feet_are_held(gait):
    motion = replace(renamed(gait["walk_1.3"], 1.1), contacts=None)
    tilted = motion.root_positions + 0.01 * motion.root_positions[:, 2:] * torch.eye(3)[1] - 0.04
    found = retarget(replace(motion, root_positions=tilted))
    assert still(found) < 1e-4
    heights = found.positions()[:, FEET, 1]
    assert (heights[:, [0, 2]][found.contacts[:, [0, 2]]] - 0.1).abs().max() < 5e-4
    assert (heights[:, [1, 3]][found.contacts[:, [1, 3]]] - 0.0251).abs().max() < 5e-4
    truth = gait["walk_1.3"].contacts
    assert (found.contacts & truth).sum() > 0.8 * truth.sum()  # most of what is in contact
    assert (found.contacts & truth).sum() > 0.85 * found.contacts.sum()


def test_bones_keep_their_length_and_rotations_are_rotations(gait):
    found = retarget(renamed(gait["run_3.0"], 1.3))
    assert found.skeleton is CANONICAL
    gram = found.rotations @ found.rotations.mT
    assert (gram - torch.eye(3)).abs().max() < 1e-5
    assert torch.linalg.det(found.rotations).min() > 0.99


def test_knees_stay_forward_even_if_the_source_bends_them_back(gait):
    motion = renamed(gait["walk_1.3"], 1.1)
    knee = motion.skeleton.index("left_lower_leg")
    rotations = motion.rotations.clone()
    rotations[40:60, knee] = rotations[40:60, knee].mT  # bent the other way
    found = retarget(replace(motion, rotations=rotations))
    assert knee_bends(found).min() > -1e-3


@pytest.mark.parametrize("frames", [1, 2, 5])
def test_few_frames(gait, frames):
    found = retarget(replace(renamed(gait["walk_1.3"], 1.2), contacts=None)[:frames])
    assert len(found) == frames and found.contacts.shape == (frames, 4)


@pytest.mark.parametrize(
    "places",
    [
        ["LeftLowerLeg", "LeftFoot", "RightFoot"],
        ["LeftLowerArm", "RightHand"],
        ["LeftUpperLeg", "RightUpperLeg", "Neck"],
        ["Hips"],
    ],
    ids=["leg twists", "arm twists", "hip joints and neck", "root above the hips"],
)
def test_a_target_may_have_joints_between(gait, places):
    """Half way along a bone, meaning nothing: every other joint comes where it came without."""
    motion = renamed(gait["walk_1.3"], 1.2)
    longer = CANONICAL
    for number, name in enumerate(places):
        longer = with_joint(longer, name, f"twist{number}")
    found, wanted = motion.retarget(longer), motion.retarget()
    joints = [longer.index(name) for name in CANONICAL.names]
    apart = found.positions()[:, joints] - wanted.positions()[:, : CANONICAL.joints]
    assert apart.norm(dim=-1).max() < 1e-4
    assert torch.equal(found.contacts, wanted.contacts)


def with_joint(s: Skeleton, name: str, new: str) -> Skeleton:
    """The skeleton with a joint half way from a joint's parent to the joint (or below the root)."""
    at = s.index(name)
    shift = lambda parents: [parent + (parent >= at) for parent in parents]
    parents, offsets, names = shift(s.parents), list(s.offsets), list(s.names)
    parents.insert(at, parents[at])
    parents[at + 1] = at
    offsets.insert(at, offsets[at] / 2)
    offsets[at + 1] = offsets[at]
    names.insert(at, new)
    return Skeleton(names, parents, torch.stack(offsets), shift(s.end_parents), s.end_offsets)


def test_what_a_source_lacks_follows_what_it_is_on(gait):
    """The neck of a source that has none goes with the chest, across a joint without a role too."""
    motion = without(gait["run_3.0"], "Neck", "Head")
    longer = with_joint(CANONICAL, "Neck", "middle")
    found = motion.retarget(longer)
    chest, neck = (found.orientations()[:, longer.index(name)] for name in ("Chest", "Neck"))
    torch.testing.assert_close(neck, chest)
    assert (chest - found.orientations()[:, 0]).abs().max() > 0.01  # which are not the hips


def test_gradients_stop(gait):
    motion = replace(renamed(gait["walk_1.3"], 1.1), contacts=None)
    found = retarget(replace(motion, rotations=motion.rotations.clone().requires_grad_()))
    assert torch.equal(found.rotations, retarget(motion).rotations)
    assert not found.rotations.requires_grad


def test_mirrored_and_turned_sources_give_mirrored_and_turned_results(gait):
    motion = replace(renamed(gait["run_2.6_turn_left_0.6"], 1.1), contacts=None)
    found = retarget(motion)
    assert_same(retarget(motion.mirror()), found.mirror(), 0.1, 0.05)
    turn = roma.rotvec_to_rotmat(torch.tensor([0.0, 2.0, 0.0]))
    moved = lambda m, metres=1.0: replace(
        m,
        root_positions=m.root_positions @ turn.mT + metres * torch.tensor([3.0, 0, -2]),
        rotations=torch.cat([turn @ m.rotations[:, :1], m.rotations[:, 1:]], 1),
    )
    assert_same(retarget(moved(motion)), moved(found, 1 / 1.1), 0.5, 0.1)


def without(motion: Motion, *names: str) -> Motion:
    """The motion with joints that have no role, as it is said."""
    s = motion.skeleton
    odd = tuple(f"bone{i}" if name in names else name for i, name in enumerate(s.names))
    none = {role: "" for role, joint in s.roles.items() if s.names[joint] in names}
    body = Skeleton(odd, s.parents, 1.1 * s.offsets, s.end_parents, s.end_offsets, roles=none)
    return replace(motion, skeleton=body, root_positions=1.1 * motion.root_positions)


def test_what_is_missing_is_named(gait):
    motion = gait["walk_1.3"]
    with pytest.raises(RetargetError, match="left_hand"):
        retarget(without(motion, "LeftHand"))
    with pytest.raises(RetargetError, match="target skeleton has no joint for .*right_hand"):
        motion.retarget(without(motion, "RightHand").skeleton)
    with pytest.raises(RetargetError, match="no frame"):
        retarget(renamed(motion, 1.2)[:0])
    with pytest.raises(RetargetError, match="standing upright and facing"):
        turned = torch.eye(3).repeat(21, 1, 1)
        turned[1:] = roma.euler_to_rotmat("X", torch.tensor([2.0]))
        motion.retarget(renamed(motion, 1.0, turned).skeleton)
    for reference in (motion, "standing"):
        with pytest.raises(RetargetError, match="reference"):
            retarget(renamed(motion, 1.2), reference=reference)
    for wrong in (("walk", CANONICAL), (motion, "canonical")):
        with pytest.raises(RetargetError, match="takes a Motion and a Skeleton"):
            retarget(*wrong)


@pytest.mark.parametrize("limb", ["left_hand", "right_foot", "right_lower_leg"])
def test_limbs_without_length_are_named(gait, limb):
    motion = renamed(gait["walk_1.3"])
    offsets = motion.skeleton.offsets.clone()
    offsets[motion.skeleton.index(limb)] = 0
    flat = replace(motion.skeleton, offsets=offsets)
    with pytest.raises(RetargetError, match=f"motion's skeleton has no bone .* to {limb}"):
        retarget(replace(motion, skeleton=flat))
    with pytest.raises(RetargetError, match=f"target skeleton has no bone .* to {limb}"):
        gait["walk_1.3"].retarget(flat)


def test_a_target_needs_toes_or_the_ends_of_feet(gait):
    s = CANONICAL
    bare = [i for i, name in enumerate(s.names) if "Toes" not in name]
    target = Skeleton(
        [s.names[i] for i in bare],
        [bare.index(s.parents[i]) if i else -1 for i in bare],
        1.1 * s.offsets[bare],
    )
    with pytest.raises(RetargetError, match="neither toes nor end sites"):
        gait["walk_1.3"].retarget(target)
    feet = [target.index(f"{side}_foot") for side in ("left", "right")]
    ends = torch.tensor([[0.0, -0.08, 0.1]]).expand(2, 3)
    target = replace(target, end_parents=feet, end_offsets=ends)
    found = gait["walk_1.3"].retarget(target)
    points = found.positions()
    heights = points[:, feet, 1][found.contacts[:, [0, 2]]]
    assert heights.std() < 1e-3 and points[..., 1].min() > 0.0


def test_toes_neck_and_collars_may_be_missing(gait):
    motion = without(
        gait["walk_1.3"], "LeftToes", "RightToes", "Neck", "Spine", "LeftShoulder", "RightShoulder"
    )
    found = retarget(motion)
    assert_same(found[:1], retarget(without(gait["walk_1.3"]))[:1], 60.0, 60.0)
    assert still(found) < 1e-4


# -- real clips -----------------------------------------------------------------------------------


def test_real_clips_of_every_source(real_clips):
    units = {"cmu": 0.05644444}
    for source, clips in real_clips.items():
        path, data = list(clips.items())[1]
        how = {"units": units.get(source, 0.01), "source": source, "tpose_first": True}
        motion = parse_bvh(data, path, **how)
        motion = motion.resample(30)[:150]
        found = retarget(motion)
        assert found.skeleton is CANONICAL and len(found) == len(motion)
        assert still(found) < 1e-3, path
        assert knee_bends(found).min() > -1e-3, path
        points = found.positions()
        assert points[:, FEET, 1].min() > 0.02 and points[..., 1].max() < 2.2, path


CLIPS = [
    ("bandai-locomotion", "dataset-2_walk_normal_001"),
    ("bandai-locomotion", "dataset-2_run_active_001"),
    ("accad", "Male1_B3_Walk"),
    ("accad", "Male1_C16_RunTurnRight135"),
    ("cmu", "02_01"),
    ("cmu", "05_01"),
]


@pytest.mark.usefixtures("recorded_clips")
@pytest.mark.parametrize(("source", "name"), CLIPS)
def test_locomotion_stays_close_to_its_source(source, name):
    motion = datasets.load(source, clips=[name], download=False)[0].resample(30)
    found = locomotion.bring(motion, loader.stance(source))
    before, after = motion.positions(), found.positions()
    theirs, ours = motion.skeleton.roles, CANONICAL.roles
    errors = []
    for side in ("left", "right"):
        for start, middle, end in (
            ("upper_arm", "lower_arm", "hand"),
            ("upper_leg", "lower_leg", "foot"),
        ):
            a, b, c = (f"{side}_{part}" for part in (start, middle, end))
            length = lambda p, r, a=a, b=b, c=c: float(
                (p[0, r[b]] - p[0, r[a]]).norm() + (p[0, r[c]] - p[0, r[b]]).norm()
            )
            ratio = length(after, ours) / length(before, theirs)
            apart = ratio * (before[:, theirs[c]] - before[:, theirs[a]])
            errors.append((after[:, ours[c]] - after[:, ours[a]] - apart).norm(dim=-1))
    assert torch.stack(errors).median() < 0.02
    assert torch.stack(errors).quantile(0.95) < 0.06
    assert still(found) < 1e-3
    assert knee_bends(found).min() > -1e-3
    touches = found.contacts.unflatten(1, (2, 2)).any(2).float().mean(0)
    assert touches.min() > 0.15  # both feet come down
