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
    steepness,
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


@pytest.fixture
def tethered(world):
    """A refiner that may move the root by 4 cm, with weights that do so."""
    encoding, _, refiner, _ = world
    torch.manual_seed(1)
    made = Refiner(encoding, refiner.normalizer, 16, refiner.effectors, reach=0.04)
    for layer in (made.leave, made.aside):
        torch.nn.init.normal_(layer.weight, std=0.5)
    return made


def test_a_refiner_can_see_slow_velocities_enlarged(world, tmp_path):
    encoding, features, refiner, _ = world
    torch.manual_seed(0)
    close = Refiner(encoding, refiner.normalizer, 16, refiner.effectors, slow=0.1)
    torch.nn.init.normal_(close.leave.weight, std=0.05)
    before = _moving(encoding, features).unflatten(-1, (-1, 6))[..., :2, 3:].flatten(-2)
    seen = torch.cat([refiner.normalizer(features), refiner.effectors(_moving(encoding, features)),
                      torch.asinh(before / 0.1)], -1)  # fmt: skip
    said = close.leave(close.lstm(close.enter(seen))[0])
    expected = refiner.normalizer.inverse(refiner.normalizer(features) + said)
    assert torch.allclose(close(features), expected, atol=1e-5)
    save_weights(tmp_path / "close.safetensors", close, {})
    assert load_weights(tmp_path / "close.safetensors")[0].slow == 0.1


def test_a_tethered_root_is_where_it_is_said_to_be(world, tethered):
    encoding, features, *_ = world
    long = features.repeat(1, 10, 1)  # 400 frames, turning
    refined = tethered(long)
    felt, _ = tethered.lstm(tethered.enter(torch.cat(
        [tethered.normalizer(long), tethered.effectors(_moving(encoding, long))], -1
    )))  # fmt: skip
    offset = 0.04 * tethered.aside(felt).tanh()  # aside, ahead
    yaw = torch.cat([torch.zeros(3, 1), long[:, 1:, 2]], 1).cumsum(1)
    aside = torch.stack(
        [offset[..., 0] * yaw.cos() + offset[..., 1] * yaw.sin(),
         offset[..., 1] * yaw.cos() - offset[..., 0] * yaw.sin()], -1
    )  # fmt: skip
    away = (encoding.root_path(refined) - encoding.root_path(long))[..., [0, 2]]
    assert torch.allclose(away, aside - aside[:, :1], atol=1e-4)
    assert away.abs().max() > 0.01
    assert torch.equal(refined[..., 2], long[..., 2])  # turns are left alone
    assert (refined[..., 3] - long[..., 3]).abs().max() > 1e-3  # heights are not


def _moving(encoding, features):
    with_before = torch.cat([features[:, :1], features], 1)
    return encoding.end_effectors(with_before)[:, 1:].flatten(-2)


def test_a_tethered_root_follows_a_stream(world, tethered):
    _, features, *_ = world
    whole, _ = tethered.refine(features)
    first, state = tethered.refine(features[:, :13])
    second, _ = tethered.refine(features[:, 13:], state)
    assert torch.allclose(torch.cat([first, second], 1), whole, atol=1e-5)


def test_a_tethered_refiner_begins_by_changing_nothing_and_is_kept(world, tethered, tmp_path):
    encoding, features, refiner, _ = world
    newborn = Refiner(encoding, refiner.normalizer, 8, refiner.effectors, reach=0.04)
    assert torch.allclose(newborn(features), features, atol=1e-5)
    save_weights(tmp_path / "refiner.safetensors", tethered, {})
    again, _ = load_weights(tmp_path / "refiner.safetensors")
    assert again.reach == 0.04 and torch.equal(again(features), tethered(features))


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


def test_slow_feet_and_sudden_changes_can_be_enlarged(world):
    encoding, features, _, critic = world
    close = Discriminator(encoding, critic.effectors, 12, slow=0.1)
    velocities = encoding.end_effectors(features)[..., 3:]
    toes = torch.asinh(velocities[..., :2, :] / 0.1).flatten(-2)
    changes = torch.asinh((velocities[:, 1:] - velocities[:, :-1]) / 0.1).flatten(-2)
    plain, seen = critic.seen(features), close.seen(features)
    moving, end = len(critic.effectors.mean), len(critic.effectors.mean) + 6
    assert encoding.effector_names[:2] == ("left_toes", "right_toes")
    assert torch.equal(seen[..., :moving], plain[..., :moving])
    assert torch.allclose(seen[..., moving:end], toes, atol=1e-6)
    assert torch.allclose(seen[:, 1:, end : end + moving // 2], changes, atol=1e-5)
    assert (seen[:, 0, end : end + moving // 2] == 0).all()  # nothing is known of before
    assert torch.equal(seen[..., end + moving // 2 :], plain[..., moving:])
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


def test_steepness_is_the_square_of_the_gradient():
    """Of a plane it is the square of the slope, in the mean over directions."""

    class Plane:
        def judge(self, seen):
            return seen @ torch.tensor([3.0, 0.0, -4.0])

    chance = torch.Generator().manual_seed(0)
    seen = torch.randn(50, 200, 3, generator=chance)
    noise = 0.01 * torch.randn(seen.shape, generator=chance)
    found = steepness(Plane(), seen, Plane().judge(seen), noise)
    assert found.item() == pytest.approx(25, rel=0.05)


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


def test_weights_that_are_read_while_sampling_can_learn(world, tmp_path):
    save_weights(tmp_path / "refiner.safetensors", world[2], {})
    with torch.inference_mode():
        again, _ = load_weights(tmp_path / "refiner.safetensors")
    again(world[1]).sum().backward()
    assert again.leave.weight.grad.abs().sum() > 0


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
    for reach in (0.0, -1.0, math.nan):
        with pytest.raises(ModelError, match="metres above 0"):
            Refiner(encoding, refiner.normalizer, 8, reach=reach)
        with pytest.raises(ModelError, match="metres a second above 0"):
            Discriminator(encoding, slow=reach)
    with pytest.raises(ModelError, match="end effectors have 30"):
        Refiner(encoding, refiner.normalizer, 8, Normalizer(12))


def test_one_frame_is_motion_too(world):
    _, features, refiner, _ = world
    assert torch.allclose(refiner(features[:, :1]), refiner(features)[:, :1], atol=1e-6)
    assert refiner.refine(features[0])[0].shape == (1, *features.shape[1:])
