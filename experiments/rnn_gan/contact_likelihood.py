"""W4, in part: do contact channels help the generator to foresee motion?

    python -m experiments.rnn_gan.contact_likelihood [--plain lstm-gmm] [--contacts lstm-gmm-contacts]

Log-likelihood of held-out frames on the channels that both generators have. Contacts are
marginalised out of each mixture: of a Gaussian with diagonal covariance that means left out.

What the contact generator is told of the past is another matter. The labels of a frame are made
from the feet's speeds about it, the next frame included: with them it would look ahead. So it is
given contacts of its own: 32 guesses, drawn frame by frame from its mixture given the true motion,
and weighed by how well each foresees that motion (a bootstrap particle filter, Gordon et al. 1993);
what this estimates is the density of the motion alone.
"""

from __future__ import annotations

import argparse
import time

import torch
from torch import Tensor

import motionlab
from motionlab import metrics
from motionlab.models.lstm_gmm import LstmGmm, Mixture, State
from motionlab.training import Prepared
from motionlab.weights import find

from ..common import record

PARTICLES = 32


def main(arguments: list[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--plain", default="lstm-gmm")
    parser.add_argument("--contacts", default="lstm-gmm-contacts")
    parser.add_argument("--data", default="locomotion")
    parser.add_argument("--split", default="test", choices=("val", "test"))
    parser.add_argument("--output", default="results/contact_likelihood.json")
    chosen = parser.parse_args(arguments)
    begin = time.perf_counter()
    plain, contact = motionlab.load(chosen.plain), motionlab.load(chosen.contacts)
    if plain.about["data"] != contact.about["data"]:  # nor would they count in the same units
        raise motionlab.MotionLabError("The two generators were trained on different data.")
    data = Prepared.find(chosen.data)
    clips = [clip for clip in data.clips(chosen.split) if len(clip) > 1]
    shared = plain.encoding.dim
    with torch.no_grad():
        found = {
            "plain": [plain.log_prob(clip[None, :, :shared])[0] for clip in clips],
            "labels": [with_labels(contact, clip, shared) for clip in clips],
            "own contacts": with_own(contact, clips, shared),
        }
    lengths = [len(clip) - 1 for clip in clips]
    sums = {name: [float(log.sum()) for log in logs] for name, logs in found.items()}
    gains = {
        name: [a - b for a, b in zip(sums[name], sums["plain"], strict=True)]
        for name in ("labels", "own contacts")
    }
    result = {
        "split": chosen.split,
        "clips": len(clips),
        "frames": sum(lengths),
        "particles": PARTICLES,
        "weights": {
            name: record.about_weights(model, find(path))
            for name, model, path in (
                ("plain", plain, chosen.plain), ("contacts", contact, chosen.contacts)
            )
        },
        "nats a frame": {name: a_frame(each, lengths) for name, each in sums.items()},
        "contacts minus plain": {name: a_frame(each, lengths) for name, each in gains.items()},
    }  # fmt: skip
    record.write(record.provenance(begin, 0, data) | result, chosen.output)


def a_frame(sums: list[float], lengths: list[int]) -> metrics.Interval:
    """Mean over all frames; the interval over clips."""
    return metrics.bootstrap(
        list(zip(sums, lengths, strict=True)),
        lambda some: sum(total for total, _ in some) / sum(n for _, n in some),
    )


def without_contacts(mixture: Mixture, count: int) -> Mixture:
    """The mixture over the first channels alone."""
    return Mixture(mixture.log_weights, mixture.means[..., :count], mixture.stds[..., :count])


def motion_channels(model: LstmGmm, shared: int) -> int:
    """How many of the kept channels are no contacts; these come last."""
    return int((model.normalizer.kept < shared).sum())


def with_labels(model: LstmGmm, clip: Tensor, shared: int) -> Tensor:
    """Log-likelihood (frames - 1,) of the motion in a clip (frames, dim), contacts given."""
    count = motion_channels(model, shared)
    values = model.normalizer(clip[None, 1:])[..., :count]
    return without_contacts(model(clip[None, :-1]), count).log_prob(values)[0]


def with_own(model: LstmGmm, clips: list[Tensor], shared: int, seed: int = 0) -> list[Tensor]:
    """The same (frames - 1,) of each clip, with contacts that the network guesses itself.

    The first frame's are drawn as often as feet are down in the training clips.
    """
    generator = torch.Generator().manual_seed(seed)
    found = []
    # clips of about one length at a time: all go on until the longest of them ends
    order = sorted(range(len(clips)), key=lambda i: len(clips[i]))
    for some in (order[i : i + 16] for i in range(0, len(order), 16)):
        padded = torch.nn.utils.rnn.pad_sequence([clips[i] for i in some], batch_first=True)
        logs = _filtered(model, padded, shared, generator)  # (clips, frames - 1)
        found += [logs[row, : len(clips[i]) - 1] for row, i in enumerate(some)]
    return [found[order.index(i)] for i in range(len(clips))]


def _filtered(model: LstmGmm, clips: Tensor, shared: int, generator: torch.Generator) -> Tensor:
    """Log-likelihoods (clips, frames - 1) of the motion in clips (clips, frames, dim)."""
    batch, frames, _ = clips.shape
    count = motion_channels(model, shared)
    x = clips[:, 0].repeat_interleave(PARTICLES, 0)
    chances = model.normalizer.mean[shared:].expand(len(x), -1)
    x[:, shared:] = torch.bernoulli(chances, generator=generator)
    mixture, state = model.step(x, model.zero_state(len(x)))
    logs = []
    for frame in range(1, frames):
        x = clips[:, frame].repeat_interleave(PARTICLES, 0)
        values = model.normalizer(x)
        fit = without_contacts(mixture, count)
        each = fit.log_prob(values[:, :count]).reshape(batch, PARTICLES)
        logs.append(each.logsumexp(1) - torch.tensor(float(PARTICLES)).log())
        guessed = contacts_given(mixture, values, count, generator)
        x = model.normalizer.inverse(torch.cat([values[:, :count], guessed], -1))
        mixture, state = model.step(x, state)
        # those that foresaw the motion well go on, the others are forgotten
        chosen = torch.multinomial(each.softmax(1), PARTICLES, True, generator=generator)
        rows = (chosen + PARTICLES * torch.arange(batch)[:, None]).flatten()
        mixture, state = (
            Mixture(*(part[rows] for part in mixture)),
            State(*(p[rows] for p in state)),
        )
    return torch.stack(logs, 1)


def contacts_given(
    mixture: Mixture, values: Tensor, count: int, generator: torch.Generator
) -> Tensor:
    """Contacts (rows, kept - count) drawn from mixtures (rows, M, kept), the motion being given."""
    means, stds = mixture.means[..., :count], mixture.stds[..., :count]
    each = -(((values[:, None, :count] - means) / stds).square() / 2 + stds.log()).sum(-1)
    chances = (mixture.log_weights + each).softmax(-1)  # of the components, after the fact
    chosen = torch.multinomial(chances, 1, generator=generator)[:, 0]
    rows = torch.arange(len(chosen))
    means, stds = mixture.means[rows, chosen, count:], mixture.stds[rows, chosen, count:]
    return means + stds * torch.randn(means.shape, generator=generator)


if __name__ == "__main__":
    record.run(main)
