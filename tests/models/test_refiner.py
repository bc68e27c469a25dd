"""The refiner and its discriminator: shapes, streams, gradients, the game's losses, bad input."""

from __future__ import annotations

import math

import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from motionlab.datasets import gaits
from motionlab.encodings import JointAngles, Normalizer, RootRelative
from motionlab.errors import ModelError
from motionlab.models import Discriminator, Refiner
from motionlab.models.refiner import (
    effector_normalizer,
    fooling_loss,
    root_deviation,
    telling_loss,
)
from motionlab.training.checkpoints import load_weights, save_weights

FRAMES = 40


@pytest.fixture(scope="module", params=[False, True], ids=["plain", "contacts"])
def world(request):
    """Encoding, features (3, frames, dim), and both networks, with weights that do something."""
    motions = [gaits.make(seconds=2, speed=v, turn_rate=w, noise=0.5, seed=i)
               for i, (v, w) in enumerate([(1.0, 0.0), (1.4, 0.6), (2.8, -0.3)])]  # fmt: skip
    encoding = JointAngles(motions[0].skeleton, contacts=request.param)
    clips = [encoding.encode(motion)[:FRAMES] for motion in motions]
    torch.manual_seed(0)
    effectors = effector_normalizer(encoding, clips)
    refiner = Refiner(encoding, Normalizer.fit(clips), 16, effectors)
    torch.nn.init.normal_(refiner.leave.weight, std=0.05)
    return encoding, torch.stack(clips), refiner, Discriminator(encoding, effectors, 12)


def test_a_newborn_leaves_motion_as_it_is(world):
    encoding, features, refiner, _ = world
    newborn = Refiner(encoding, refiner.normalizer, 16, refiner.effectors)
    assert torch.allclose(newborn(features), features, atol=1e-5)


def test_equation_11_written_out(world):
    encoding, features, refiner, _ = world
    before = torch.cat([features[:, :1], features[:, :-1]], dim=1)
    moving = torch.stack(
        [
            encoding.end_effectors(torch.stack([b, f]))[1].flatten()
            for b, f in zip(before.flatten(0, 1), features.flatten(0, 1), strict=True)
        ]
    ).unflatten(0, features.shape[:2])
    x = refiner.normalizer(features)
    lstm = torch.nn.LSTM(16, 16, batch_first=True)
    lstm.load_state_dict(refiner.lstm.state_dict())
    first, last = refiner.enter[0], refiner.leave
    seen = torch.cat([x, refiner.effectors(moving)], -1) @ first.weight.T + first.bias
    said = lstm(seen.relu())[0] @ last.weight.T + last.bias
    expected = refiner.normalizer.inverse(said + x)
    assert torch.allclose(refiner(features), expected, atol=1e-5)
    assert (expected - features).abs().max() > 1e-3


@settings(deadline=None, max_examples=20)
@given(cuts=st.sets(st.integers(1, FRAMES - 1), max_size=6))
def test_pieces_give_what_the_whole_gives(world, cuts):
    _, features, refiner, _ = world
    whole, end = refiner.refine(features)
    state, pieces = None, []
    for start, stop in zip([0, *sorted(cuts)], [*sorted(cuts), FRAMES], strict=True):
        piece, state = refiner.refine(features[:, start:stop], state)
        pieces.append(piece)
    assert torch.allclose(torch.cat(pieces, dim=1), whole, atol=1e-5)
    assert all(torch.allclose(a, b, atol=1e-5) for a, b in zip(state, end, strict=True))


def test_it_never_looks_ahead(world):
    _, features, refiner, _ = world
    changed = features.clone()
    changed[:, 20:] += 0.1
    assert torch.equal(refiner(changed)[:, :20], refiner(features)[:, :20])


def test_the_discriminator_sees_end_effectors_alone(world):
    """A head may turn about its own joint: it is still where it was."""
    encoding, features, _, critic = world
    head = encoding.feature_names.index("Head_x")
    turned = features.clone()
    turned[..., head : head + 3] += 0.2
    assert torch.allclose(critic(turned), critic(features), atol=1e-5)
    knee = encoding.feature_names.index("LeftLowerLeg_x")
    turned[..., knee] += 0.2
    assert (critic(turned) - critic(features)).abs().max() > 1e-4
    if "contacts" in encoding.slices:
        flipped = features.clone()
        flipped[..., encoding.slices["contacts"]] = 1 - flipped[..., encoding.slices["contacts"]]
        assert (critic(flipped) - critic(features)).abs().max() > 1e-4


def test_slow_feet_can_be_enlarged(world):
    encoding, features, _, critic = world
    close = Discriminator(encoding, critic.effectors, 12, slow=0.1)
    velocities = encoding.end_effectors(features)[..., 3:].flatten(-2)
    extra = torch.asinh(velocities / 0.1)
    plain, seen = critic.seen(features), close.seen(features)
    moving = len(critic.effectors.mean)
    assert torch.equal(seen[..., :moving], plain[..., :moving])
    assert torch.allclose(seen[..., moving : moving + extra.shape[-1]], extra, atol=1e-6)
    assert torch.equal(seen[..., moving + extra.shape[-1] :], plain[..., moving:])
    assert close(features).shape == features.shape[:2]


def test_it_looks_both_ways(world):
    _, features, _, critic = world
    changed = features.clone()
    changed[:, -1] += 0.1
    assert (critic(changed) - critic(features))[:, -5].abs().max() > 1e-6


def test_losses_are_those_of_the_paper():
    real, refined = torch.randn(2, 4, 9, generator=torch.Generator().manual_seed(0)).double()
    d_real, d_refined = real.sigmoid(), refined.sigmoid()
    assert torch.allclose(fooling_loss(refined), -d_refined.log().mean())
    expected = -(1 - d_refined).log().mean() - d_real.log().mean()
    assert torch.allclose(telling_loss(real, refined), expected)
    undecided = torch.zeros(3)
    assert telling_loss(undecided, undecided).item() == pytest.approx(2 * math.log(2))


def test_root_deviation_is_in_square_metres(world):
    encoding, features, _, _ = world
    assert root_deviation(encoding, features, features).item() == 0
    higher = features.clone()
    higher[..., 3] += 0.1
    assert root_deviation(encoding, features, higher).item() == pytest.approx(0.01, rel=1e-3)
    slower = features.clone()
    slower[..., :2] = 0  # stays where it is
    way = encoding.root_path(features)[..., [0, 2]].square().sum(-1).mean()
    assert root_deviation(encoding, features, slower).item() == pytest.approx(way.item())


def test_gradients_reach_every_weight(world):
    encoding, features, refiner, critic = world
    refined = refiner(features)
    (fooling_loss(critic(refined)) + 20 * root_deviation(encoding, features, refined)).backward()
    for network in (refiner, critic):
        for name, parameter in network.named_parameters():
            assert parameter.grad is not None and parameter.grad.abs().sum() > 0, name
            parameter.grad = None


def test_weights_are_written_and_read_again(world, tmp_path):
    _, features, refiner, _ = world
    save_weights(tmp_path / "refiner.safetensors", refiner, {"update": 3})
    again, about = load_weights(tmp_path / "refiner.safetensors")
    assert about == {"update": 3} and torch.equal(again(features), refiner(features))


def test_what_cannot_be_refined_is_said(world):
    encoding, features, refiner, _ = world
    broken = features.clone()
    broken[0, 3, 2] = math.nan
    other = Refiner(encoding, refiner.normalizer, 8, refiner.effectors)
    for wrong, message in [
        ((features[..., 1:],), rf"needs \(batch, frames, {encoding.dim}\)"),
        ((features[:, :0],), "at least one frame"),
        ((broken,), "NaN"),
        ((features, other.observe(features)), "no state of this model"),
        ((features, refiner.observe(features[:2])), "2 motions; there are 3"),
    ]:
        with pytest.raises(ModelError, match=message):
            refiner.refine(*wrong)
    with pytest.raises(ModelError, match="JointAngles, not RootRelative"):
        Refiner(RootRelative(encoding.skeleton), refiner.normalizer)
    with pytest.raises(ModelError, match="end effectors have 30"):
        Refiner(encoding, refiner.normalizer, 8, Normalizer(12))


def test_one_frame_is_motion_too(world):
    _, features, refiner, _ = world
    assert torch.allclose(refiner(features[:, :1]), refiner(features)[:, :1], atol=1e-6)
    assert refiner.refine(features[0])[0].shape == (1, *features.shape[1:])
