"""Normalizer: zero mean, unit variance, nothing lost."""

from __future__ import annotations

import numpy as np
import pytest
import torch
from safetensors.torch import load_file, save_file

from motionlab.encodings import BodyFrame, Normalizer
from motionlab.errors import EncodingError


def rows(count: int, seed: int) -> torch.Tensor:
    """Channels of several sizes; 1 and 4 constant, 5 nearly so."""
    values = torch.randn(count, 6, generator=torch.Generator().manual_seed(seed))
    values = values * torch.tensor([1.0, 0, 20, 0.01, 0, 1e-5]) + torch.arange(6) / 10
    return values


def test_mean_and_spread_are_those_of_all_rows():
    clips = [rows(400, 0), rows(100, 1), rows(1, 2)]
    normalizer = Normalizer.fit(clips)
    everything = np.concatenate([clip.double().numpy() for clip in clips])
    assert normalizer.kept.tolist() == [0, 2, 3, 5]
    np.testing.assert_allclose(normalizer.mean.numpy(), everything.mean(0), atol=1e-6)
    np.testing.assert_allclose(normalizer.std[[0, 2, 3]], everything.std(0)[[0, 2, 3]], rtol=1e-6)
    assert normalizer.std[5] == pytest.approx(1e-3)  # the floor: what hardly moves is not blown up
    normal = normalizer(torch.cat(clips)).double().numpy()
    assert normal.shape == (501, 4)
    np.testing.assert_allclose(normal.mean(0), 0, atol=1e-4)
    np.testing.assert_allclose(normal.std(0)[:3], 1, atol=1e-5)
    assert normal[:, 3].std() < 0.02


def test_constant_channels_come_back_exactly():
    clip = rows(50, 0)
    normalizer = Normalizer.fit([clip])
    back = normalizer.inverse(normalizer(clip))
    assert torch.equal(back[:, [1, 4]], clip[:, [1, 4]])
    torch.testing.assert_close(back, clip, rtol=1e-6, atol=1e-6)


def test_features_of_a_motion_survive(gait):
    encoding = BodyFrame(gait.skeleton)
    features = encoding.encode(gait)
    normalizer = Normalizer.fit([features])
    assert normalizer(features).shape == (len(gait), 70)
    points = encoding.positions(normalizer.inverse(normalizer(features)))
    torch.testing.assert_close(points, encoding.positions(features), rtol=0, atol=1e-4)


def test_survives_a_file(tmp_path):
    normalizer = Normalizer.fit([rows(50, 0)])
    save_file(normalizer.state_dict(), tmp_path / "weights.safetensors")
    again = Normalizer(6, 4)
    again.load_state_dict(load_file(tmp_path / "weights.safetensors"))
    clip = rows(9, 3)
    assert torch.equal(again(clip), normalizer(clip))
    assert torch.equal(again.inverse(again(clip)), normalizer.inverse(normalizer(clip)))


def test_new_one_leaves_features_alone():
    clip = rows(5, 0)
    assert torch.equal(Normalizer(6)(clip), clip)
    assert torch.equal(Normalizer(6).inverse(clip), clip)


def test_batched_differentiable_and_in_double():
    normalizer = Normalizer.fit([rows(50, 0)])
    batch = rows(24, 1).unflatten(0, (2, 3, 4))
    assert torch.equal(normalizer(batch)[1, 2], normalizer(batch[1, 2]))
    both = normalizer.double()
    values = rows(3, 2).double().requires_grad_()
    assert torch.autograd.gradcheck(lambda v: both.inverse(both(v)), values)


def test_one_fitted_while_sampling_serves_in_training():
    with torch.inference_mode():
        normalizer = Normalizer.fit([rows(50, 0)])
    values = rows(3, 2).requires_grad_()
    normalizer.inverse(normalizer(values)).sum().backward()
    assert values.grad.isfinite().all()


def test_bad_input():
    good = rows(5, 0)
    nan = good.clone()
    nan[2, 3] = torch.nan
    for clips in ([], good, [good, good[:, :3]], [good[0]], [good[:0]], [nan], ["walk"], None):
        with pytest.raises(EncodingError, match="Normalizer"):
            Normalizer.fit(clips)
    for floor in (-1e-3, torch.nan, "low", None):
        with pytest.raises(EncodingError, match="floor"):
            Normalizer.fit([good], floor)
    normalizer = Normalizer.fit([good])
    for bad in (good.numpy(), "walk"):
        with pytest.raises(EncodingError, match="needs a tensor"):
            normalizer(bad)
    for bad in (good[:, :4], torch.zeros(3, 7)):
        with pytest.raises(EncodingError, match=r"needs a tensor \(\.\.\., 6\)"):
            normalizer(bad)
    with pytest.raises(EncodingError, match=r"needs a tensor \(\.\.\., 4\)"):
        normalizer.inverse(good)
