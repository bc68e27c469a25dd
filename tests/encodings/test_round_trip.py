"""Motion to features and back: nothing is lost, wherever the motion goes."""

from __future__ import annotations

import json
from dataclasses import replace
from importlib.resources import files
from pathlib import Path

import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st
from other_rigs import random_axes, redrawn, sitting

from motionlab import Motion, Skeleton, concatenate, datasets, encodings
from motionlab.encodings import BodyFrame, JointAngles, RootRelative
from motionlab.kinematics import heading

SPECIAL = [
    "random",
    "zero",
    "tiny",
    "half turn",
    "nearly half a turn",
    "gimbal",
    "facing backwards",
]


def farthest(encoding, motion: Motion) -> float:
    """Largest distance in metres between the points of a motion and what its features say."""
    points = encoding.positions(encoding.encode(motion), encoding.start_of(motion))
    assert points.dtype == torch.float32
    return float((points - motion.positions()[:, : encoding.points]).norm(dim=-1).max())


@settings(max_examples=8, deadline=None)
@given(seed=st.integers(0, 2**32))
@pytest.mark.parametrize("special", SPECIAL)
def test_made_motions(make, wild, special, seed):
    motion = wild(seed, special)
    assert farthest(make(motion.skeleton), motion) < 1e-4


def test_real_clips(make, real_motions):
    for motion in (m for motions in real_motions.values() for m in motions):
        try:
            encoding = make(motion.skeleton, motion.fps)
        except encodings.EncodingError as error:
            assert "does not stand" in str(error)  # so it has no stature to scale by
            continue
        assert farthest(encoding, motion) < 1e-4, motion.name


def test_ten_thousand_frames_do_not_drift(make, long_gait):
    assert len(long_gait) > 10_000
    assert farthest(make(long_gait.skeleton), long_gait) < 1e-3


def test_ten_thousand_real_frames_do_not_drift(make, real_motions):
    clip = real_motions["aclstm-cmu"][0]
    motion = concatenate([clip] * 50)
    assert len(motion) == 10_000
    assert farthest(make(motion.skeleton, motion.fps), motion) < 1e-3


def test_a_single_frame_has_made_no_step(make, gait):
    encoding = make(gait.skeleton)
    assert farthest(encoding, gait[50:51]) < 1e-5
    features = encoding.encode(gait[50:51])
    steps = [i for i, name in enumerate(encoding.feature_names) if name[0] in "dv" and i != 1]
    assert steps and features[:, steps[:1]].abs().max() == 0
    velocities = encoding.end_effectors(features)[..., 3:]
    assert velocities.abs().max() == 0


def test_row_zero_repeats_the_step_of_row_one(make, gait):
    encoding = make(gait.skeleton)
    names = ("dx", "dy", "dz", "dyaw", "vx", "vz", "turn_rate")
    steps = [i for i, name in enumerate(encoding.feature_names) if name in names]
    assert len(steps) in (2, 3)
    features = encoding.encode(gait)
    assert torch.equal(features[0, steps], features[1, steps])
    assert not torch.equal(features[1, steps], features[2, steps])


def test_start_far_away_keeps_its_digits(make, gait):
    encoding = make(gait.skeleton)
    features = encoding.encode(gait).double()
    start = (1234.56789, 0.1, 0.3)
    points = encoding.positions(features, start)
    assert points[0, 0, 0].item() == pytest.approx(start[0], abs=1e-12)


def test_start_is_where_frame_zero_stands_and_faces(make, gait):
    encoding = make(gait.skeleton)
    features = encoding.encode(gait)
    here = encoding.positions(features)
    there = encoding.positions(features, start=(2.0, -1.0, torch.pi / 2))
    x, y, z = here.unbind(-1)
    expected = torch.stack([z + 2.0, y, -x - 1.0], dim=-1)  # a quarter turn to the left
    torch.testing.assert_close(there, expected, rtol=0, atol=1e-5)
    assert here[0, 0, [0, 2]].tolist() == [0, 0]


@pytest.mark.parametrize("rotation", ["vector", "6d"])
def test_joint_angles_start_facing_the_given_yaw(wild, rotation):
    motion = wild(3)
    encoding = JointAngles(motion.skeleton, rotation=rotation)
    decoded = encoding.to_motion(encoding.encode(motion), (0.0, 0.0, 0.5))
    assert float(heading(decoded.rotations[0, 0])) == pytest.approx(0.5, abs=1e-5)


@pytest.mark.parametrize("rotation", ["vector", "euler", "6d"])
def test_joint_angles_to_motion(gait, rotation):
    encoding = JointAngles(gait.skeleton, rotation=rotation, contacts=True)
    features = encoding.encode(gait)
    motion = encoding.to_motion(features, encoding.start_of(gait), "again", "made")
    assert (motion.name, motion.source, motion.fps) == ("again", "made", 30)
    torch.testing.assert_close(motion.rotations, gait.rotations, rtol=0, atol=2e-6)
    torch.testing.assert_close(motion.root_positions, gait.root_positions, rtol=0, atol=1e-5)
    assert torch.equal(motion.contacts[:, [1, 3]], gait.contacts[:, [1, 3]])
    assert not motion.contacts[:, [0, 2]].any()
    if rotation != "euler":  # where a rounding error may turn 180 degrees into -180
        torch.testing.assert_close(encoding.encode(motion), features, rtol=0, atol=1e-5)
    bare = JointAngles(gait.skeleton, rotation=rotation)
    assert bare.to_motion(features[:, :-2]).contacts is None


@pytest.mark.parametrize("kind", [RootRelative, BodyFrame])
def test_points_to_motion(kind, gait):
    encoding = kind(gait.skeleton)
    features, start = encoding.encode(gait), encoding.start_of(gait)
    motion = encoding.to_motion(features, start, "again", "made")
    assert (motion.name, motion.source, motion.fps) == ("again", "made", 30)
    missed = (motion.positions() - gait.positions())[:, : encoding.points].norm(dim=-1)
    assert missed.max() < 5e-3
    if kind is BodyFrame:
        assert torch.equal(motion.contacts, gait.contacts)
    else:
        assert motion.contacts is None


@pytest.mark.parametrize("kind", [RootRelative, BodyFrame])
def test_points_to_motion_on_real_skeletons(kind, real_motions):
    for motions in real_motions.values():
        motion = motions[1][:50]
        encoding = kind(motion.skeleton, motion.fps)
        again = encoding.to_motion(encoding.encode(motion), encoding.start_of(motion))
        missed = (again.positions() - motion.positions())[:, : encoding.points].norm(dim=-1)
        assert missed.max() < 5e-3, motion.name


@pytest.mark.parametrize("kind", [RootRelative, BodyFrame])
@pytest.mark.parametrize("axes", [sitting, random_axes])
def test_canonical_names_on_a_rig_with_other_axes_are_no_canonical_body(kind, axes, gait):
    """So nothing is known of its hinges, nor of its mean pose."""
    motion = redrawn(gait[:60], axes(gait.skeleton))
    encoding = kind(motion.skeleton)
    again = encoding.to_motion(encoding.encode(motion), encoding.start_of(motion))
    missed = (again.positions() - motion.positions())[:, : encoding.points].norm(dim=-1)
    assert missed.max() < 5e-3
    eye = torch.eye(3).double().expand(gait.skeleton.joints, 3, 3)
    assert torch.equal(JointAngles(motion.skeleton).mean_pose, eye)


def test_a_larger_body_with_the_same_axes_is_a_canonical_one():
    body = Skeleton.canonical()
    larger = replace(body, offsets=1.2 * body.offsets, end_offsets=1.2 * body.end_offsets)
    assert torch.equal(JointAngles(larger).mean_pose, JointAngles(body).mean_pose)


def test_difference_starts_from_a_height_or_from_the_rest_pose(gait):
    encoding = RootRelative(gait.skeleton, height="difference")
    features = encoding.encode(gait)
    x, z, yaw, height = encoding.start_of(gait)
    assert height == gait.root_positions[0, 1]
    standing = encoding.positions(features, (x, z, yaw)) - gait.positions()
    assert float(standing[..., 1].std()) < 1e-6  # off by the same height everywhere
    rest = Motion(gait.skeleton, torch.zeros(1, 3), torch.eye(3).expand(1, 21, 3, 3), 30)
    lowest = float(rest.positions()[..., 1].min())
    assert float(encoding.positions(features)[0, 0, 1]) == pytest.approx(-lowest, abs=1e-6)


def test_stature_scales_the_body(gait):
    plain, scaled = RootRelative(gait.skeleton), RootRelative(gait.skeleton, stature=1.54)
    factor = scaled.encode(gait) / plain.encode(gait)
    rest = Motion(gait.skeleton, torch.zeros(1, 3), torch.eye(3).expand(1, 21, 3, 3), 30)
    height = rest.positions()[..., 1]
    expected = 1.54 / float(height.max() - height.min())
    torch.testing.assert_close(factor, torch.full_like(factor, expected), rtol=1e-5, atol=0)


def test_config_builds_the_same_encoding_again(make, wild):
    motion = wild(8)
    encoding = make(motion.skeleton)
    again = encodings.from_config(json.loads(json.dumps(encoding.config())))
    assert type(again) is type(encoding) and again.config() == encoding.config()
    assert again.feature_names == encoding.feature_names
    features = encoding.encode(motion)
    assert torch.equal(again.encode(motion), features)
    assert torch.equal(again.positions(features), encoding.positions(features))


def test_given_mean_pose_is_kept(wild):
    motion = wild(1)
    encoding = JointAngles(motion.skeleton, mean_pose=motion.rotations[0])
    assert encoding.encode(motion)[0, encoding.slices["pose"]].abs().max() < 1e-3
    assert farthest(encoding, motion) < 1e-4
    again = encodings.from_config(json.loads(json.dumps(encoding.config())))
    assert torch.equal(again.mean_pose, encoding.mean_pose)


def test_seventy_three_numbers_of_which_seventy_vary(gait):
    encoding = BodyFrame(Skeleton.canonical())
    assert encoding.dim == 73 and encoding.points == 21
    dropped = set(range(73)) - set(encodings.Normalizer.fit([encoding.encode(gait)]).kept.tolist())
    assert {encoding.feature_names[i] for i in dropped} == {"root_x", "root_z", "tilt_y"}
    assert JointAngles(Skeleton.canonical(), contacts=True).dim == 68
    assert RootRelative(Skeleton.canonical()).dim == 78


def test_the_default_is_what_was_measured_best():
    """Of the ways to write a rotation with as many numbers as it has freedom."""
    path = Path(__file__).parents[2] / "results" / "encoding_rotations.json"
    rows = json.loads(path.read_text("utf-8"))["encodings"]
    smooth = {name: row for name, row in rows.items() if row["jumps"] == 0 and row["numbers"] == 66}
    assert min(smooth, key=lambda name: smooth[name]["step_error_cm"]) == "vector, mean pose"
    assert min(smooth, key=lambda name: smooth[name]["noise_error_cm"]) == "vector, mean pose"
    assert rows["euler"]["jumps"] > 0
    encoding = JointAngles(Skeleton.canonical())
    assert encoding.rotation == "vector" and encoding.dim == 66


def test_the_mean_pose_is_that_of_the_training_split():
    path = files("motionlab.encodings").joinpath("mean_pose.json")
    table = datasets.table("locomotion")
    fitted = table["source"].isin(["accad", "bandai-locomotion", "cmu"])  # all that there was then
    frames = table.frames[fitted & (table["split"] == "train")].sum()
    assert json.loads(path.read_text("utf-8"))["frames"] == 2 * frames
    encoding = JointAngles(Skeleton.canonical())
    assert not torch.equal(encoding.mean_pose, torch.eye(3).double().expand(21, 3, 3))
