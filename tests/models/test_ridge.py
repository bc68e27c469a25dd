"""Ridge regression: what is linear it finds, what is not it says as well as a line can."""

import pytest
import torch

from motionlab.datasets import gaits
from motionlab.encodings import BodyFrame, Normalizer
from motionlab.errors import ModelError
from motionlab.models.ridge import Ridge


@pytest.fixture(scope="module")
def walks():
    motions = [gaits.make(seconds=2, speed=0.8 + 0.1 * i, seed=i) for i in range(12)]
    encoding = BodyFrame(motions[0].skeleton, motions[0].fps)
    clips = [encoding.encode(motion) for motion in motions]
    return encoding, Normalizer.fit(clips), clips


def test_it_finds_the_least_squares(walks):
    encoding, normalizer, clips = walks
    model = Ridge.fit(encoding, normalizer, clips, 2, 3, penalty=1e-3)
    windows = [normalizer(clip).unfold(0, 5, 1).transpose(1, 2) for clip in clips]
    rows = torch.cat(windows).flatten(1).double()
    seen, true = (part - part.mean(0) for part in rows.split([2 * model.kept, 3 * model.kept], 1))
    # a penalty is as good as rows that ask each weight to be nothing
    asks = (1e-3 * seen.square().mean() * len(seen)).sqrt() * torch.eye(2 * model.kept).double()
    nothing = true.new_zeros(len(asks), true.shape[1])
    best = torch.linalg.lstsq(torch.cat([seen, asks]), torch.cat([true, nothing])).solution
    torch.testing.assert_close(model.weight.double().T, best, rtol=0.02, atol=2e-3)


def test_it_beats_standing_still(walks):
    encoding, normalizer, clips = walks
    model = Ridge.fit(encoding, normalizer, clips[:10], 5, 5)
    off = lambda said, true: float((normalizer(said) - normalizer(true)).square().mean())
    for clip in clips[10:]:
        seen, true = clip[:5], clip[5:10]
        assert off(model.extrapolate(seen, 5), true) < off(seen[-1:].expand(5, -1), true)


def test_it_goes_on_from_what_it_said(walks):
    encoding, normalizer, clips = walks
    model = Ridge.fit(encoding, normalizer, clips, 4, 3, step=2)
    seen = torch.stack([clip[:9] for clip in clips[:2]])
    found = model.extrapolate(seen, 5)
    first = model(seen[:, -4:])
    torch.testing.assert_close(found[:, :3], first)
    second = model(torch.cat([seen, first], 1)[:, -4:])
    torch.testing.assert_close(found[:, 3:], second[:, :2])
    torch.testing.assert_close(model.extrapolate(seen[1], 5), found[1])


def test_a_large_penalty_says_the_mean(walks):
    encoding, normalizer, clips = walks
    model = Ridge.fit(encoding, normalizer, clips, 4, 3, penalty=1e9)
    said = normalizer(model(clips[0][None, :4]))
    windows = torch.cat([normalizer(c).unfold(0, 7, 1).transpose(1, 2)[:, 4:] for c in clips])
    torch.testing.assert_close(said[0], windows.mean(0), atol=1e-3, rtol=0)


def test_bad_input(walks):
    encoding, normalizer, clips = walks
    with pytest.raises(ModelError, match="none of 12 clips has 99999"):
        Ridge.fit(encoding, normalizer, clips, 99_998, 1)
    for wrong in ({"penalty": 0}, {"penalty": float("nan")}, {"step": 0}, {"encode": 1.5}):
        with pytest.raises(ModelError, match=next(iter(wrong))):
            Ridge.fit(encoding, normalizer, clips, **wrong)
    model = Ridge(encoding, normalizer, 4, 3)
    with pytest.raises(ModelError, match="3 frames; this regression reads 4"):
        model.extrapolate(clips[0][:3], 5)
    with pytest.raises(ModelError, match="1 or more"):
        model.extrapolate(clips[0], 0)
    with pytest.raises(ModelError, match="NaN"):
        model.extrapolate(torch.full((9, 73), torch.nan), 5)
    with pytest.raises(ModelError, match="normalizer"):
        Ridge(encoding, Normalizer(9))
