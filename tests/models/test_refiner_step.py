"""One frame in numpy, or a few, against the whole motion in torch."""

import copy
import math
import warnings

import pytest
import torch

from motionlab.datasets import gaits
from motionlab.encodings import JointAngles, Normalizer
from motionlab.errors import ModelError, MotionLabError
from motionlab.models import Refiner
from motionlab.models.refiner import effector_normalizer
from motionlab.models.refiner_step import MOST, step

FRAMES = 40
KINDS = {
    "plain": {},
    "contacts": {"contacts": True},
    "tethered": {"contacts": True, "reach": 0.05, "slow": 0.1},
}


@pytest.fixture(scope="module", params=KINDS)
def world(request):
    """A refiner with weights that do something, and features (3, frames, dim)."""
    return make(**KINDS[request.param])


def make(contacts=False, rotation="vector", **settings):
    motions = [gaits.make(seconds=2, speed=v, turn_rate=w, noise=0.5, seed=i)
               for i, (v, w) in enumerate([(1.0, 0.0), (1.4, 0.6), (2.8, -0.3)])]  # fmt: skip
    encoding = JointAngles(motions[0].skeleton, rotation=rotation, contacts=contacts)
    clips = [encoding.encode(motion)[:FRAMES] for motion in motions]
    torch.manual_seed(0)
    normal = Normalizer.fit(clips), 16, effector_normalizer(encoding, clips)
    refiner = Refiner(encoding, *normal, **settings).requires_grad_(False)
    for layer in filter(None, (refiner.leave, refiner.aside)):
        torch.nn.init.normal_(layer.weight, std=0.3)
    return refiner, torch.stack(clips)


def frame_by_frame(refiner, features, count=1):
    state, pieces = None, []
    for frame in features.split(count, dim=1):
        piece, state = refiner.refine(frame, state)
        pieces.append(piece)
    return torch.cat(pieces, dim=1), state


def assert_same(refiner, features, tolerance=2e-5, count=1):
    found, state = frame_by_frame(refiner, features, count)
    whole, end = refiner.refine(features)
    normal, close = refiner.normalizer, {"rtol": 1e-5, "atol": tolerance}
    torch.testing.assert_close(normal(found), normal(whole), **close)
    torch.testing.assert_close(found, whole, **close)  # the constant channels, too
    for ours, theirs in zip(state, end, strict=True):
        torch.testing.assert_close(ours, theirs, **close)


@torch.no_grad()
def test_a_stream_of_frames_is_the_whole(world):
    refiner, features = world
    assert step(refiner, features[:, :1], None)
    assert (refiner(features) - features).abs().max() > 0.01
    assert_same(refiner, features)
    assert_same(refiner, features[1:2])
    with torch.inference_mode():
        assert_same(refiner, features)


@pytest.mark.parametrize("count", [2, 5, MOST])
@torch.no_grad()
def test_so_is_a_stream_of_windows(world, count):
    refiner, features = world
    assert step(refiner, features[:, :count], None)
    assert step(refiner, features[:, : MOST + 1], None) is None
    assert_same(refiner, features, count=count)
    assert_same(refiner, features[1:2], count=count)


@torch.no_grad()
def test_bodies_in_any_pose(world):
    """Upside down, at rest, with joints turned further than half way round."""
    refiner, features = world
    generator = torch.Generator().manual_seed(0)
    wild = features + 2 * torch.randn(features.shape, generator=generator)
    wild[0, 3] = 0
    wild[0, 4, 6:] = 0
    wild[1, :, 4:6] = torch.tensor([0.0, math.pi])
    assert_same(refiner, wild, 1e-4)


@torch.no_grad()
def test_it_goes_on_from_a_piece(world):
    refiner, features = world
    _, state = refiner.refine(features[:, :20])
    found, _ = refiner.refine(features[:, 20:21], state)
    expected = refiner(features)[:, 20:21]
    torch.testing.assert_close(found, expected, rtol=0, atol=2e-5)


@torch.no_grad()
def test_nothing_that_was_given_is_changed(world):
    refiner, features = world
    _, state = refiner.refine(features[:, :1])
    given = (features, *state, *refiner.state_dict().values())
    before = [part.clone() for part in given]
    for _ in range(2):
        refiner.refine(features[:, 1:2], state)
    assert all(map(torch.equal, given, before))


@torch.no_grad()
def test_it_follows_weights_that_change(world):
    refiner, features = world
    before, _ = frame_by_frame(refiner, features)
    refiner.lstm.weight_hh_l0.mul_(-1)
    assert not torch.allclose(frame_by_frame(refiner, features)[0], before)
    assert_same(refiner, features)
    refiner.lstm.weight_hh_l0.mul_(-1)
    assert torch.equal(frame_by_frame(refiner, features)[0], before)


@torch.no_grad()
def test_who_leaves_all_bounds_does_so_alone_and_in_silence(world):
    refiner, features = world
    _, state = refiner.refine(features[:, :5])
    expected, _ = refiner.refine(features[:, 5:6], state)
    features = features.clone()
    features[0, 5, 0] = 3e38  # metres in a frame: too many a second
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found, state = refiner.refine(features[:, 5:6], state)
    assert not found[0].isfinite().all() and torch.equal(found[1:], expected[1:])
    with pytest.raises(ModelError, match="NaN or infinite"):
        refiner.refine(features[:, 6:7], state)


@pytest.mark.parametrize("rotation", ["euler", "6d"])
@torch.no_grad()
def test_other_rotations_go_the_other_way(rotation):
    refiner, features = make(rotation=rotation)
    assert step(refiner, features[:, :1], None) is None
    assert_same(refiner, features)


def test_so_do_gradients_and_double_precision(world):
    refiner, features = world
    first = features[:, :1].clone()
    assert step(refiner, first, None) is None
    with torch.no_grad():
        assert step(refiner, first.double(), None) is None
        double = copy.deepcopy(refiner).double()
        assert step(double, first, None) is None
        assert double.refine(first)[0].dtype == torch.float64
    refiner.refine(first.requires_grad_())[0].sum().backward()
    assert first.grad.abs().sum() > 0
    with torch.no_grad():
        learning = copy.deepcopy(refiner).requires_grad_()
        assert_same(learning, features)
        torch.testing.assert_close(learning.refine(first)[0], refiner.refine(first.detach())[0])


@torch.no_grad()
def test_what_is_wrong_is_said_as_ever(world):
    refiner, features = world
    _, state = refiner.refine(features[:, :1])
    broken = features[:, 1:2].clone()
    broken[1, 0, 2] = math.nan
    for wrong, message in [
        ((broken, state), "NaN"),
        ((features[:, 1:2, :-1], state), r"needs \(batch, frames"),
        ((features[0, 0], state), r"needs \(batch, frames"),
        ((features[:2, 1:2], state), "A state of 3 motions; there are 2"),
        ((features[:, 1:2], tuple(state)), "no state of this model"),
        ((features[:, 1:2], state._replace(cell=state.cell * math.inf)), "NaN or infinite"),
        ((features[:, 1:2], state._replace(noise=state.frame)), "holds `noise` of shape"),
        (("a frame", state), "must be an array of numbers"),
    ]:
        with pytest.raises(MotionLabError, match=message):
            refiner.refine(*wrong)
    assert refiner.refine(features[0, 1:2].tolist(), state[0])[0].shape == features[:1, :1].shape
