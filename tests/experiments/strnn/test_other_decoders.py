"""STRNN with GRU cells and with attention: what they say by hand, what they know, whether they learn."""

import pytest
import torch
from torch import nn

from experiments.strnn.other_decoders import AttentiveStrnn, GruStrnn
from motionlab import Skeleton
from motionlab.datasets import gaits
from motionlab.encodings import BodyFrame, Normalizer
from motionlab.errors import ModelError

KINDS = (GruStrnn, AttentiveStrnn)


@pytest.fixture(scope="module")
def clips():
    encoding = BodyFrame(Skeleton.canonical(), 30)
    made = [encoding.encode(gaits.make(seconds=5, speed=1 + 0.2 * i, seed=i)) for i in range(3)]
    return encoding, torch.stack([clip[:140] for clip in made])


def make(kind, clips, **changes):
    torch.manual_seed(0)
    settings = {"width": 32, "encode": 6, "predict": 4} | changes
    return kind(clips[0], Normalizer.fit(list(clips[1])), **settings)


def gru(cell, x, h):
    """Cho et al. (2014) as torch writes it: what is heard does not pass the gate that h passes."""
    of_x = (x @ cell.weight_ih.T + cell.bias_ih).chunk(3, -1)
    of_h = (h @ cell.weight_hh.T + cell.bias_hh).chunk(3, -1)
    reset, keep = (torch.sigmoid(of_x[i] + of_h[i]) for i in range(2))
    return (1 - keep) * torch.tanh(of_x[2] + reset * of_h[2]) + keep * h


def lstm(cell, x, h, c):
    parts = x @ cell.weight_ih.T + cell.bias_ih + h @ cell.weight_hh.T + cell.bias_hh
    enter, forget, new, show = parts.chunk(4, -1)
    c = forget.sigmoid() * c + enter.sigmoid() * new.tanh()
    return show.sigmoid() * c.tanh(), c


@torch.no_grad()
def by_hand(model, seen):
    """What a network says of seen (batch, encode, kept), cell by cell and frame by frame."""
    attends = isinstance(model, AttentiveStrnn)
    cell = (nn.LSTMCell if attends else nn.GRUCell)(model.kept, model.width)
    cell.load_state_dict({k.removesuffix("_l0"): v for k, v in model.encoder.state_dict().items()})
    first = c_first = torch.zeros(len(seen), model.width)
    read = []
    for x in seen.unbind(1):
        first, c_first = (
            lstm(cell, x, first, c_first) if attends else (gru(cell, x, first), c_first)
        )
        read.append(first)
    said = []
    for part, n in ((model.decoder, model.encode), (model.predictor, model.predict)):
        h, c, frames = first, c_first, []
        for _ in range(n):
            x = model.leave(h)
            if attends:
                scores = torch.cat([part.score(torch.tanh(part.asked(its) + part.wanted(h)))
                                    for its in read], -1)  # fmt: skip
                shares = scores.exp() / scores.exp().sum(-1, keepdim=True)
                looked = sum(shares[:, i : i + 1] * its for i, its in enumerate(read))
                h, c = lstm(part.cell, torch.cat([x, looked], -1), h, c)
            else:
                h = gru(part.cell, x, h)
            frames.append(model.leave(h))
        said.append(torch.stack(frames, 1))
    return torch.cat([said[0].flip(1), said[1]], 1)


@pytest.mark.parametrize("kind", KINDS)
def test_it_says_what_cells_in_a_loop_say(kind, clips):
    model, rows = make(kind, clips), clips[1][:, 20:26]
    wanted = by_hand(model, model.normalizer(rows))
    assert wanted.std() > 0.01  # says something
    assert torch.allclose(model.normalizer(model(rows)), wanted, atol=1e-5)


@pytest.mark.parametrize("kind", KINDS)
def test_every_frame_that_is_read_counts_and_none_that_is_to_be_foretold(kind, clips):
    model, rows = make(kind, clips).train(), clips[1][:, 20:30].clone().requires_grad_()
    said = model.normalizer(model(rows[:, :6])).detach()
    (off,) = torch.autograd.grad(model.loss(rows), rows)
    assert all(float(off[:, t].abs().max()) > 0 for t in range(10))
    # of a frame that is to be foretold the loss knows the error there, and nothing else
    kept, true = model.normalizer.kept, model.normalizer(rows).detach()
    alone = 2 * (true - said)[:, 6:] / true[:, 6:].numel() / model.normalizer.std[kept]
    assert torch.allclose(off[:, 6:, kept], alone, rtol=1e-3, atol=1e-7)


@pytest.mark.parametrize("kind", KINDS)
def test_it_learns_and_goes_on_as_an_strnn_does(kind, clips):
    model, rows = make(kind, clips), clips[1]
    adam, losses = torch.optim.Adam(model.parameters(), lr=3e-3), []
    for update in range(60):
        at = 10 * (update % 12)
        losses.append(model.loss(rows[:, at : at + 10]))
        losses[-1].backward()
        assert all(its.grad.isfinite().all() and its.grad.abs().max() > 0
                   for its in model.parameters())  # fmt: skip
        adam.step()
        adam.zero_grad()
    assert losses[-1].item() < 0.4 * losses[0].item()
    made = model.extrapolate(rows[:, :8], 9)
    assert made.shape == (3, 9, 73)
    assert torch.allclose(made[:, :4], model(rows[:, 2:8])[:, 6:], atol=1e-5)
    code = model.code(rows[:, 2:8])
    assert code.shape == (3, model.codes * model.width)
    assert torch.allclose(model.say(code), model(rows[:, 2:8]), atol=1e-5)
    again = kind.from_config(model.config())
    again.load_state_dict(model.state_dict())
    assert torch.equal(again.extrapolate(rows[:, :8], 9), made)


def test_attention_looks_where_it_has_learned_to_look(clips):
    """And is a mean: of equal scores all frames have equal shares."""
    part = make(AttentiveStrnn, clips).predictor
    read, h = torch.randn(2, 6, 32), torch.randn(2, 32)
    nn.init.zeros_(part.score.weight)
    assert torch.allclose(part.weights(part.asked(read), h), torch.full((2, 6, 1), 1 / 6))
    nn.init.zeros_(part.wanted.weight)
    nn.init.eye_(part.asked.weight)
    nn.init.constant_(part.score.weight, 5.0)
    read[:, 3] = 2.0  # larger than any other
    assert (part.weights(part.asked(read), h)[:, 3] > 0.9).all()


def test_numbers_that_make_no_sense(clips):
    for kind in KINDS:
        for bad in ({"width": 12}, {"encode": 0}, {"smooth": -1.0}):
            with pytest.raises(ModelError, match="Strnn"):
                make(kind, clips, **bad)
