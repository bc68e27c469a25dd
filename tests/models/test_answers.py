"""The density straight from a network's numbers, against the mixture that says what is meant."""

import pytest
import torch

from motionlab import Skeleton
from motionlab.encodings import JointAngles, Normalizer
from motionlab.models import LstmGmm
from motionlab.models.answers import NO_SHARE, log_density


@pytest.fixture(scope="module")
def model():
    torch.manual_seed(0)
    encoding = JointAngles(Skeleton.canonical(), contacts=True)
    return LstmGmm(encoding, Normalizer(encoding.dim), width=16, skip=0.9).double()


@pytest.fixture(scope="module")
def clips(model):
    chance = torch.Generator().manual_seed(1)
    return [
        scale * torch.randn(3, 5, model.encoding.dim, dtype=torch.double, generator=chance)
        for scale in (1, 0.05)
    ]


def plain(model, features, noise):
    mixture = model(features[:, :-1], noise[:, :-1])
    return mixture.log_prob(model.normalizer(features[:, 1:]))


def test_is_the_density_of_the_mixture(model, clips):
    torch.testing.assert_close(model.log_prob(*clips), plain(model, *clips))


def test_has_its_slope_in_weights_and_features(model, clips):
    features, noise = clips[0].clone().requires_grad_(), clips[1]
    slopes = [
        torch.autograd.grad((density(features, noise) ** 2).sum(), [features, *model.parameters()])
        for density in (model.log_prob, lambda *of: plain(model, *of))
    ]
    for fast, slow in zip(*slopes, strict=True):
        torch.testing.assert_close(fast, slow)


def test_a_component_that_is_far_away_has_no_slope():
    numbers = torch.zeros(1, 2 * (1 + 2 * 4))
    numbers[0, 2:6] = 30  # means of the first
    numbers.requires_grad_()
    floor = torch.full((4,), 0.01)
    log_density(numbers, torch.zeros(1, 4), 2, 1.0, floor).sum().backward()
    of_first, of_second = numbers.grad[0, 2:].unflatten(0, (2, 2, 4)).unbind(1)
    assert NO_SHARE > 0 and (of_first == 0).all() and (of_second[1] != 0).all()
