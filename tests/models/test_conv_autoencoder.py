"""The convolutional autoencoder: what it sees of time, what it learns from, what it takes away."""

import pytest
import torch

from motionlab.commands.sample import check_generates
from motionlab.datasets import gaits
from motionlab.encodings import BodyFrame, Normalizer
from motionlab.errors import ModelError, MotionLabError
from motionlab.models import ConvAutoencoder
from motionlab.training.checkpoints import load_weights, save_weights


@pytest.fixture(scope="module")
def walks():
    motions = [gaits.make(seconds=3, speed=0.8 + 0.1 * i, seed=i) for i in range(8)]
    encoding = BodyFrame(motions[0].skeleton, motions[0].fps)
    clips = torch.stack([encoding.encode(motion)[:64] for motion in motions])
    return encoding, Normalizer.fit([*clips]), clips


def network(walks, **settings):
    torch.manual_seed(0)
    return ConvAutoencoder(walks[0], walks[1], (8, 16, 32), **{"span": 5} | settings)


@pytest.fixture(scope="module")
def learned(walks):
    """A few seconds of training on these very walks."""
    model, clips = network(walks), walks[2]
    optimizer = torch.optim.Adam(model.parameters(), 5e-3)
    for update in range(150):
        loss = model.loss(clips, lots=torch.full((len(clips),), update))
        optimizer.zero_grad()
        loss.backward()
        optimizer.step()
    return model.eval()


def test_it_learns_and_takes_noise_away(walks, learned):
    _, normalizer, clips = walks
    off = lambda some: float((normalizer(some) - normalizer(clips)).square().mean())
    assert off(learned.reconstruct(clips)) < 0.3
    noise = 0.7 * torch.randn(clips.shape, generator=torch.Generator().manual_seed(1))
    seen = clips + noise * normalizer.std
    assert off(learned.project(seen)) < 0.6 * off(seen)
    assert torch.equal(learned.project(seen), learned.reconstruct(seen))


@pytest.mark.parametrize("frames", [1, 7, 8, 63])
def test_clips_of_any_length(walks, frames):
    model, clip = network(walks), walks[2][0]
    made = model.reconstruct(clip[:frames])
    assert made.shape == (frames, walks[0].dim) and made.isfinite().all()
    assert torch.allclose(made, model.reconstruct(walks[2][:2, :frames])[0], atol=1e-5)
    longer = torch.cat([clip[:frames], clip[frames - 1 : frames].expand(-frames % 8, -1)])
    assert torch.allclose(made, model.reconstruct(longer)[:frames], atol=1e-5)


def test_a_frame_is_heard_as_far_as_its_patterns_reach(walks):
    """Two layers of 5 frames there and two back, the inner ones of twice as many; and pooling."""
    torch.manual_seed(0)
    model, clip = ConvAutoencoder(walks[0], walks[1], (8, 16), span=5), walks[2][0]
    other = clip.clone()
    other[32, :9] += 5 * walks[1].std[:9]
    moved = (model.reconstruct(clip) - model.reconstruct(other)).abs().amax(1) > 1e-5
    heard = moved.nonzero().flatten()
    reach = 2 * (2 + 4)
    assert 32 - reach - 4 <= heard.min() <= 32 - reach + 4
    assert 32 + reach - 4 <= heard.max() <= 32 + reach + 4


@torch.no_grad()
def test_what_is_missing_is_drawn_from_its_lots(walks):
    model, clips = network(walks), walks[2]
    loss = lambda lot: float(model.loss(clips, lots=None if lot is None else torch.full((8,), lot)))
    assert loss(3) == loss(3) != loss(4)
    whole = network(walks, missing=0.0)
    assert float(whole.loss(clips, lots=torch.full((8,), 3))) == loss(None)
    dense = network(walks, sparse=0.0)
    assert loss(None) > float(dense.loss(clips))
    assert float(model.eval().loss(clips)) == float(dense.loss(clips))  # no cost in validation
    spoilt = float(model.loss(clips, noise=torch.full_like(clips, 2.0)))
    assert spoilt != float(model.loss(clips))


def test_it_is_stored_and_comes_back(walks, learned, tmp_path):
    save_weights(tmp_path / "sc.safetensors", learned, {"name": "conv-autoencoder"})
    again, _ = load_weights(tmp_path / "sc.safetensors")
    clips = walks[2]
    assert torch.equal(again.eval().project(clips), learned.project(clips))
    with pytest.raises(MotionLabError, match="ConvAutoencoder, which says motion again"):
        check_generates(again, "sc.safetensors")


@pytest.mark.parametrize(
    ("settings", "said"),
    [
        ({"widths": ()}, "one whole number from 1 a layer"),
        ({"widths": (8, 0)}, "one whole number from 1 a layer"),
        ({"span": 4}, "odd number of frames"),
        ({"missing": 1.0}, "share below 1"),
        ({"sparse": float("inf")}, "number from 0"),
    ],
)
def test_sizes_that_make_no_sense(walks, settings, said):
    with pytest.raises(ModelError, match=said):
        ConvAutoencoder(walks[0], walks[1], **settings)


def test_what_is_no_clip(walks):
    model, clip = network(walks), walks[2][0].clone()
    for bad, said in (
        (clip[:0], "at least one frame"),
        (clip[:, 1:], "frames, 73"),
        ("a", "array"),
    ):
        with pytest.raises(ModelError, match=said):
            model.project(bad)
    clip[3, 4] = float("nan")
    with pytest.raises(ModelError, match="NaN"):
        model.reconstruct(clip)
