"""What tests of the dances share: gaits that stand for dances, and dancers that learned nothing."""

import json

import pytest
import torch

from experiments.aclstm import dances as data
from experiments.aclstm import rollouts, trainings
from motionlab import datasets
from motionlab.encodings import Normalizer, RootRelative
from motionlab.training import Prepared, build
from motionlab.training.checkpoints import save_weights

# Walks stand for one dance, runs for another.
DANCES = {
    "train": {"indian": ("walk_1.0", "walk_1.4", "walk_1.3_turn_left_0.3", "stop_1.3"),
              "salsa": ("run_2.6", "run_3.5", "run_2.6_turn_right_0.6")},
    "val": {"indian": ("walk_1.2",), "salsa": ("run_3.0",)},
    "test": {"indian": ("walk_weave",), "salsa": ("run_2.6_turn_left_0.6",)},
}  # fmt: skip


@pytest.fixture(scope="session")
def two_dances():
    """Walks and runs at 60 frames a second, prepared as dances; walks are there twice."""
    motions = {motion.name: motion.resample(60) for motion in datasets.load("gaits")}
    encoding = RootRelative(motions["walk_1.0"].skeleton, 60.0, stature=1.54)
    clips, names, splits = [], [], []
    for split, styles in DANCES.items():
        for style, chosen in styles.items():
            for name in chosen:
                halves = ("_1/2", "_2/2") if style == "indian" else ("",)
                clips += [encoding.encode(motions[name])] * len(halves)
                names += [f"gaits/{style}_{name}{half}" for half in halves]
                splits += [split] * len(halves)
    return Prepared(
        torch.cat(clips), torch.tensor([len(clip) for clip in clips]), tuple(names), tuple(splits),
        encoding, Normalizer.fit(clips), "two dances",
    )  # fmt: skip


@pytest.fixture
def dances(two_dances, tmp_path, monkeypatch):
    """The experiments' `dances` with these data for every style, in an empty folder."""
    clear = lambda: [kept.cache_clear() for kept in (data.of, rollouts.real_of)]
    clear()
    monkeypatch.setattr(data, "found", lambda style: two_dances)
    monkeypatch.chdir(tmp_path)
    yield data
    clear()


@pytest.fixture
def untrained(dances):
    """Weights of rows as if they had been trained, by their names."""

    def make(*names, preset="smoke"):
        for run in trainings.in_order(names, preset):
            model = build(dances.found(run.row.data), run.preset)
            for update in (10, run.preset.updates):
                save_weights(run.folder / f"at-{update}.safetensors", model, {"update": update})
            curve = [{"update": run.preset.updates, "train": 1.0, "val": 1.0, "seconds": 9.0}]
            (run.folder / "curve.json").write_text(json.dumps(curve))

    return make
