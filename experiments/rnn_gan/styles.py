"""W11: which styles does the generator visit from one pose and one hidden state?

    python -m experiments.rnn_gan.styles [--model lstm-gmm] [--samples 100]

A classifier learns the styles of the recorded clips from two seconds of motion, and names those of
samples. What is measured and how it is judged stands in claims.yaml.
"""

from __future__ import annotations

import argparse
import time
from collections import Counter
from collections.abc import Sequence
from typing import NamedTuple

import torch
from torch import Tensor, nn

import motionlab
from motionlab.encodings import BodyFrame, Normalizer
from motionlab.training import Prepared
from motionlab.training.finish import OBSERVED
from motionlab.weights import find

from ..common import record
from ..common.recorded import recorded_clips

WINDOW, STEP = 2.0, 0.5  # seconds that are named at a time, and from one to the next
ENOUGH = 10  # held-out clips of a style that is told
BEFORE, UNTIL = 5.0, 10.0  # seconds of a sample after which it is named, and until which
WAYS: dict[str, dict] = {  # the first is judged
    "as it ships": {},
    "temperature 1": {"sampling": {"temperature": 1.0}},
    "a minute later": {"later": 60.0},
    "pose alone, no memory": {"memory": False},
}
LEGS = ("Leg", "Foot", "Toes")
DECAY, UPDATES, WIDTH = 1e-2, 400, 64  # of the classifier


class Clip(NamedTuple):
    style: str
    split: str
    action: str
    features: Tensor  # (frames, dim)


def main(arguments: list[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--model", default="lstm-gmm")
    parser.add_argument("--data", default="locomotion")
    parser.add_argument("--samples", type=int, default=100)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--output", default="results/styles.json")
    chosen = parser.parse_args(arguments)
    begin = time.perf_counter()
    model, path = motionlab.load(chosen.model), find(chosen.model)
    data = Prepared.find(chosen.data).matching(model.encoding)
    clips = clips_of(data)
    count = Counter(clip.style for clip in clips if clip.split == "test")
    styles = sorted(style for style, clips_there in count.items() if clips_there >= ENOUGH)
    clips = [clip for clip in clips if clip.style in styles]
    naming = Naming(data, clips, styles, chosen.seed)
    told = {
        split: matrix(naming, [c for c in clips if c.split == split]) for split in ("val", "test")
    }
    begun = {
        style: start_of([c for c in clips if c.split == "test" and c.style == style], model.fps)
        for style in styles
    }
    legs = Naming(data, clips, styles, chosen.seed, LEGS)
    starts = {
        way: {
            style: visited(model, judge, first, chosen.samples, chosen.seed, **changes)
            for style, first in begun.items()
        }
        for way, judge, changes in (
            *((way, naming, changes) for way, changes in WAYS.items()),
            ("named by the legs alone", legs, {}),
        )
    }
    result = {
        "weights": record.about_weights(model, path), "styles": styles,
        "training clips": dict(Counter(c.style for c in clips if c.split == "train")),
        "classifier": {
            split: {
                "confusion (recorded style: named style)": found,
                "accuracy": sum(row[i] for i, row in enumerate(found)) / sum(map(sum, found)),
                "effective styles of one": sum(map(effective, found)) / len(found),
            }
            for split, found in told.items()
        },
        "samples": chosen.samples,
        "how it moves": {
            way: sum(its["effective styles"] for its in told.values()) / len(told)
            for way, told in starts.items()
        },
        "ways": starts,
    }  # fmt: skip
    record.write(record.provenance(begin, chosen.seed, data) | result, chosen.output)


def clips_of(data: Prepared) -> list[Clip]:
    """All clips of the data set that are recorded, not mirrored, with style and action."""
    return [
        Clip(entry.style, split, entry.action, features)
        for entry, split, features in recorded_clips(data)
        if len(features) >= WINDOW * data.encoding.fps
    ]


class Naming:
    """A network of one hidden layer that names the style of two seconds of body-frame features.

    It sees mean and deviation of each feature over the window, so neither the phase of a step nor
    where the body is or faces; only of features in whose names one of `parts` is.
    """

    def __init__(
        self,
        data: Prepared,
        clips: Sequence[Clip],
        styles: list[str],
        seed: int,
        parts: Sequence[str] = ("",),
    ) -> None:
        self.encoding, self.styles = data.encoding, styles
        self.body = BodyFrame(self.encoding.skeleton, fps=self.encoding.fps, contacts=False)
        names = self.body.feature_names
        self.columns = [i for i, name in enumerate(names) if any(part in name for part in parts)]
        training = [(self.seen(c.features), c.style) for c in clips if c.split == "train"]
        self.normalizer = Normalizer.fit([seen for seen, _ in training])
        inputs = self.normalizer(torch.cat([seen for seen, _ in training]))
        labels = torch.cat([
            torch.full((len(seen),), styles.index(style)) for seen, style in training
        ])  # fmt: skip
        share = labels.bincount(minlength=len(styles)).float()
        with torch.random.fork_rng(devices=[]):
            torch.manual_seed(seed)
            self.network = nn.Sequential(
                nn.Linear(inputs.shape[1], WIDTH), nn.ReLU(), nn.Dropout(0.5),
                nn.Linear(WIDTH, len(styles)),
            )  # fmt: skip
            optimizer = torch.optim.AdamW(self.network.parameters(), 3e-3, weight_decay=DECAY)
            loss_of = nn.CrossEntropyLoss(share.sum() / share / len(styles))
            for _ in range(UPDATES):
                some = torch.randint(len(inputs), (256,))
                loss = loss_of(self.network(inputs[some]), labels[some])
                optimizer.zero_grad()
                loss.backward()
                optimizer.step()
        self.network.eval()

    def seen(self, features: Tensor) -> Tensor:
        """What the classifier sees of motion (frames, dim): (windows, numbers)."""
        body = self.body.encode(self.encoding.to_motion(features))
        fps = self.encoding.fps
        windows = body[:, self.columns].unfold(0, round(WINDOW * fps), round(STEP * fps))
        return torch.cat([windows.mean(-1), windows.std(-1)], dim=-1)

    @torch.no_grad()
    def name(self, features: Tensor) -> int:
        """Style of a whole motion: the one that its windows speak for together."""
        return int(
            self.network(self.normalizer(self.seen(features))).log_softmax(-1).sum(0).argmax()
        )


def matrix(naming: Naming, clips: Sequence[Clip]) -> list[list[int]]:
    """How many clips of each style (rows) are named what (columns)."""
    found = torch.zeros(len(naming.styles), len(naming.styles), dtype=torch.long)
    for clip in clips:
        found[naming.styles.index(clip.style), naming.name(clip.features)] += 1
    return found.tolist()


def start_of(clips: Sequence[Clip], fps: float) -> Tensor:
    """The first two seconds (frames, dim) of the walk whose speed is the median of all these."""
    seen = round(OBSERVED * fps)
    walks = [clip.features for clip in clips if clip.action.startswith("walk")]
    speed = lambda features: float(features[:, :2].norm(dim=-1).mean())
    return sorted(walks, key=speed)[len(walks) // 2][:seen]


@torch.no_grad()
def visited(
    model: nn.Module,
    naming: Naming,
    begun: Tensor,
    count: int,
    seed: int,
    sampling: dict[str, float] | None = None,
    later: float = 0.0,
    memory: bool = True,
) -> dict:
    """What `count` samples from one state are named.

    sampling : instead of what suits the weights.
    later : seconds more that a sample goes on before it is named.
    memory : False: the network knows the last frame alone.
    """
    state = model.observe(begun)
    if not memory:
        state = model.zero_state()._replace(frame=state.frame)
    made = model.generate(
        round((UNTIL + later) * model.fps), state[[0] * count],
        generator=torch.Generator().manual_seed(seed), **(sampling or model.sampling),
    )  # fmt: skip
    whole = made[made.isfinite().all(-1).all(-1)][:, round((BEFORE + later) * model.fps) :]
    named = Counter(naming.name(motion) for motion in whole)
    row = [named[i] for i in range(len(naming.styles))]
    return {"named": row, "effective styles": effective(row)}


def effective(row: Sequence[int]) -> float:
    """How many styles there are, were all as frequent: the exponential of the entropy."""
    shares = torch.tensor(row, dtype=torch.float64)
    if not shares.sum():
        return 0.0
    shares = shares[shares > 0] / shares.sum()
    return float((-(shares * shares.log()).sum()).exp())


if __name__ == "__main__":
    record.run(main)
