"""Rest poses of every kind: where they face, how their axes are drawn, whether they stand at all."""

from __future__ import annotations

import warnings
from dataclasses import replace

import pytest
import roma
import torch
from hypothesis import given, settings
from hypothesis import strategies as st
from other_axes import in_axes

from motionlab import Motion, Skeleton
from motionlab.datasets import gaits
from motionlab.retargeting.rest_alignment import stands, upright

CANONICAL = Skeleton.canonical()
GAITS = {motion.name: motion for motion in gaits.load()}
FACING = st.floats(0, 360)


def redrawn(motion: Motion, turn: torch.Tensor, prefix: str = "x") -> Motion:
    """The motion on a body whose joints' axes lie another way, under names that say nothing.

    turn : (joints, 3, 3), each joint's new axes in its old ones; offsets say how the rest pose lies.
    """
    s = motion.skeleton
    offsets, ends, rotations = in_axes(motion, turn)
    names = [f"{prefix}{joint}" for joint in range(s.joints)]
    roles = {role: names[joint] for role, joint in s.roles.items()}
    body = Skeleton(names, s.parents, offsets, s.end_parents, ends, roles=roles)
    return replace(motion, skeleton=body, rotations=rotations)


def about(axis: str, degrees: float) -> torch.Tensor:
    """One rotation (joints, 3, 3) for all joints."""
    turn = roma.euler_to_rotmat(axis.upper(), torch.tensor([degrees]), degrees=True)
    return turn.expand(CANONICAL.joints, 3, 3)


def apart(found: Motion, wanted: Motion) -> float:
    """Largest distance in centimetres of two points."""
    return float(100 * (found.positions() - wanted.positions()).norm(dim=-1).max())


@given(FACING)
@settings(max_examples=8, deadline=None)
def test_a_standing_rest_pose_may_face_anywhere(degrees):
    other = redrawn(GAITS["walk_1.3"][:20], about("y", degrees))
    assert upright(other.skeleton)
    assert apart(other.retarget(), GAITS["walk_1.3"][:20]) < 0.1


@given(
    st.sampled_from(sorted(GAITS)), st.sampled_from("xyz"), FACING, FACING, st.integers(0, 1 << 30)
)
@settings(max_examples=12, deadline=None)
def test_rest_poses_and_axes_of_any_kind_give_the_same_body(name, axis, degrees, facing, seed):
    """All joints turned alike is a rest pose that lies or hangs; each at random is none at all."""
    motion = GAITS[name][:40]
    random = roma.random_rotmat(CANONICAL.joints, generator=torch.Generator().manual_seed(seed))
    for turn in (about(axis, degrees) @ about("y", facing), random):
        assert apart(redrawn(motion, turn).retarget(), motion) < 2.0


@pytest.mark.parametrize("frame", [0, 7, 15])
def test_a_step_is_no_stance(frame):
    """The rest pose is a frame of the walk: its lean is not taken for standing straight."""
    motion = GAITS["walk_1.3_turn_right_0.3"][:40]
    other = redrawn(motion, motion.orientations()[frame].mT)
    assert not upright(other.skeleton)
    assert apart(other.retarget(), motion) < 2.0


def test_shoulders_across_the_hips_are_no_stance():
    """Legs and trunk are straight and upright, but the rest pose is twisted in the spine."""
    motion = GAITS["walk_1.3"][:40]
    turn = about("y", 0.0).clone()
    turn[1 : CANONICAL.role("left_upper_leg")] = about("y", 50.0)[0]
    other = redrawn(motion, turn)
    assert not upright(other.skeleton)
    assert apart(other.retarget(), motion) < 2.0


def test_a_neck_that_never_is_as_at_rest_is_as_in_motion():
    motion, turn = GAITS["walk_1.3"][:40], about("y", 0.0).clone()
    turn[CANONICAL.role("neck")] = about("x", 120.0)[0]
    other = redrawn(motion, turn)
    assert upright(other.skeleton)
    assert apart(other.retarget(), motion) < 2.0


def test_where_feet_come_down_is_found_as_well():
    motion = GAITS["walk_1.3"]
    for turn in (about("y", 45.0), about("x", 90.0) @ about("y", 20.0)):
        found = redrawn(replace(motion, contacts=None), turn).retarget()
        assert apart(found, motion) < 2.0


def test_a_target_must_still_face_ahead():
    assert stands(CANONICAL)
    assert not stands(redrawn(GAITS["stand"], about("y", 45.0)).skeleton)


@pytest.mark.parametrize("turn", [("z", 90.0), ("x", 180.0)], ids=["on the side", "handstand"])
def test_a_clip_that_is_never_upright_says_so_and_a_reference_helps(turn):
    motion, lying = GAITS["stand"][:30], about("x", 90.0)
    world = about(*turn)[0]
    down = replace(
        motion,
        contacts=None,
        root_positions=motion.root_positions @ world.mT,
        rotations=torch.cat([world @ motion.rotations[:, :1], motion.rotations[:, 1:]], 1),
    )
    with pytest.warns(UserWarning, match=r"another up=.*reference=.*upright in hardly any"):
        guessed = redrawn(down, lying).retarget()
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        told = redrawn(down, lying).retarget(reference=redrawn(motion, lying))
        redrawn(motion, lying).retarget()
    for found in (guessed, told):
        for part in ("upper_leg", "upper_arm"):
            lines = []
            for each in (found, down):
                left, right = (each.skeleton.role(f"{side}_{part}") for side in ("left", "right"))
                points = each.positions()
                lines.append(points[:, left] - points[:, right])
            cosine = torch.cosine_similarity(*lines, dim=-1)
            assert torch.rad2deg(cosine.clamp(-1, 1).acos()).max() < 6.0


def test_the_same_body_under_other_names_is_not_changed():
    motion = GAITS["run_3.0"]
    other = redrawn(motion, about("y", 0.0), "joint")
    found = other.retarget()
    assert found.skeleton is CANONICAL
    assert torch.equal(found.rotations, motion.rotations)
    assert torch.equal(found.root_positions, motion.root_positions)


def trunk(motion: Motion) -> torch.Tensor:
    """Unit vectors (frames, 3) from between the hip joints to between the shoulders."""
    points, roles = motion.positions(), motion.skeleton.roles
    both = lambda part: sum(points[:, roles[f"{side}_{part}"]] for side in ("left", "right"))
    return torch.nn.functional.normalize(both("upper_arm") - both("upper_leg"), dim=-1)


def test_hips_may_lie_before_the_spine():
    """Where the bone from the hips goes backwards, as in accad's rig, it does not tell what is up."""
    s, walk = Skeleton.canonical(), gaits.make(seconds=3, speed=1.2)
    offsets, behind = s.offsets.clone(), torch.tensor([0.0, -0.14, -0.09])
    offsets[s.index("Spine")] += behind
    offsets[s.index("Chest")] -= behind
    walk = replace(walk, skeleton=replace(s, offsets=offsets))
    for seed in range(3):
        axes = roma.random_rotmat(21, generator=torch.Generator().manual_seed(seed))
        rig = redrawn(walk, axes)
        assert not upright(rig.skeleton)
        off = torch.rad2deg(torch.arccos((trunk(rig.retarget()) * trunk(rig)).sum(-1).clamp(-1, 1)))
        assert off.median() < 10


def test_a_target_s_trunk_may_end_at_the_chest():
    """No neck and no tip of a head hang there, of which a bone could be told."""
    s = Skeleton.canonical()
    names = [f"part{i}" if name in ("Neck", "Head") else name for i, name in enumerate(s.names)]
    kept = [i for i, joint in enumerate(s.end_parents) if s.names[joint] != "Head"]
    bare = replace(
        s, names=names, offsets=1.1 * s.offsets,
        end_parents=[s.end_parents[i] for i in kept], end_offsets=s.end_offsets[kept],
    )  # fmt: skip
    walk = gaits.make(seconds=1, speed=1.2)
    axes = roma.random_rotmat(21, generator=torch.Generator().manual_seed(0))
    found = redrawn(walk, axes).retarget(bare)
    assert torch.rad2deg(torch.arccos((trunk(found) * trunk(walk)).sum(-1).clamp(-1, 1))).max() < 5


@pytest.mark.parametrize("degrees", [90, 60, 20, -60])
@pytest.mark.parametrize("name", ["run_3.0", "walk_1.3"])
def test_elbows_bend_whatever_way_the_arms_of_the_target_rest(name, degrees):
    """A right angle is arms that hang: there a T-pose's elbow axis lies along the bone."""
    motion, s = GAITS[name], CANONICAL
    offsets, ends = s.offsets.clone(), s.end_offsets.clone()
    for side, sign in (("left", -1), ("right", 1)):
        turn = roma.rotvec_to_rotmat(torch.tensor([0.0, 0.0, sign * degrees * torch.pi / 180]))
        below = [s.roles[f"{side}_{part}"] for part in ("lower_arm", "hand")]
        offsets[below] = offsets[below] @ turn.mT
        hands = [i for i, parent in enumerate(s.end_parents) if parent == below[1]]
        ends[hands] = ends[hands] @ turn.mT
    target = replace(s, offsets=offsets, end_offsets=ends)
    found, usual = motion.retarget(target), motion.retarget(CANONICAL)
    assert apart(found, usual) < 0.5
