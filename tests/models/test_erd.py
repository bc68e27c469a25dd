"""Erd: its layers and its noise. What it shares with others is in test_fed_back.py."""

import math

import pytest
import torch
from torch import nn

from motionlab import Skeleton
from motionlab.encodings import Normalizer, RootRelative
from motionlab.errors import ModelError
from motionlab.models.erd import Erd, noise_schedule


@pytest.fixture(scope="module")
def encoding():
    return RootRelative(Skeleton.canonical())


def test_layers_are_those_of_the_paper(encoding):
    with torch.device("meta"):
        model = Erd(encoding, Normalizer(encoding.dim))
    sizes = lambda part: [(m.in_features, m.out_features) for m in part if isinstance(m, nn.Linear)]
    assert sizes(model.enter) == [(78, 500), (500, 500)]
    assert (model.lstm.input_size, model.lstm.hidden_size, model.lstm.num_layers) == (500, 1000, 2)
    assert sizes(model.leave) == [(1000, 500), (500, 100), (100, 78)]
    # a non-linearity after each but the last, whose words may be negative
    assert [type(m).__name__ for m in model.leave][1::2] == ["ReLU", "ReLU"]
    assert isinstance(model.leave[-1], nn.Linear) and isinstance(model.enter[-1], nn.ReLU)


@pytest.mark.parametrize("width", [9, 0, 100.0, "wide"])
def test_a_width_that_leaves_no_tenth(encoding, width):
    with pytest.raises(ModelError, match="whole number from 10"):
        Erd(encoding, Normalizer(encoding.dim), width=width)


def test_a_narrow_decoder_holds_poses_to_few_dimensions(encoding):
    torch.manual_seed(0)
    model = Erd(encoding, Normalizer(encoding.dim), width=40)
    said = model(torch.randn(30, 20, encoding.dim)).flatten(0, 1)
    assert torch.linalg.matrix_rank(said - said.mean(0), atol=1e-3) <= 4


def test_noise_is_that_of_the_published_schedule():
    updates = [
        0,
        249,
        250,
        499,
        500,
        999,
        1000,
        1299,
        1300,
        1999,
        2000,
        2499,
        2500,
        3299,
        3300,
        5e3,
    ]
    noise = [0, 0, 0.01, 0.01, 0.05, 0.05, 0.1, 0.1, 0.2, 0.2, 0.3, 0.3, 0.5, 0.5, 0.7, 0.7]
    assert [noise_schedule(update / 5000) for update in updates] == noise


@pytest.mark.parametrize("progress", [-0.01, 1.01, math.nan])
def test_progress_is_a_share(progress):
    with pytest.raises(ModelError, match="from 0 to 1"):
        noise_schedule(progress)


def test_it_learns_to_go_round_a_circle(encoding):
    g = torch.Generator().manual_seed(0)
    phase = 0.3 * torch.arange(30) + 6.28 * torch.rand(16, 1, generator=g)
    axes = torch.linalg.qr(torch.randn(encoding.dim, 2, generator=g))[0] * encoding.dim**0.5
    clips = torch.stack([phase.cos(), phase.sin()], -1) @ axes.T  # (16, 30, dim), variance about 1
    torch.manual_seed(0)
    model = Erd(encoding, Normalizer(encoding.dim), width=40)
    optimizer = torch.optim.Adam(model.parameters(), 1e-2)
    for update in range(80):
        noise = noise_schedule(update / 80) * torch.randn(clips.shape, generator=g)
        optimizer.zero_grad()
        model.loss(clips, noise).backward()
        optimizer.step()
    with torch.no_grad():
        made = model.generate(10, model.observe(clips[:, :20]))
    off = (made - clips[:, 20:]).square().mean()
    assert off < 0.2 * (clips[:, 19:20] - clips[:, 20:]).square().mean()  # standing still
