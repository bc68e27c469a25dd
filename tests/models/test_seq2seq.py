"""Seq2Seq: the residual, its loss, and that it learns. The rest is in test_fed_back.py."""

import pytest
import torch

from motionlab import datasets
from motionlab.encodings import Normalizer, RootRelative
from motionlab.errors import ModelError
from motionlab.models.floor import ConstantVelocity, ZeroVelocity
from motionlab.models.seq2seq import Seq2Seq


@pytest.fixture(scope="module")
def encoding():
    return RootRelative(datasets.load("gaits", "val")[0].skeleton, fps=30)


@pytest.fixture(scope="module")
def clips(encoding):
    return {
        split: [encoding.encode(clip) for clip in datasets.load("gaits", split)]
        for split in ("train", "val")
    }


def test_layers_are_those_of_the_paper(encoding):
    with torch.device("meta"):
        model = Seq2Seq(encoding, Normalizer(encoding.dim))
    assert (model.gru.hidden_size, model.gru.num_layers, model.seen) == (1024, 1, 50)
    assert {name.split(".")[0] for name, _ in model.named_parameters()} == {"gru", "leave"}


def test_a_network_that_says_nothing_repeats_the_last_frame(encoding, clips):
    model = Seq2Seq(encoding, Normalizer.fit(clips["train"]), width=16, seen=8)
    torch.nn.init.zeros_(model.leave.weight)
    torch.nn.init.zeros_(model.leave.bias)
    windows = torch.stack([clip[20:40] for clip in clips["val"]])
    made = model.generate(30, model.observe(windows))
    torch.testing.assert_close(made, windows[:, -1:].expand(-1, 30, -1), rtol=0, atol=1e-5)
    still = (model.normalizer(windows[:, 7:8]) - model.normalizer(windows[:, 8:])).square().mean()
    torch.testing.assert_close(model.loss(windows), still)


def test_the_loss_is_about_frames_that_follow_its_own(encoding, clips):
    torch.manual_seed(0)
    model = Seq2Seq(encoding, Normalizer.fit(clips["train"]), width=16, seen=8)
    windows = torch.stack([clip[20:40] for clip in clips["val"]])
    made = model.generate(12, model.observe(windows[:, :8]))
    off = model.normalizer(made) - model.normalizer(windows[:, 8:])
    torch.testing.assert_close(model.loss(windows), off.square().mean())
    # what the recorded frames after the first 8 are is asked for, but not shown
    torch.testing.assert_close(model.loss(windows), model.loss(windows, real=torch.arange(20) < 8))
    everything = torch.ones(20, dtype=torch.bool)
    supervised = model(windows)[:, 7:-1]
    off = model.normalizer(supervised) - model.normalizer(windows[:, 8:])
    torch.testing.assert_close(model.loss(windows, real=everything), off.square().mean())


def test_windows_without_a_frame_to_decode(encoding, clips):
    model = Seq2Seq(encoding, Normalizer(encoding.dim), width=16, seen=20)
    windows = torch.stack([clip[:20] for clip in clips["val"]])
    with pytest.raises(ModelError, match="more than the 20 frames"):
        model.loss(windows)
    assert model.loss(torch.stack([clip[:21] for clip in clips["val"]])).isfinite()


@pytest.mark.parametrize("sizes", [{"seen": 0}, {"seen": 2.5}, {"width": 0}])
def test_sizes_that_are_none(encoding, sizes):
    with pytest.raises(ModelError, match="whole number from 1"):
        Seq2Seq(encoding, Normalizer(encoding.dim), **sizes)


def test_it_beats_zero_velocity_at_80_ms(encoding, clips):
    torch.manual_seed(0)
    model = Seq2Seq(encoding, Normalizer.fit(clips["train"]), width=48, seen=10)
    windows = torch.cat([clip.unfold(0, 15, 7).transpose(1, 2) for clip in clips["train"]])
    optimizer = torch.optim.Adam(model.parameters(), 4e-3)
    for _ in range(120):
        optimizer.zero_grad()
        model.loss(windows[torch.randint(len(windows), (32,))]).backward()
        optimizer.step()

    held_out = torch.stack([clip[:150] for clip in clips["val"]])

    def error(method):
        """Distance of the pose (metres, all points together) at 80 ms, frame 2.4 at 30 fps."""
        off = [
            (method.generate(3, method.observe(held_out[:, s - 20 : s])) - held_out[:, s : s + 3])
            for s in range(20, 140, 10)
        ]
        first, second, third = torch.stack(off)[..., encoding.slices["pose"]].norm(dim=-1).unbind(2)
        return (0.6 * second + 0.4 * third).mean().item()

    with torch.no_grad():
        ours = error(model)
        assert ours < 0.7 * error(ZeroVelocity(encoding))
        assert ours < error(ConstantVelocity(encoding))
