"""Skeletons: what they refuse, what they know about their joints' names."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
import torch

from motionlab import Skeleton
from motionlab.errors import SkeletonError

ACCAD = (
    "Hips ToSpine Spine Spine1 Neck Head LeftShoulder LeftArm LeftForeArm LeftHand RightShoulder "
    "RightArm RightForeArm RightHand LeftUpLeg LeftLeg LeftFoot LeftToeBase RightUpLeg RightLeg "
    "RightFoot RightToeBase",
    "-1 0 1 2 3 4 3 6 7 8 3 10 11 12 0 14 15 16 0 18 19 20",
)
ACLSTM = (
    "hip abdomen chest neck head leftEye rightEye rCollar rShldr rForeArm rHand lCollar lShldr "
    "lForeArm lHand rButtock rThigh rShin rFoot lButtock lThigh lShin lFoot",
    "-1 0 1 2 3 4 4 2 7 8 9 2 11 12 13 0 15 16 17 0 19 20 21",
)
CMU = (
    "Hips LHipJoint LeftUpLeg LeftLeg LeftFoot LeftToeBase RHipJoint RightUpLeg RightLeg RightFoot "
    "RightToeBase LowerBack Spine Spine1 Neck Neck1 Head LeftShoulder LeftArm LeftForeArm LeftHand "
    "LeftFingerBase LeftHandIndex1 LThumb RightShoulder RightArm RightForeArm RightHand "
    "RightFingerBase RightHandIndex1 RThumb",
    "-1 0 1 2 3 4 0 6 7 8 9 0 11 12 13 14 15 13 17 18 19 20 21 20 13 24 25 26 27 28 27",
)
BANDAI = (
    "Hips Spine Chest Neck Head Shoulder_L UpperArm_L LowerArm_L Hand_L Shoulder_R UpperArm_R "
    "LowerArm_R Hand_R UpperLeg_L LowerLeg_L Foot_L Toes_L UpperLeg_R LowerLeg_R Foot_R Toes_R",
    "-1 0 1 2 3 2 5 6 7 2 9 10 11 0 13 14 15 0 17 18 19",
)
MIXAMO = (
    " ".join(
        f"mixamorig:{name}"
        for name in "Hips Spine Spine1 Spine2 Neck Head LeftShoulder LeftArm LeftForeArm LeftHand "
        "RightShoulder RightArm RightForeArm RightHand LeftUpLeg LeftLeg LeftFoot LeftToeBase "
        "RightUpLeg RightLeg RightFoot RightToeBase".split()
    ),
    "-1 0 1 2 3 4 3 6 7 8 3 10 11 12 0 14 15 16 0 18 19 20",
)
SKELETONS = {"accad": ACCAD, "aclstm": ACLSTM, "cmu": CMU, "bandai": BANDAI, "mixamo": MIXAMO}
SIDED = "shoulder upper_arm lower_arm hand upper_leg lower_leg foot toes".split()
ROLES = {"hips", "spine", "chest", "neck", "head"} | {
    f"{side}_{part}" for side in ("left", "right") for part in SIDED
}


def named(source: str) -> Skeleton:
    names, parents = (text.split() for text in SKELETONS[source])
    return Skeleton(tuple(names), tuple(map(int, parents)), torch.ones(len(names), 3))


@pytest.mark.parametrize("source", SKELETONS)
def test_roles(source):
    skeleton = named(source)
    absent = {"left_toes", "right_toes"} if source == "aclstm" else set()
    assert skeleton.roles.keys() == ROLES - absent
    name = {role: skeleton.names[joint].lower() for role, joint in skeleton.roles.items()}
    for role, called in name.items():
        if role.startswith(("left", "right")):
            assert skeleton.roles[role] != skeleton.roles[_other(role)]
            initial = role[0]
            assert role.split("_")[0] in called or called[0] == initial or called[-1] == initial
    assert skeleton.roles["hips"] == 0 and "hip" in name["hips"]
    assert "head" in name["head"] and "neck" in name["neck"] and "foot" in name["left_foot"]
    # up the arm and up the leg
    for child, parent in [
        ("hand", "lower_arm"), ("lower_arm", "upper_arm"), ("upper_arm", "shoulder"),
        ("foot", "lower_leg"), ("lower_leg", "upper_leg"),
    ]:  # fmt: skip
        assert skeleton.parents[skeleton.roles[f"left_{child}"]] == skeleton.roles[f"left_{parent}"]
    assert skeleton.parents[skeleton.roles["left_shoulder"]] == skeleton.roles["chest"]


def _other(role: str) -> str:
    side, part = role.split("_", 1)
    return {"left": "right_", "right": "left_"}[side] + part


@pytest.mark.parametrize("source", SKELETONS)
def test_mirror_partners(source):
    skeleton = named(source)
    partners = skeleton.mirror_partners
    assert [partners[p] for p in partners] == list(range(skeleton.joints))
    crossed = {joint for joint, partner in enumerate(partners) if joint != partner}
    for joint in crossed:
        name, other = skeleton.names[joint], skeleton.names[partners[joint]]
        initials = {"l": "r", "r": "l", "L": "R", "R": "L"}
        swapped = {
            name.replace("Left", "?").replace("Right", "Left").replace("?", "Right"),
            name.replace("left", "?").replace("right", "left").replace("?", "right"),
            initials.get(name[0], "") + name[1:],
            name[:-1] + initials.get(name[-1], ""),
        } - {name}
        assert other in swapped
    central = {"accad": 6, "aclstm": 5, "cmu": 7, "bandai": 5, "mixamo": 6}[source]
    assert skeleton.joints - len(crossed) == central


def test_names_that_read_alike_keep_mirroring_twice_harmless():
    skeleton = Skeleton(
        ("Spine", "spine_", "LeftArm", "lArm", "RightArm"), (-1, 0, 0, 0, 0), torch.zeros(5, 3)
    )
    assert skeleton.mirror_partners == (0, 1, 4, 3, 2)


def test_canonical():
    skeleton = Skeleton.canonical()
    assert skeleton.joints == 21 and skeleton.points == 26
    assert skeleton.roles.keys() == ROLES
    assert skeleton.matches(skeleton.mirrored())
    assert skeleton.index("LeftFoot") == skeleton.index("left_foot")
    assert len(set(skeleton.point_names)) == 26
    for point, parent in enumerate(skeleton.point_parents[1:], start=1):
        assert 0 <= parent < point


def test_index_of_an_absent_joint():
    with pytest.raises(SkeletonError, match="no joint or role 'tail'.*Hips.*left_foot"):
        Skeleton.canonical().index("tail")


def test_a_joint_may_be_called_as_a_role_of_another():
    names = ("pelvis", "left_hip", "left_knee", "left_ankle", "left_foot")
    skeleton = Skeleton(names, (-1, 0, 1, 2, 3), torch.zeros(5, 3))
    assert (skeleton.index("left_foot"), skeleton.role("left_foot")) == (4, 3)
    with pytest.raises(SkeletonError, match="no joint or role 'left_knee'"):
        skeleton.role("left_knee")


def test_mirrored_twice_is_the_same():
    skeleton = Skeleton(
        ("Hips", "LeftArm", "RightArm", "Tail"), (-1, 0, 0, 0), torch.randn(4, 3),
        (1, 2, 3, 3, 1, 2), torch.randn(6, 3),
    )  # fmt: skip
    again = skeleton.mirrored().mirrored()
    assert torch.equal(again.offsets, skeleton.offsets)
    assert torch.equal(again.end_offsets, skeleton.end_offsets)
    assert torch.equal(
        skeleton.mirrored().end_offsets,
        skeleton.end_offsets[[1, 0, 2, 3, 5, 4]] * torch.tensor([-1, 1, 1]),
    )


@pytest.mark.parametrize(
    "change, words",
    [
        (dict(names=(), parents=(), offsets=[]), "at least one joint"),
        (dict(names=("a", "b", "a")), "'a'"),
        (dict(names=("a", "", "c")), "needs a name"),
        (dict(names=("a", 3, "c")), "list of words"),
        (dict(names=None), "`names` is None"),
        (dict(names="abc"), "list of words"),
        (dict(names=("a", "b")), "one of each"),
        (dict(parents=(-1, 0)), "one of each"),
        (dict(parents=(-1, 2, 1)), "after its parent"),
        (dict(parents=(-1, 1, 0)), "after its parent"),
        (dict(parents=(0, 0, 0)), "root"),
        (dict(parents=(-1, -1, 0)), "root"),
        (dict(parents=(-1, 0, 7)), "after its parent"),
        (dict(parents=(-1, 0, 0.5)), "whole numbers"),
        (dict(parents=None), "whole numbers"),
        (dict(offsets=torch.zeros(3, 2)), r"\(n, 3\)"),
        (dict(offsets=torch.zeros(9)), r"\(n, 3\)"),
        (dict(offsets=torch.zeros(2, 3)), "one of each"),
        (dict(offsets="far"), r"\(n, 3\)"),
        (dict(offsets=[[1, 2, 3], [4, 5], [6]]), r"\(n, 3\)"),
        (dict(offsets=torch.full((3, 3), float("nan"))), "NaN"),
        (dict(end_parents=(0,)), "end site"),
        (dict(end_parents=(5,), end_offsets=torch.zeros(1, 3)), "not there"),
        (dict(end_parents=(-1,), end_offsets=torch.zeros(1, 3)), "not there"),
        (dict(end_parents=(0,), end_offsets=torch.full((1, 3), float("inf"))), "infinite"),
        (dict(rotation_orders=None), "`rotation_orders`"),
        (dict(rotation_orders=(1, 2, 3)), "`rotation_orders`"),
        (dict(rotation_orders=("XYZ",)), "one of each"),
        (dict(rotation_orders=("XYZ", "XYX", "ZYX")), "'XYX'"),
        (dict(rotation_orders=("XYZ", "xyz", "ZYX")), "'xyz'"),
    ],
)
def test_refused(change, words):
    good = dict(names=("a", "b", "c"), parents=(-1, 0, 1), offsets=torch.zeros(3, 3))
    Skeleton(**good)
    with pytest.raises(SkeletonError, match=words):
        Skeleton(**{**good, **change})


def test_an_array_given_may_be_written_to_afterwards():
    offsets = np.zeros((2, 3), dtype=np.float32)
    skeleton = Skeleton(("a", "b"), (-1, 0), offsets, (1,), offsets[1:])
    offsets[1] = 5
    assert skeleton.offsets.abs().max() == skeleton.end_offsets.abs().max() == 0


def test_frozen():
    with pytest.raises(dataclasses.FrozenInstanceError):
        Skeleton.canonical().names = ("a",)


def test_capital_names_that_start_with_r_or_l_are_not_sides():
    skeleton = Skeleton(("ROOT", "SPINE", "LThigh"), (-1, 0, 0), torch.rand(3, 3))
    assert skeleton.roles == {"hips": 0, "spine": 1, "left_upper_leg": 2}
