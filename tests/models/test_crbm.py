"""A CRBM: its energies by counting all hidden units, its gradient, and that it learns what goes on."""

import itertools
import math

import pytest
import torch

from motionlab import Skeleton
from motionlab.encodings import BodyFrame, Normalizer
from motionlab.errors import ModelError
from motionlab.models.crbm import Crbm


@pytest.fixture
def clips():
    """Waves of two periods, a little noise on them."""
    chance = torch.Generator().manual_seed(0)
    phases = 6.28 * torch.rand(73, generator=chance)
    waves = [
        torch.sin(torch.arange(200)[:, None] / period + phases + start)
        for period, start in ((3.0, 0.0), (5.0, 1.0))
    ]
    return [wave + 0.01 * torch.randn(wave.shape, generator=chance) for wave in waves]


def made(clips, width=4, order=2, seed=0):
    torch.manual_seed(seed)
    crbm = Crbm(BodyFrame(Skeleton.canonical(), 30), Normalizer.fit(clips), width, order)
    with torch.no_grad():
        for its in crbm.parameters():
            its.normal_(std=0.3)
    return crbm


def energy(crbm, v, h, u):
    """E(v, h | u), as the paper writes it."""
    straight = crbm.ahead.bias + crbm.ahead.weight @ u
    leading = crbm.lead.bias + crbm.lead.weight @ u
    return (v - straight).square().sum() / 2 - leading @ h - v @ crbm.pairs @ h


def test_free_energy_and_odds_by_counting_all_hidden_units(clips):
    crbm = made(clips).double()
    chance = torch.Generator().manual_seed(1)
    v, u = (torch.randn(n, generator=chance).double() for n in (73, 146))
    states = [torch.tensor(bits).double() for bits in itertools.product((0.0, 1.0), repeat=4)]
    energies = torch.stack([energy(crbm, v, h, u) for h in states])
    assert torch.isclose(crbm.free_energy(v, u), -(-energies).logsumexp(0), rtol=1e-10)
    likely = (-energies).softmax(0)
    assert torch.allclose(crbm._on(v, u).sigmoid(), likely @ torch.stack(states), atol=1e-9)


def test_the_gradient_is_that_of_contrastive_divergence(clips):
    crbm = made(clips)
    windows = torch.stack([clip[:3] for clip in clips])  # one frame after two
    crbm.loss(windows, torch.tensor([7])).backward()
    true = crbm.normalizer(windows)
    past, v = true[:, :2].flatten(1), true[:, 2]
    other = crbm._gibbs(v[:, None], past[:, None], torch.Generator().manual_seed(7))[:, 0]
    on, off = (crbm._on(its, past).sigmoid() for its in (v, other))
    scale = 1 / (2 * 73)  # two windows, channels
    assert torch.allclose(crbm.pairs.grad, -scale * (v.T @ on - other.T @ off), atol=1e-5)
    assert torch.allclose(crbm.lead.weight.grad, -scale * (on - off).T @ past, atol=1e-5)
    assert torch.allclose(crbm.ahead.weight.grad, -scale * (v - other).T @ past, atol=1e-5)
    assert float(crbm.pairs.grad.abs().max()) > 1e-3


def test_what_it_foretells_is_the_likeliest_around(clips):
    crbm = made(clips)
    with torch.no_grad():
        crbm.pairs *= 0.3  # so that the rounds come to rest
    seen = clips[0][:2]
    after = crbm.normalizer(crbm.extrapolate(seen, 1))[0]
    past = crbm.normalizer(seen).flatten()
    here = after.clone().requires_grad_()
    (slope,) = torch.autograd.grad(crbm.free_energy(here, past), here)
    assert float(slope.detach().norm()) < 1e-3
    step = 0.1 * torch.randn(20, 73, generator=torch.Generator().manual_seed(0))
    assert bool((crbm.free_energy(after + step, past) > crbm.free_energy(after, past)).all())


def test_it_learns_how_waves_go_on_and_goes_on_with_its_own_frames(clips):
    torch.manual_seed(0)
    crbm = Crbm(BodyFrame(Skeleton.canonical(), 30), Normalizer.fit(clips), 16, 2)
    windows = torch.cat([clip.unfold(0, 20, 5).mT for clip in clips])
    optimizer = torch.optim.Adam(crbm.parameters(), 3e-3)
    for update in range(400):
        optimizer.zero_grad()
        crbm.loss(windows, torch.tensor([update])).backward()
        optimizer.step()
    crbm.eval()
    still = (windows[:, 2:] - windows[:, 1:-1]).square().mean()  # nobody moves
    error = float(crbm.loss(windows).detach())
    assert error < 0.2 * float(still / crbm.normalizer.std.square().mean())
    both = crbm.extrapolate(windows[:2, :6], 10)
    again = crbm.extrapolate(torch.cat([windows[:2, :6], both[:, :4]], 1), 6)
    assert torch.allclose(both[:, 4:], again, atol=1e-4)
    assert torch.allclose(crbm.extrapolate(windows[0, :6], 10), both[0], atol=1e-5)
    assert float((both - windows[:2, 6:16]).square().mean()) < float(
        (windows[:2, 5:6] - windows[:2, 6:16]).square().mean()
    )


def test_it_is_built_again_from_its_settings(clips):
    crbm = made(clips, 5, 3)
    again = Crbm.from_config(crbm.config())
    again.load_state_dict(crbm.state_dict())
    assert torch.equal(again.extrapolate(clips[0][:9], 4), crbm.extrapolate(clips[0][:9], 4))


def test_what_it_can_not_read(clips):
    crbm = made(clips)
    with pytest.raises(ModelError, match="reads 2"):
        crbm.extrapolate(clips[0][:1], 3)
    with pytest.raises(ModelError, match="NaN"):
        crbm.extrapolate(clips[0][:6] * math.nan, 3)
    with pytest.raises(ModelError, match="0 frames"):
        crbm.extrapolate(clips[0][:6], 0)
    with pytest.raises(ModelError, match="more than the 2"):
        crbm.loss(clips[0][None, :2])
    with pytest.raises(ModelError, match="order"):
        made(clips, order=0)
