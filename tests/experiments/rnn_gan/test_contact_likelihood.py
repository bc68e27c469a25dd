"""Contacts marginalised out, against torch.distributions and where the answer is known."""

import pytest
import torch
from torch.distributions import Categorical, Independent, MixtureSameFamily, Normal

from experiments.rnn_gan import contact_likelihood
from motionlab.models import LstmGmm
from motionlab.models.lstm_gmm import Mixture


@pytest.fixture
def model(gaits):
    torch.manual_seed(0)
    return LstmGmm(gaits.encoding, gaits.normalizer, width=16, components=3, skip=0.5).eval()


@pytest.fixture
def mixture():
    generator = torch.Generator().manual_seed(0)
    random = lambda *shape: torch.randn(shape, generator=generator)
    return Mixture(random(5, 3).log_softmax(-1), random(5, 3, 6), random(5, 3, 6).exp())


def test_marginal_density(mixture):
    values = torch.randn(5, 4)
    parts = Independent(Normal(mixture.means[..., :4], mixture.stds[..., :4]), 1)
    true = MixtureSameFamily(Categorical(logits=mixture.log_weights), parts)
    found = contact_likelihood.without_contacts(mixture, 4).log_prob(values)
    torch.testing.assert_close(found, true.log_prob(values))


def test_guessed_contacts_follow_bayes(mixture):
    """Their mean is that of the mixture, weighed by how well each component fits the motion."""
    values, count = torch.randn(5, 6), 4
    parts = Normal(mixture.means[..., :count], mixture.stds[..., :count])
    fit = mixture.log_weights + parts.log_prob(values[:, None, :count]).sum(-1)
    wanted = (fit.softmax(-1)[..., None] * mixture.means[..., count:]).sum(1)
    many = Mixture(*(part.repeat_interleave(20_000, 0) for part in mixture))
    drawn = contact_likelihood.contacts_given(
        many, values.repeat_interleave(20_000, 0), count, torch.Generator().manual_seed(1)
    )
    torch.testing.assert_close(drawn.reshape(5, -1, 2).mean(1), wanted, atol=0.08, rtol=0)


@torch.no_grad()
def test_where_contacts_tell_nothing_guesses_are_as_good_as_labels(model, gaits):
    shared = gaits.without_contacts().encoding.dim
    count = contact_likelihood.motion_channels(model, shared)
    model.enter[0].weight[:, count:] = 0  # blind to contacts
    clips = [clip[: 30 + 7 * i] for i, clip in enumerate(gaits.clips("val")[:3])]
    own = contact_likelihood.with_own(model, clips, shared)
    for clip, log in zip(clips, own, strict=True):
        torch.testing.assert_close(
            log, contact_likelihood.with_labels(model, clip, shared), atol=2e-3, rtol=1e-4
        )


@torch.no_grad()
def test_where_they_tell_much_guesses_are_worse(model, gaits):
    shared = gaits.without_contacts().encoding.dim
    model.enter[0].weight[:, contact_likelihood.motion_channels(model, shared) :] *= 30
    clip = gaits.clips("val")[0][:40]
    own = contact_likelihood.with_own(model, [clip], shared)[0]
    assert own.isfinite().all()
    assert (own - contact_likelihood.with_labels(model, clip, shared)).abs().max() > 0.1
