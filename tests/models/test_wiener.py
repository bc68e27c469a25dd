"""The best linear guess under white noise: it is the best, and it is linear."""

import pytest
import torch

from motionlab.datasets import gaits
from motionlab.encodings import BodyFrame, Normalizer
from motionlab.errors import ModelError
from motionlab.models.overlap import mean_of_windows
from motionlab.models.wiener import Wiener


@pytest.fixture(scope="module")
def walks():
    motions = [gaits.make(seconds=2, speed=0.8 + 0.1 * i, seed=i) for i in range(8)]
    encoding = BodyFrame(motions[0].skeleton, motions[0].fps)
    clips = [encoding.encode(motion) for motion in motions]
    return encoding, Normalizer.fit(clips), clips


def noisy(normalizer, clips, spread, seed=0):
    generator = torch.Generator().manual_seed(seed)
    noise = torch.randn(clips.shape, generator=generator)
    return clips + spread * noise * normalizer.std


def test_no_other_linear_guess_is_better(walks):
    encoding, normalizer, clips = walks
    model = Wiener.fit(encoding, normalizer, clips, 0.3, frames=3)
    windows = torch.cat([normalizer(c).unfold(0, 3, 1).transpose(1, 2) for c in clips]).flatten(1)
    beyond = (windows - windows.mean(0)).double()
    clean = beyond.T @ beyond / len(beyond)

    def error(weight):  # of all noise there is, not of some draws
        off = torch.eye(len(weight)).double() - weight
        return float((off @ clean @ off.T).trace() + 0.09 * (weight @ weight.T).trace())

    best = error(model.weight.double())
    generator = torch.Generator().manual_seed(0)
    for _ in range(5):
        other = torch.randn(model.weight.shape, generator=generator).double()
        assert error(model.weight + 1e-3 * other) > best
    assert error(torch.eye(len(clean)).double()) > 1.5 * best


def test_it_takes_noise_away(walks):
    encoding, normalizer, clips = walks
    clean = torch.stack([clip[:60] for clip in clips])
    seen = noisy(normalizer, clean, 0.3)
    off = lambda some: float((normalizer(some) - normalizer(clean)).square().mean())
    alone, together = (
        off(Wiener.fit(encoding, normalizer, clips, 0.3, frames=n).project(seen)) for n in (1, 8)
    )
    assert together < alone < 0.6 * off(seen)


def test_channels_without_noise_are_believed(walks):
    encoding, normalizer, clips = walks
    spread = torch.full((encoding.dim,), 1.0)
    spread[:30] = 1e-3
    model = Wiener.fit(encoding, normalizer, clips, spread, frames=2)
    seen = torch.stack([clip[:20] for clip in clips])
    off = (normalizer(model.project(seen)) - normalizer(seen)).abs().mean((0, 1))
    low = normalizer.kept < 30
    assert off[low].max() < 0.01 < off[~low].max()


def test_a_window_is_like_its_batch_and_its_mean(walks):
    encoding, normalizer, clips = walks
    model = Wiener.fit(encoding, normalizer, clips, 0.3, frames=4)
    seen = torch.stack([clip[:11] for clip in clips])
    torch.testing.assert_close(model.project(seen)[3], model.project(seen[3]))
    frames = torch.arange(7.0)[None, :, None]
    twice = mean_of_windows(frames, 4, 2, lambda some: some - some[:, :1])
    # windows from 0, 2 and 3: frame 3 is the mean of 3, 1 and 0
    assert twice[0, :, 0].tolist() == pytest.approx([0, 1, 1, 4 / 3, 1.5, 2.5, 3])


def test_bad_input(walks):
    encoding, normalizer, clips = walks
    with pytest.raises(ModelError, match="none of 8 clips"):
        Wiener.fit(encoding, normalizer, [clip[:3] for clip in clips], 0.3, 4)
    for noise in (0, -1.0, float("nan"), "0.3", torch.ones(3), torch.zeros(73)):
        with pytest.raises(ModelError, match="noise"):
            Wiener.fit(encoding, normalizer, clips, noise, 2)
    for wrong in ({"step": 0}, {"frames": 1.5}):
        with pytest.raises(ModelError, match=next(iter(wrong))):
            Wiener.fit(encoding, normalizer, clips, 0.3, **wrong)
    model = Wiener(encoding, normalizer, 4)
    with pytest.raises(ModelError, match="3 frames; windows have 4"):
        model.project(clips[0][:3])
    with pytest.raises(ModelError, match="step"):
        model.project(clips[0], step=5)
    with pytest.raises(ModelError, match="NaN"):
        model.project(torch.full((9, 73), torch.nan))
