"""What features don't see, what they mirror, and what they say of hands and feet."""

from __future__ import annotations

import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from motionlab import contacts
from motionlab.encodings import BodyFrame, JointAngles, RootRelative
from motionlab.encodings.path import turned
from motionlab.kinematics import heading, yaw_matrix

INVARIANT = {
    "vector": lambda s: JointAngles(s, contacts=True),
    "euler": lambda s: JointAngles(s, rotation="euler"),
    "6d": lambda s: JointAngles(s, rotation="6d"),
    "body-frame": BodyFrame,
}
GROUND = dict(yaw=st.floats(-7, 7), x=st.floats(-9, 9), z=st.floats(-9, 9))


@settings(max_examples=15, deadline=None)
@given(**GROUND)
@pytest.mark.parametrize("kind", INVARIANT)
def test_invariant_to_turns_and_places(gait, move, kind, yaw, x, z):
    encoding = INVARIANT[kind](gait.skeleton)
    difference = encoding.encode(move(gait, yaw, x, z)) - encoding.encode(gait)
    tolerance = 3e-6 * (
        30 if kind == "body-frame" else 1
    )  # velocities are a second's, not a frame's
    assert difference.abs().max() < tolerance


@settings(max_examples=15, deadline=None)
@given(**GROUND)
def test_root_relative_turns_with_the_motion(gait, move, yaw, x, z):
    encoding = RootRelative(gait.skeleton)
    features = encoding.encode(gait).unflatten(-1, (-1, 3))
    expected = turned(features, torch.tensor(yaw)).flatten(1)
    torch.testing.assert_close(encoding.encode(move(gait, yaw, x, z)), expected, rtol=0, atol=3e-6)


def test_mirrored_twice_is_the_identity(make, gait):
    encoding = make(gait.skeleton)
    assert torch.equal(encoding.encode(gait.mirror().mirror()), encoding.encode(gait))


def test_points_of_mirrored_features_are_mirrored(make, gait):
    encoding = make(gait.skeleton)
    mirrored = gait.mirror()
    points = encoding.positions(encoding.encode(mirrored), encoding.start_of(mirrored))
    expected = mirrored.positions()[:, : encoding.points]
    torch.testing.assert_close(points, expected, rtol=0, atol=1e-5)


def test_mirrored_joint_angles_are_joint_angles_with_signs(gait):
    """The committed mean pose is symmetric, so a mirror only swaps sides and turns signs."""
    encoding = JointAngles(gait.skeleton, contacts=True)
    features = encoding.encode(gait)
    root = features[:, :6] * torch.tensor([-1.0, 1, -1, 1, 1, -1])
    partners = [p - 1 for p in gait.skeleton.mirror_partners[1:]]
    joints = features[:, 6:66].unflatten(-1, (-1, 3))[:, partners] * torch.tensor([1.0, -1, -1])
    expected = torch.cat([root, joints.flatten(1), features[:, [67, 66]]], dim=1)
    torch.testing.assert_close(encoding.encode(gait.mirror()), expected, rtol=0, atol=2e-5)


# -- end effectors ---------------------------------------------------------------------------------


def effectors_by_loop(motion, joints):
    """Frame by frame from the points of the motion in the world."""
    points = motion.positions().double().numpy()
    yaw = heading(motion.rotations[:, 0].double())
    rows = []
    for t in range(len(motion)):
        into = yaw_matrix(yaw[t]).numpy().T
        ground = points[t, 0] * [1, 0, 1]
        u = max(t, 1)
        into_u = yaw_matrix(yaw[u]).numpy().T
        rows.append([
            np.concatenate(
                [into @ (points[t, j] - ground), motion.fps * into_u @ (points[u, j] - points[u - 1, j])]
            )
            for j in joints
        ])  # fmt: skip
    return np.array(rows)


def test_end_effectors_of_a_gait(make, gait):
    encoding = make(gait.skeleton)
    roles = ("left_toes", "right_toes", "left_hand", "right_hand", "head")
    assert encoding.effector_names == roles
    found = encoding.end_effectors(encoding.encode(gait)).numpy()
    expected = effectors_by_loop(gait, [gait.skeleton.index(role) for role in roles])
    if "dy" in encoding.feature_names:  # the height is not in the features: up to a constant
        found[..., 1] += (expected[..., 1] - found[..., 1]).mean()
    np.testing.assert_allclose(found[..., :3], expected[..., :3], atol=1e-5)
    # the loop subtracts float32 points some 10 m from the origin: 1 µm, times 30 a second
    np.testing.assert_allclose(found[..., 3:], expected[..., 3:], atol=2e-4)


@pytest.mark.parametrize("special", ["random", "gimbal"])
def test_end_effectors_of_wild_motions(make, wild, special):
    motion = wild(5, special, frames=20)
    encoding = make(motion.skeleton)
    joints = [motion.skeleton.index(role) for role in encoding.effector_names]
    found = encoding.end_effectors(encoding.encode(motion)).numpy()
    expected = effectors_by_loop(motion, joints)
    if "dy" in encoding.feature_names:
        found[..., 1] += expected[:1, :1, 1] - found[:1, :1, 1]
    np.testing.assert_allclose(found[..., :3], expected[..., :3], atol=1e-4)
    np.testing.assert_allclose(found[..., 3:], expected[..., 3:], atol=5e-3)


def test_end_effectors_of_a_part_are_part_of_the_whole(make, gait):
    """No sum over the frames: any window of features will do (row 0's velocity aside)."""
    encoding = make(gait.skeleton)
    if "dy" in encoding.feature_names:
        return  # heights are summed up there
    features = encoding.encode(gait)
    whole, part = encoding.end_effectors(features), encoding.end_effectors(features[60:90])
    torch.testing.assert_close(part[1:], whole[61:90], rtol=0, atol=1e-6)
    assert torch.equal(part[0, :, 3:], part[1, :, 3:])


def test_a_standing_toe_has_no_velocity(gait):
    encoding = BodyFrame(gait.skeleton)
    velocity = encoding.end_effectors(encoding.encode(gait))[..., 3:].norm(dim=-1)
    for effector, channel in ((0, 1), (1, 3)):
        rests = gait.contacts[1:, channel] & gait.contacts[:-1, channel]
        assert rests.sum() > 20 and velocity[1:, effector][rests].max() < 2e-3


def test_encodings_agree_on_the_end_effectors_of_real_skeletons(real_motions):
    """Points tell RootRelative which way the root faces, rotations the others: the same way."""
    for source, motions in real_motions.items():
        motion = motions[0][:60]
        # of the hips, no other joint of the skeleton of `cmu` keeps its place: spine and legs hang
        # on joints that turn in the same spot, so points know the heading to some degrees only
        kinds = (JointAngles, BodyFrame) + (RootRelative,) * (source != "cmu")
        encodings = [kind(motion.skeleton, motion.fps) for kind in kinds]
        first, *others = [e.end_effectors(e.encode(motion)) for e in encodings]
        for other in others:
            torch.testing.assert_close(first, other, rtol=0, atol=2e-3, msg=motion.name)


# -- contacts --------------------------------------------------------------------------------------


def test_contacts_are_those_of_the_motion_or_found(gait):
    body, joints = BodyFrame(gait.skeleton), JointAngles(gait.skeleton, contacts=True)
    assert torch.equal(body.contacts(body.encode(gait)), gait.contacts.float())
    assert torch.equal(joints.contacts(joints.encode(gait)), gait.contacts[:, [1, 3]].float())
    bare = type(gait)(gait.skeleton, gait.root_positions, gait.rotations, gait.fps)
    assert torch.equal(body.contacts(body.encode(bare)), contacts.label(bare).float())
    for without in (
        RootRelative(gait.skeleton),
        JointAngles(gait.skeleton),
        BodyFrame(gait.skeleton, contacts=False),
    ):
        assert without.contacts(without.encode(gait)) is None
        assert "contacts" not in without.slices


def test_names_and_slices_cover_every_channel(make, gait):
    encoding = make(gait.skeleton)
    assert len(encoding.feature_names) == len(set(encoding.feature_names)) == encoding.dim
    covered = sorted(i for s in encoding.slices.values() for i in range(encoding.dim)[s])
    assert covered == list(range(encoding.dim))
    assert encoding.point_names == gait.skeleton.point_names[: encoding.points]
    assert encoding.encode(gait).shape == (len(gait), encoding.dim)
