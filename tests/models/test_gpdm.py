"""A GPDM: its cost by densities written out, its process by conditioning, and that it goes on in a circle."""

import math

import pytest
import torch
from torch.distributions import MultivariateNormal, Normal

from motionlab import Skeleton
from motionlab.encodings import BodyFrame, Normalizer
from motionlab.errors import ModelError
from motionlab.models import gpdm
from motionlab.models.gpdm import Gpdm

BODY = BodyFrame(Skeleton.canonical(), 30)


def waves(frames, start=0.0, noise=0.01):
    """A loop of 20 frames in all channels, which are mixtures of its sine and cosine."""
    chance = torch.Generator().manual_seed(0)
    phases = 6.28 * torch.rand(73, generator=chance)
    turn = (torch.arange(frames)[:, None] + start) * 2 * math.pi / 20
    return (turn + phases).sin() + noise * torch.randn(frames, 73, generator=chance)


@pytest.fixture(scope="module")
def learned():
    clips = [waves(60, start) for start in (0.0, 7.0)]
    torch.manual_seed(0)
    return clips, Gpdm.fit(BODY, Normalizer.fit(clips), clips, 2, length=40, frames=80, updates=150)


def kernel(scales, a, b):
    """The kernel of the paper's eq. 8 and 12 without noise, point by point."""
    size, near, lines, _ = scales.exp()
    return torch.stack([
        torch.stack([size * (-near / 2 * (p - q).square().sum()).exp() + lines * (p @ q) for q in b])
        for p in a
    ])  # fmt: skip


def test_the_cost_is_minus_the_log_of_the_densities(learned):
    clips, _ = learned
    model = Gpdm.fit(BODY, Normalizer.fit(clips), clips, 2, length=5, frames=10, updates=2)

    def by_hand():
        noisy = lambda scales, x: kernel(scales, x, x) + scales[3].exp() * torch.eye(len(x))
        frames = MultivariateNormal(torch.zeros(10).double(), noisy(model.of_frames, model.points))
        rows = [0, 1, 2, 3, 5, 6, 7, 8]
        moves = MultivariateNormal(
            torch.zeros(8).double(), noisy(model.of_moves, model.points[rows])
        )
        follow = model.points[[i + 1 for i in rows]]
        total = frames.log_prob(model.rows.mT).sum() + moves.log_prob(follow.mT).sum()
        total = total + Normal(0, 1).log_prob(model.points[[0, 5]]).sum()
        return model.of_frames[[0, 1, 3]].sum() + model.of_moves.sum() - total

    ours, plain = [model.cost().detach()], [by_hand().detach()]
    with torch.no_grad():
        model.points += 0.3
        model.of_frames += 0.2
        model.of_moves -= 0.1
    ours.append(model.cost().detach())
    plain.append(by_hand().detach())
    assert torch.isclose(ours[1] - ours[0], plain[1] - plain[0], rtol=1e-6)
    assert abs(float(ours[1] - ours[0])) > 1


def test_a_process_is_what_conditioning_gives(learned):
    _, model = learned
    process = gpdm._Process(model.of_frames, model.points[:12], model.rows[:12])
    chance = torch.Generator().manual_seed(1)
    new = torch.randn(1, 2, generator=chance).double()
    every = torch.cat([model.points[:12].detach(), new])
    both = kernel(model.of_frames.detach(), every, every)
    both += model.of_frames.detach()[3].exp() * torch.eye(13)
    gain = torch.linalg.solve(both[:12, :12], both[:12, 12])
    assert torch.allclose(process.mean(new)[0], gain @ model.rows[:12], atol=1e-6)
    spread = (both[12, 12] - gain @ both[:12, 12]).sqrt()
    seen = torch.randn(1, model.rows.shape[1], generator=chance).double()
    there = Normal(gain @ model.rows[:12], spread)
    constant = model.rows.shape[1] * math.log(2 * math.pi) / 2
    wanted = -there.log_prob(seen[0]).sum() - constant
    assert torch.isclose(process.minus_log(new, seen)[0], wanted, rtol=1e-6)
    far = process.mean(torch.full((1, 2), 1e3).double())
    assert float(far.abs().max()) < 1e-3  # knows nothing there: the mean frame


def test_learning_makes_it_likelier_and_it_goes_round(learned):
    clips, model = learned
    first = Gpdm.fit(BODY, Normalizer.fit(clips), clips, 2, length=40, frames=80, updates=1)
    assert float(model.cost().detach()) < float(first.cost().detach()) - 100
    seen, after = waves(30, 3.0), waves(50, 3.0)[30:]  # a start that no clip has
    made = model.extrapolate(seen, 20)
    assert float((made - after).square().mean()) < 0.1 * float(after.square().mean())
    assert torch.allclose(model.extrapolate(torch.stack([seen, seen]), 20)[1], made, atol=1e-4)
    assert torch.allclose(model.extrapolate(seen, 5), made[:5], atol=1e-5)


def test_pieces_come_from_the_middle_and_are_spread(learned):
    clips = [
        torch.full((n, 73), float(i)) + torch.randn(n, 73) for i, n in enumerate([9, 4, 12, 9])
    ]
    model = Gpdm.fit(BODY, Normalizer.fit(clips), clips, 2, length=6, frames=12, updates=1)
    wanted = [clips[0][1:7], clips[2][3:9]]  # one is too short, of three two are taken
    assert torch.allclose(
        model.normalizer.inverse(model.rows.float()), torch.cat(wanted), atol=1e-4
    )
    assert model.before.tolist() == [0, 1, 2, 3, 4, 6, 7, 8, 9, 10]


def test_what_it_can_not_do(learned):
    clips, model = learned
    normalizer = Normalizer.fit(clips)
    with pytest.raises(ModelError, match="reads 5"):
        model.extrapolate(clips[0][:4], 3)
    with pytest.raises(ModelError, match="NaN"):
        model.extrapolate(clips[0][:6] * math.nan, 3)
    with pytest.raises(ModelError, match="0 frames"):
        model.extrapolate(clips[0][:6], 0)
    with pytest.raises(ModelError, match="learned nothing"):
        Gpdm(BODY, normalizer).extrapolate(clips[0], 1)
    with pytest.raises(ModelError, match="as their cube"):
        Gpdm.fit(BODY, normalizer, clips, frames=9_000)
    with pytest.raises(ModelError, match="none of 2 clips has 70"):
        Gpdm.fit(BODY, normalizer, clips, length=70)
    with pytest.raises(ModelError, match="updates"):
        Gpdm.fit(BODY, normalizer, clips, updates=0)
