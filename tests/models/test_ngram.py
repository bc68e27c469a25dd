"""An n-gram says what followed, and nothing else."""

import math

import pytest
import torch

from motionlab import Skeleton
from motionlab.encodings import BodyFrame, Normalizer
from motionlab.errors import ModelError
from motionlab.models.ngram import Ngram


@pytest.fixture(scope="module")
def remembered():
    encoding = BodyFrame(Skeleton.canonical(), 30)
    chance = torch.Generator().manual_seed(0)
    clips = [torch.randn(n, 73, generator=chance) for n in (40, 25, 60)]
    return clips, Ngram.fit(encoding, Normalizer.fit(clips), clips, 6, 10)


def test_what_it_has_seen_goes_on_as_it_did(remembered):
    clips, ngram = remembered
    seen = torch.stack([clips[0][8:20], clips[2][3:15]])
    found = ngram.extrapolate(seen, 10)
    assert torch.allclose(found[0], clips[0][20:30], atol=1e-5)
    assert torch.allclose(found[1], clips[2][15:25], atol=1e-5)
    assert torch.equal(ngram.extrapolate(seen[0], 10), found[0])


def test_noise_does_not_lead_it_astray_and_it_looks_again(remembered):
    clips, ngram = remembered
    noisy = clips[2][0:6] + 0.05 * torch.randn(6, 73, generator=torch.Generator().manual_seed(1))
    found = ngram.extrapolate(noisy, 25)
    assert torch.allclose(found, clips[2][6:31], atol=1e-5)  # three looks, the clip goes on


def test_it_never_runs_beyond_a_clip(remembered):
    clips, ngram = remembered
    found = ngram.extrapolate(clips[1][-6:], 30)  # nothing followed: another place is nearest
    rows = torch.cat(clips)
    nearest = torch.cdist(found, rows).min(1).values
    assert float(nearest.max()) < 1e-2
    # of 25 frames, ten must follow: the last match begins at frame 9
    assert len(ngram.starts) == 25 + 10 + 45


def test_the_distance_is_the_plain_one(remembered):
    clips, ngram = remembered
    seen = torch.randn(5, 6, 73, generator=torch.Generator().manual_seed(2))
    ours = ngram._nearest(ngram.normalizer(seen))
    windows = ngram.rows[ngram.starts[:, None] + torch.arange(6)]
    plain = (ngram.normalizer(seen)[:, None] - windows).square().sum((-1, -2)).argmin(1)
    assert torch.equal(ours, ngram.starts[plain])


def test_what_it_can_not_read(remembered):
    clips, ngram = remembered
    with pytest.raises(ModelError, match="reads 6"):
        ngram.extrapolate(clips[0][:5], 3)
    with pytest.raises(ModelError, match="NaN"):
        ngram.extrapolate(clips[0][:6] * math.nan, 3)
    with pytest.raises(ModelError, match="0 frames"):
        ngram.extrapolate(clips[0][:6], 0)
    with pytest.raises(ModelError, match="remembers nothing"):
        Ngram(ngram.encoding, ngram.normalizer).extrapolate(clips[0][:6], 1)
    with pytest.raises(ModelError, match="none of 1 clips has 50"):
        Ngram.fit(ngram.encoding, ngram.normalizer, [clips[0]], 6, 44)
    with pytest.raises(ModelError, match="encode"):
        Ngram(ngram.encoding, ngram.normalizer, 0)
