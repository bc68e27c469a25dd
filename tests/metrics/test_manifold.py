"""Manifold distance: against a plain loop, replays found, memory bounded by the windows."""

import numpy as np
import pytest
import torch

from motionlab.errors import MetricError
from motionlab.metrics import manifold_distance, nearest_window_distance, replay_share


def clips(*lengths, dim=5, seed=0, middle=0.0):
    random = torch.Generator().manual_seed(seed)
    return [torch.randn(n, dim, generator=random).cumsum(0) * 0.3 + middle for n in lengths]


def brute_force(samples, reference, length, stride, reference_stride):
    """(distance, clip, frame, match clip, match frame) per window, in float64, one pair a time."""
    found = []
    for number, sample in enumerate(samples):
        for start in range(0, len(sample) - length + 1, stride):
            best = None
            for other, real in enumerate(reference):
                for begin in range(0, len(real) - length + 1, reference_stride):
                    gap = sample[start : start + length] - real[begin : begin + length]
                    distance = float(gap.double().norm(dim=-1).mean())
                    if best is None or distance < best[0]:
                        best = distance, number, start, other, begin
            found.append(best)
    return found


@pytest.mark.parametrize("middle", [0.0, 300.0])
def test_against_brute_force(middle):
    """Far from zero too, where matrix products lose digits."""
    samples, real = clips(83, 40, 61, middle=middle), clips(200, 55, 40, seed=1, middle=middle)
    found = nearest_window_distance(samples, real, fps=30)
    expected = brute_force(samples, real, 40, 10, 10)
    assert len(found.distance) == len(expected)
    for got, (distance, clip, start, other, begin) in zip(
        zip(*found, strict=True), expected, strict=True
    ):
        assert float(got[0]) == pytest.approx(distance, rel=2e-5)
        places = [int(got[1]), round(float(got[2]) * 30), int(got[3]), round(float(got[4]) * 30)]
        assert places == [clip, start, other, begin]
    means = [np.mean([e[0] for e in expected if e[1] == clip]) for clip in range(3)]
    torch.testing.assert_close(
        manifold_distance(samples, real, fps=30).double(),
        torch.tensor(means),
        rtol=2e-5,
        atol=0,
    )


def test_chunks_join(monkeypatch):
    import motionlab.metrics.manifold as manifold

    samples, real = clips(150, 100), clips(200, 150, seed=1)
    whole = nearest_window_distance(samples, real, fps=30, step=0.1)
    monkeypatch.setattr(manifold, "ROWS", 17)
    monkeypatch.setattr(manifold, "COLUMNS", 23)
    for a, b in zip(whole, nearest_window_distance(samples, real, fps=30, step=0.1), strict=True):
        torch.testing.assert_close(a, b)


@pytest.mark.parametrize("middle", [0.0, 1000.0])
def test_a_replay_scores_nothing(middle):
    real = clips(300, 300, seed=1, middle=middle)
    sample = real[1][137:237]
    found = nearest_window_distance([sample], real, fps=30, reference_step=0)
    assert found.distance.max() == 0
    assert (found.match_clip == 1).all()
    torch.testing.assert_close(found.match_time, found.time + 137 / 30)
    assert manifold_distance(real, real, fps=30).max() == 0


def test_known_distance():
    """Shifted in all of 73 channels by 1: every frame's norm is the root of 73."""
    real = [torch.zeros(60, 73)]
    assert float(manifold_distance([torch.ones(40, 73)], real, fps=30)) == pytest.approx(73**0.5)
    # the mean of per-frame norms, not the norm of the window: half the frames are off by 2
    sample = torch.zeros(40, 1)
    sample[::2] = 2
    assert float(manifold_distance([sample], [torch.zeros(40, 1)], fps=30)) == pytest.approx(1)


def test_scale_and_rate():
    samples, real = clips(90, 120), clips(200, 100, seed=1)
    distance = manifold_distance(samples, real, fps=30)
    scaled = manifold_distance([3 * c for c in samples], [3 * c for c in real], fps=30)
    torch.testing.assert_close(scaled, 3 * distance)
    # smooth curves at twice the rate: windows last as long, within 2 %
    smooth = lambda fps, phase: torch.sin(
        torch.arange(round(5 * fps))[:, None] / fps * torch.tensor([2.0, 3.1, 4.3]) + phase
    )
    at = [
        manifold_distance([smooth(fps, 0.3)], [smooth(fps, 1.0), smooth(fps, 2.0)], fps=fps)
        for fps in (30, 60)
    ]
    torch.testing.assert_close(at[0], at[1], rtol=0.02, atol=0)


def test_a_batch_is_a_list():
    batch = torch.stack(clips(90, 90, 90))
    together = manifold_distance(batch, batch[:1], fps=30)
    single = [manifold_distance([clip], batch[:1], fps=30) for clip in batch]
    torch.testing.assert_close(together, torch.cat(single))


def test_replay_share():
    held_out = torch.linspace(1, 2, 1000)
    assert replay_share(held_out, held_out) == pytest.approx(0.01)
    assert replay_share(torch.zeros(5), held_out) == 1
    assert replay_share(torch.tensor([0.0, 3.0]), held_out) == 0.5
    with pytest.raises(MetricError, match="no windows"):
        replay_share(torch.zeros(0), held_out)


def test_bad_input_is_named():
    good = clips(60)
    for samples, real, words in (
        ([], good, "samples is empty"),
        (good, [], "real is empty|reference is empty"),
        (clips(39), good, r"samples\[0\] has 39 frames"),
        (good, clips(60, 30), r"reference\[1\] has 30 frames"),
        (good, clips(60, dim=4), "5"),
        (good, [torch.full((60, 5), float("nan"))], "NaN"),
        ([torch.zeros(2, 60, 5)], good, "a clip is"),
    ):
        with pytest.raises(MetricError, match=words):
            manifold_distance(samples, real, fps=30)
    for options in ({"fps": 0}, {"fps": 30, "window": -1}, {"fps": 30, "step": 0}):
        with pytest.raises(MetricError):
            manifold_distance(good, good, **options)
    for step in (-1, float("nan"), "1"):
        with pytest.raises(MetricError, match="reference_step"):
            nearest_window_distance(good, good, 30, reference_step=step)
    with pytest.raises(MetricError, match="quantile"):
        replay_share(torch.ones(3), torch.ones(3), quantile=2)
