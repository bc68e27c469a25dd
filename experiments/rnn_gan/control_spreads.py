"""How exact people are: what the variances of `solvers.terms` were taken from.

python -m experiments.rnn_gan.control_spreads [--model lstm-gmm-contacts]

Recorded motion keeps no wish to the centimetre: roots sway about their way, speeds change within a
stride, resting toes roll. A wish that is held tighter than people hold it makes motion stiff.
"""

from __future__ import annotations

import argparse
import time

import torch
from torch import Tensor

import motionlab
from motionlab.encodings import Encoding
from motionlab.feet.contacts import foot_points, rest_heights
from motionlab.metrics import facing
from motionlab.training import Prepared
from motionlab.weights import find

from ..common import record

WINDOW = 34  # frames
STRIDE = 1.1  # seconds, of a walk
FRAMES = 300  # of a sample
MOVING = 0.5  # m/s: slower clips go nowhere
TOES = [1, 3]


def main(arguments: list[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--data", default="locomotion")
    parser.add_argument("--model", default="lstm-gmm-contacts")
    parser.add_argument("--output", default="results/control_spreads.json")
    chosen = parser.parse_args(arguments)
    begin, data = time.perf_counter(), Prepared.find(chosen.data)
    model = motionlab.load(chosen.model)
    with torch.no_grad():
        chance = torch.Generator().manual_seed(0)
        sampled = model.generate(FRAMES, model.starts, generator=chance, **model.sampling)
    found = {
        "weights": record.about_weights(model, find(chosen.model)),
        "recorded": spreads(data.encoding, data.clips("val")),
        "sampled": spreads(model.encoding, list(sampled)),
    }
    record.write(record.provenance(begin, 0, data) | found, chosen.output)


def spreads(encoding: Encoding, clips: list[Tensor]) -> dict[str, float]:
    """Root mean squares over all frames of clips (frames, dim) that go somewhere."""
    each: dict[str, list[Tensor]] = {}
    long = [clip for clip in clips if len(clip) > WINDOW + round(STRIDE * encoding.fps)]
    moving = [c for c in long if c[:, :2].mean(0).norm() * encoding.fps > MOVING]
    for clip in moving:
        for name, values in _of_clip(encoding, clip).items():
            each.setdefault(name, []).append(values.flatten())
    pooled = {name: torch.cat(values) for name, values in each.items()}
    return {"clips": len(moving)} | {
        name: float(values.double().square().mean().sqrt()) for name, values in pooled.items()
    }


def _of_clip(encoding: Encoding, clip: Tensor) -> dict[str, Tensor]:
    fps, points = encoding.fps, encoding.positions(clip)
    toes = points[:, [foot_points(encoding.skeleton)[i] for i in TOES]]
    down = encoding.contacts(clip) > 0.5
    held = down[1:] & down[:-1]
    low = rest_heights(encoding.skeleton)[TOES]
    ground = points[:, 0, [0, 2]]
    stride = round(STRIDE * fps) // 2 * 2 + 1
    mean = ground.unfold(0, stride, 1).mean(-1)  # the way, without what repeats each stride
    way = mean[2:] - mean[:-2]
    way = way / way.norm(dim=-1, keepdim=True).clamp(min=1e-6)
    aside = ground[stride // 2 :][1 : len(way) + 1] - mean[1:-1]
    moved = clip[1:, :2].norm(dim=-1) * fps
    windows = moved.unfold(0, WINDOW, 1).mean(-1)
    going = torch.atan2(way[:, 0], way[:, 1])
    faces = facing(points, encoding.skeleton)[stride // 2 :][1 : len(way) + 1]
    off = torch.remainder(faces - going + torch.pi, 2 * torch.pi) - torch.pi
    return {
        "toe slide in contact (m a frame)": toes.diff(dim=0)[..., [0, 2]].norm(dim=-1)[held],
        "toe height in contact (m)": (toes[..., 1] - low)[down],
        "root aside of its mean way (m)": aside[:, 0] * way[:, 1] - aside[:, 1] * way[:, 0],
        "root along its mean way (m)": (aside * way).sum(-1),
        "speed of a window about the clip's mean (m/s)": windows - moved.mean(),
        "facing about the way (rad)": off[off.abs() < 1],
    }


if __name__ == "__main__":
    record.run(main)
