"""The bidirectional RNN: STRNN's scheme with plain layers that read from both ends."""

import pytest
import torch

import motionlab
from motionlab import Skeleton
from motionlab.datasets import gaits
from motionlab.encodings import BodyFrame, Normalizer
from motionlab.errors import ModelError
from motionlab.models import BidirectionalRnn
from motionlab.training.checkpoints import save_weights


@pytest.fixture(scope="module")
def clips():
    encoding = BodyFrame(Skeleton.canonical(), 30)
    made = [encoding.encode(gaits.make(seconds=5, speed=1 + 0.2 * i, seed=i)) for i in range(3)]
    return encoding, torch.stack([clip[:140] for clip in made])


def make(clips, **changes):
    torch.manual_seed(0)
    settings = {"width": 32, "encode": 6, "predict": 4} | changes
    return BidirectionalRnn(clips[0], Normalizer.fit(list(clips[1])), **settings)


def read(encoder, frames, suffix):
    """h after frames (batch, n, kept), cell by cell."""
    weights = {name: getattr(encoder, f"{name}_l0{suffix}") for name in
               ("weight_ih", "weight_hh", "bias_ih", "bias_hh")}  # fmt: skip
    h = torch.zeros(len(frames), 16)
    for frame in frames.unbind(1):
        h = torch.tanh(frame @ weights["weight_ih"].T + weights["bias_ih"]
                       + h @ weights["weight_hh"].T + weights["bias_hh"])  # fmt: skip
    return h


@torch.no_grad()
def test_it_says_what_a_loop_of_cells_says(clips):
    model = make(clips)
    seen = model.normalizer(clips[1][:, 20:26])
    state = torch.cat(
        [read(model.encoder, seen, ""), read(model.encoder, seen.flip(1), "_reverse")], 1
    )
    said = []
    for part, n in ((model.decoder, 6), (model.predictor, 4)):
        h, frames = state, []
        for _ in range(n):
            h = torch.tanh(part.heard(model.leave(h)) + part.own(h))
            frames.append(model.leave(h))
        said.append(torch.stack(frames, 1))
    wanted = torch.cat([said[0].flip(1), said[1]], 1)
    assert torch.allclose(model.normalizer(model(clips[1][:, 20:26])), wanted, atol=1e-5)


def test_it_learns_and_goes_on_as_an_strnn_does(clips, tmp_path):
    model, rows = make(clips, smooth=0.1), clips[1]
    adam = torch.optim.Adam(model.parameters(), lr=3e-3)
    losses = []
    for update in range(60):
        at = 10 * (update % 12)
        losses.append(model.loss(rows[:, at : at + 10]))
        losses[-1].backward()
        adam.step()
        adam.zero_grad()
    assert losses[-1].item() < 0.4 * losses[0].item()
    assert all(its.grad is None or its.isfinite().all() for its in model.parameters())
    model.requires_grad_(False)  # as a loaded one: with gradients some processors round otherwise
    made = model.extrapolate(rows[:, :8], 9)
    assert made.shape == (3, 9, 73)
    assert torch.allclose(made[:, :4], model(rows[:, 2:8])[:, 6:], atol=1e-5)
    assert torch.allclose(model.say(model.code(rows[:, 2:8])), model(rows[:, 2:8]), atol=1e-5)
    assert model.project(rows[:, :20]).shape == (3, 20, 73)
    save_weights(tmp_path / "b.safetensors", model, {})
    again = motionlab.load(tmp_path / "b.safetensors")
    assert isinstance(again, BidirectionalRnn)
    assert torch.equal(again.extrapolate(rows[:, :8], 9), made)


def test_both_ends_are_read(clips):
    model, rows = make(clips), clips[1][:, 20:26].clone().requires_grad_()
    model(rows)[:, 6:].sum().backward()
    assert all(float(rows.grad[:, t].abs().max()) > 0 for t in range(6))


def test_numbers_that_make_no_sense(clips):
    for bad in ({"width": 12}, {"encode": 0}, {"smooth": -1.0}):
        with pytest.raises(ModelError, match="Strnn"):
            make(clips, **bad)
    with pytest.raises(ModelError, match="6"):
        make(clips).extrapolate(clips[1][:, :5], 3)
