"""The table from beginning to end: small networks, procedural walks, and what the ledger makes of it."""

from __future__ import annotations

import json
from types import SimpleNamespace

import pytest
import torch

import motionlab
from experiments.claims import verdicts
from experiments.comparison import begun, columns, going_on, measures, methods, speed, table
from experiments.comparison.columns import COLUMNS
from experiments.comparison.methods import EQUAL, FLOOR, SHIPS, Method
from experiments.rnn_gan import samples
from motionlab import viewer
from motionlab.datasets import gaits
from motionlab.encodings import JointAngles, Normalizer
from motionlab.models import LstmGmm
from motionlab.training import Prepared, judging


@pytest.fixture
def data(monkeypatch):
    """Walks of five seconds, of which half are called runs."""
    encoding = JointAngles(motionlab.Skeleton.canonical(), 30, contacts=True)
    make = lambda i: gaits.make(seconds=5, speed=1 + 0.05 * i, turn_rate=0.2 * (i % 3 - 1), seed=i)
    clips = [encoding.encode(make(i)) for i in range(24)]
    splits = ("train", "train", "val", "val", "test", "test") * 4
    names = tuple(f"gaits/{i}" for i in range(24))
    actions = ["walk" if i % 2 else "run" for i in range(24)]
    entries = [SimpleNamespace(source="gaits", action=its, style="") for its in actions]
    listed = lambda data: list(zip(entries, splits, clips, strict=True))
    monkeypatch.setattr(begun, "recorded_clips", listed)
    monkeypatch.setattr(samples, "recorded_clips", listed)
    return Prepared(torch.cat(clips), torch.tensor([len(clip) for clip in clips]), names, splits,
                    encoding, Normalizer.fit(clips), "walks")  # fmt: skip


@pytest.fixture
def small(data, tmp_path, monkeypatch):
    """Methods and sizes of seconds."""
    monkeypatch.setattr(table, "KEPT", tmp_path / "kept")
    monkeypatch.setattr(Prepared, "find", lambda name: data)
    monkeypatch.setattr(judging, "UPDATES", 2)
    monkeypatch.setattr(columns, "CRITICS", 1)
    monkeypatch.setattr(speed, "seconds", lambda method, many: float(len(many)))
    lasting, variety = measures.lasting, measures.variety
    monkeypatch.setattr(measures, "lasting", lambda *its: lasting(*its, frames=60))
    monkeypatch.setattr(measures, "variety", lambda *its: variety(*its, count=3))

    def method(name, kind, seed=None, **more):
        torch.manual_seed(seed or 0)
        network = LstmGmm(data.encoding, data.normalizer, width=8).eval()
        network.hash = f"{name}-{seed}"
        go_on = going_on.angles(network, {"temperature": 0.1})
        return Method(name, kind, "", go_on, (network,), seen=1_000, seed=seed, **more)

    ships = [method(name, SHIPS) for name in ("RNN", "GAN1", "GAN2")]
    ships += [method("dear", SHIPS, few=True, without={"alive": "dear", "variety": "dear"})]
    ships += [Method("constant velocity", FLOOR, "", going_on.straight_on)]
    monkeypatch.setattr(methods, "shipped", lambda: ships)
    trained = [method(name, EQUAL, seed) for name in ("RNN", "STRNN") for seed in (0, 1, 2)]
    monkeypatch.setattr(methods, "trained", lambda data: trained)


def test_a_whole_table_is_written_shown_and_judged(small, tmp_path, monkeypatch):
    output = tmp_path / "comparison.json"
    monkeypatch.setattr(table.trainings, "main", lambda arguments: None)
    table.main(["--output", str(output)])
    found = json.loads(output.read_text())
    assert len(found["rows"]) == 7 and found["rows"]["STRNN, equal budget"]["seeds"] == [0, 1, 2]
    for row in found["rows"].values():
        for cells in row["gaits"].values():
            wanted = {column.name for column in COLUMNS} - set(row["left out"])
            assert set(cells) == wanted
            # feet of networks that never learned need not rest
            assert {name for name, cell in cells.items() if cell} >= wanted - {measures.SKATE}
    assert {name for real in found["floor"].values() for name in real} == {c.name for c in COLUMNS}
    assert found["floor"]["walk"]["alive"]["value"] == 1.0
    pairs = found["compared"]["pairs"]["RNN, equal budget / STRNN, equal budget"]
    assert set(pairs["walk"]) == {column.name for column in COLUMNS}
    claim = next(its for its in verdicts.claims() if its["id"] == "W9")
    assert verdicts.judge(claim, tmp_path).verdict == "not testable here"
    shown = viewer.method_table(found, "run").frame
    assert (
        list(shown.index)[-1] == "real against real"
        and shown.loc["dear, as it ships", "alive"] == "–"
    )
    # all of it is kept: nothing is measured again
    monkeypatch.setattr(measures, "asked", None)
    monkeypatch.setattr(measures, "lasting", None)
    table.main(["--output", str(output)])
    assert json.loads(output.read_text())["rows"] == found["rows"]


def test_as_it_is_takes_long_things_only_if_they_are_there(small, tmp_path):
    output = tmp_path / "comparison.json"
    table.main(["--as-it-is", "--output", str(output)])
    found = json.loads(output.read_text())
    assert "dear, as it ships" not in found["rows"]
    row = found["rows"]["RNN, as it ships"]
    assert row["left out"]["alive"] == "not measured yet" and row["gaits"]["run"]["alive"] is None
