"""Decoding as models and solvers use it: batched, differentiable, in any precision; bad input."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import torch

from motionlab import Motion, Skeleton, encodings
from motionlab.encodings import BodyFrame, JointAngles, RootRelative
from motionlab.errors import EncodingError


def small(motion: Motion) -> Motion:
    """A leg, an arm and a head's worth of body, so that finite differences are quick."""
    keep = ["Hips", "Spine", "Head", "LeftHand", "RightHand", "LeftUpperLeg", "RightUpperLeg"]
    keep += ["LeftFoot", "RightFoot"]
    parents = [-1, 0, 1, 1, 1, 0, 0, 5, 6]
    joints = [motion.skeleton.index(name) for name in keep]
    skeleton = Skeleton(
        tuple(keep),
        tuple(parents),
        motion.skeleton.offsets[joints],
        (2,),
        torch.tensor([[0.0, 0.2, 0.0]]),
        tuple(motion.skeleton.rotation_orders[joint] for joint in joints),
    )
    return replace(motion, skeleton=skeleton, rotations=motion.rotations[:, joints])


@pytest.mark.parametrize("points", [[], [0], [16, 20], [3, 24, 5], range(26)])
def test_some_points_are_those_of_the_whole_body(gait, points):
    encoding = JointAngles(gait.skeleton)
    features, start = encoding.encode(gait)[:9].unflatten(0, (3, 3)), (1.0, 2.0, 3.0)
    found = encoding.positions(features, start, points)
    whole = encoding.positions(features, start)
    assert found.shape == whole.shape
    torch.testing.assert_close(found[..., [*points], :], whole[..., [*points], :])
    known = found.isfinite().all(-1).flatten(0, 1)
    assert bool(known[:, [*points]].all()) and bool((known == known[0]).all())
    assert known[0].all() == (len(points) == 26)


@pytest.mark.parametrize("special", ["random", "zero", "facing backwards"])
def test_gradients_against_finite_differences(make, wild, special):
    motion = small(wild(2, special, frames=3))
    encoding = make(motion.skeleton)
    features = encoding.encode(motion).double().requires_grad_()
    start = torch.tensor([1.0, -2.0, 0.5], dtype=torch.float64, requires_grad=True)
    assert torch.autograd.gradcheck(encoding.positions, (features, start), fast_mode=True)
    assert torch.autograd.gradcheck(encoding.end_effectors, features, fast_mode=True)


def test_batch_is_as_one_after_the_other(make, gait):
    encoding = make(gait.skeleton)
    features = encoding.encode(gait)[:180].unflatten(0, (2, 3, 30))
    starts = torch.randn(2, 3, 3, generator=torch.Generator().manual_seed(1))
    points = encoding.positions(features, starts)
    apart = encoding.positions(features, (starts[..., 0], starts[..., 1], starts[..., 2]))
    one_place = encoding.positions(features, (1.0, torch.tensor(2.0), 3))
    effectors = encoding.end_effectors(features)
    assert points.shape == (2, 3, 30, encoding.points, 3)
    assert effectors.shape == (2, 3, 30, 5, 6)
    for i in np.ndindex(2, 3):
        same = dict(rtol=0, atol=1e-6)
        torch.testing.assert_close(points[i], encoding.positions(features[i], starts[i]), **same)
        torch.testing.assert_close(apart[i], points[i], **same)
        there = encoding.positions(features[i], (1.0, 2.0, 3.0))
        torch.testing.assert_close(one_place[i], there, **same)
        torch.testing.assert_close(effectors[i], encoding.end_effectors(features[i]), **same)
    assert encoding.positions(features[:0]).shape == (0, 3, 30, encoding.points, 3)


@pytest.mark.parametrize("dtype", [torch.float64, torch.float32, torch.bfloat16])
def test_precision_is_that_of_the_features(make, gait, dtype):
    encoding = make(gait.skeleton)
    features = encoding.encode(gait)
    expected = encoding.positions(features, encoding.start_of(gait))
    points = encoding.positions(features.to(dtype), encoding.start_of(gait))
    assert points.dtype == encoding.end_effectors(features.to(dtype)).dtype == dtype
    tolerance = 0.2 if dtype == torch.bfloat16 else 1e-5
    torch.testing.assert_close(points.to(expected), expected, rtol=0, atol=tolerance)


def test_numbers_from_a_network_decode_to_a_body(make):
    """Any finite numbers do: rotations are rotations, gradients finite."""
    encoding = make(Skeleton.canonical())
    generator = torch.Generator().manual_seed(0)
    for scale in (0.0, 1e-8, 1.0, 30.0):
        features = (scale * torch.randn(4, 8, encoding.dim, generator=generator)).requires_grad_()
        points, effectors = encoding.positions(features), encoding.end_effectors(features)
        (points.sum() + effectors.sum()).backward()
        assert points.isfinite().all() and features.grad.isfinite().all()
        if isinstance(encoding, JointAngles):
            rotations = encoding.rotations(features)[1].detach()
            eye = torch.eye(3).expand_as(rotations)
            if scale > 1e-6 or encoding.rotation != "6d":  # six zeros are no rotation
                torch.testing.assert_close(rotations @ rotations.mT, eye, rtol=0, atol=1e-4)


def test_sampling_first_does_not_spoil_training(make, gait):
    with torch.inference_mode():
        encoding = make(gait.skeleton)
        features = encoding.encode(gait)[:4]
        encoding.positions(features), encoding.end_effectors(features)
    features = features.clone().requires_grad_()
    (encoding.positions(features).sum() + encoding.end_effectors(features).sum()).backward()
    assert features.grad.abs().sum() > 0


@pytest.mark.parametrize("dtype", [torch.float32, torch.float64])
def test_a_body_met_while_sampling_serves_in_training(make, gait, dtype):
    """Skeleton, mean pose and encoding, all made in inference mode."""
    with torch.inference_mode():
        s = gait.skeleton
        body = replace(s, names=("Pelvis", *s.names[1:]), offsets=1.1 * s.offsets)
        encoding = encodings.from_config(make(body).config())
        features = encoding.encode(replace(gait, skeleton=body))[:4]
    features = features.clone().to(dtype).requires_grad_()
    (encoding.positions(features).sum() + encoding.end_effectors(features).sum()).backward()
    assert features.grad.abs().sum() > 0


def test_input_is_left_alone(make, gait):
    encoding = make(gait.skeleton)
    rotations, places = gait.rotations.clone(), gait.root_positions.clone()
    features = encoding.encode(gait)
    before = features.clone()
    encoding.positions(features).zero_(), encoding.end_effectors(features).zero_()
    assert torch.equal(features, before)
    assert torch.equal(gait.rotations, rotations) and torch.equal(gait.root_positions, places)


# -- bad input -------------------------------------------------------------------------------------


def test_wrong_motions(make, gait):
    encoding = make(gait.skeleton)
    with pytest.raises(EncodingError, match="frame rate.*resample"):
        encoding.encode(gait[::2])
    with pytest.raises(EncodingError, match="9 joints|21 and 9.*retarget"):
        encoding.encode(small(gait))
    with pytest.raises(EncodingError, match="no frames"):
        encoding.encode(gait[:0])
    with pytest.raises(EncodingError, match="takes a Motion"):
        encoding.encode(gait.root_positions)
    with pytest.raises(EncodingError, match="no frames"):
        encoding.start_of(gait[:0])


@pytest.mark.parametrize("method", ["positions", "end_effectors", "to_motion"])
def test_wrong_features(make, gait, method):
    encoding = make(gait.skeleton)
    decode, good = getattr(encoding, method), encoding.encode(gait)[:5]
    with pytest.raises(EncodingError, match=rf"needs \(.*frames, {encoding.dim}\)"):
        decode(good[:, 1:])
    with pytest.raises(EncodingError, match="needs"):
        decode(good[0])
    with pytest.raises(EncodingError, match="no frames"):
        decode(good[:0])
    with pytest.raises(EncodingError, match="floating-point"):
        decode(good.long())
    with pytest.raises(EncodingError, match="must be an array"):
        decode("walk")
    for bad in (torch.nan, torch.inf):
        broken = good.clone()
        broken[3, 7] = bad
        with pytest.raises(EncodingError, match="NaN or infinite value in frame 3"):
            decode(broken)
    if method == "to_motion":
        with pytest.raises(EncodingError, match=r"needs \(frames"):
            decode(good[None])
    if "contacts" in encoding.slices:
        with pytest.raises(EncodingError, match="needs"):
            encoding.contacts(good[:, 1:])


@pytest.mark.parametrize(
    "start",
    [(1.0, 2.0), 3.0, (0.0, 0.0, torch.nan), torch.zeros(2, 3), torch.zeros(4), "here",
     (0.0, 0.0, "left"), (0.0,) * 5],
    ids=["two", "one", "nan", "two starts", "four", "word", "words", "five"],
)  # fmt: skip
def test_wrong_starts(make, gait, start):
    encoding = make(gait.skeleton)
    if "dy" in encoding.feature_names and getattr(start, "shape", None) == (4,):
        return  # the height of frame 0 may be given there
    with pytest.raises(EncodingError, match="start must be"):
        encoding.positions(encoding.encode(gait)[:5], start)


@pytest.mark.parametrize("fps", [0, -30, torch.nan, "fast", None])
@pytest.mark.parametrize("kind", [JointAngles, RootRelative, BodyFrame])
def test_wrong_rates(kind, fps):
    with pytest.raises(EncodingError, match="frames per second"):
        kind(Skeleton.canonical(), fps)


def test_wrong_settings(real_motions):
    skeleton = Skeleton.canonical()
    for kind in (JointAngles, RootRelative, BodyFrame):
        with pytest.raises(EncodingError, match=f"{kind.__name__} is made from a Skeleton"):
            kind("canonical")
    for rotation in ("quaternion", ["6d"], None):
        with pytest.raises(EncodingError, match="'vector', 'euler', '6d'"):
            JointAngles(skeleton, rotation=rotation)
    mirrored = torch.diag(torch.tensor([-1.0, 1, 1])).expand(21, 3, 3)
    for pose in (torch.eye(3), torch.zeros(21, 3, 3), mirrored, "T"):
        with pytest.raises(EncodingError, match="mean_pose"):
            JointAngles(skeleton, mean_pose=pose)
    with pytest.raises(EncodingError, match="'absolute', 'difference'"):
        RootRelative(skeleton, height="low")
    for stature in (0, -1.54, torch.inf, torch.nan, "tall"):
        with pytest.raises(EncodingError, match="stature"):
            RootRelative(skeleton, stature=stature)
    lying = real_motions["bandai-locomotion"][0].skeleton  # all bones along one axis at rest
    with pytest.raises(EncodingError, match="does not stand"):
        RootRelative(lying, stature=1.54)


def test_wrong_configs():
    config = JointAngles(Skeleton.canonical()).config()
    for bad in ({}, {**config, "encoding": "Positions"}, {**config, "speed": 1}, 3, None):
        with pytest.raises(EncodingError, match="config"):
            encodings.from_config(bad)


def test_skeletons_without_hands_or_hips():
    rod = Skeleton(("a", "b"), (-1, 0), torch.tensor([[0.0, 0, 0], [0, 1, 0]]))
    motion = Motion(rod, torch.zeros(4, 3), torch.eye(3).expand(4, 2, 3, 3), 30)
    for encoding in (JointAngles(rod), RootRelative(rod), BodyFrame(rod, contacts=False)):
        features = encoding.encode(motion)
        assert torch.equal(encoding.positions(features), motion.positions())
        with pytest.raises(EncodingError, match="left foot.*Joints: a, b"):
            encoding.end_effectors(features)


def test_feet_stand_in_for_missing_toes(gait):
    motion = small(gait)
    encoding = JointAngles(motion.skeleton)
    assert encoding.effector_names[:2] == ("left_foot", "right_foot")
    assert encoding.end_effectors(encoding.encode(motion)).shape == (len(gait), 5, 6)
