"""Walks and runs told apart, and rollouts that mix them."""

import json
import math

import pytest
import torch

from experiments.aclstm import hybrid
from motionlab.training.dances import turned

pytest.importorskip("lightning_fabric")
pytestmark = pytest.mark.usefixtures("dances")  # gaits for dances, in an empty folder


@pytest.fixture
def clips(dances):
    """(number of the style, features) of each clip, by split."""
    data = dances.of("hybrid")
    each = zip(data.features.split(data.lengths.tolist()), data.names, data.splits, strict=True)
    found = {"train": [], "val": [], "test": []}
    for clip, name, split in each:
        found[split].append(("salsa" in name, clip))
    return found


def test_walks_are_told_from_runs(clips, dances):
    encoding = dances.of("hybrid").encoding
    points = lambda split: [
        (int(is_run), encoding.positions(clip)) for is_run, clip in clips[split]
    ]
    rows, labels = hybrid.windows_of(points("train"), encoding.skeleton, 30.0)
    tell = hybrid.logistic(rows, labels)
    rows, labels = hybrid.windows_of(points("test"), encoding.skeleton, 30.0)
    assert set(labels.tolist()) == {0, 1}
    assert torch.equal((tell(rows) > 0.5).long(), labels)


def test_windows_do_not_tell_which_way_a_body_faces(clips, dances):
    encoding, (_, clip) = dances.of("hybrid").encoding, clips["train"][0]
    describe = lambda features: hybrid.described(
        encoding.positions(features), encoding.skeleton, 30.0, 0.5
    )
    rows = describe(clip)
    assert rows.shape == ((len(clip) - 60) // 15 + 1, 7 * encoding.points)
    torch.testing.assert_close(rows, describe(turned(clip, torch.tensor(2.0))), atol=1e-4, rtol=0)
    assert len(describe(clip[:59])) == 0


def test_few_windows_of_a_style_weigh_as_much_as_many():
    draw = torch.Generator().manual_seed(0)
    rows = torch.randn(1_000, 3, generator=draw)
    labels = (torch.arange(1_000) < 20).long()
    rows[:, 0] += 2 * labels
    tell = hybrid.logistic(rows, labels)
    right = (tell(rows) > 0.5) == labels
    assert right[:20].float().mean() > 0.7 and right[20:].float().mean() > 0.7


def test_mixing_by_hand():
    indian, salsa = torch.zeros(4), torch.ones(4)
    both = torch.tensor([0.0, 0.1, 0.9, 0.8])
    fleeting = torch.tensor([0.1, 0.9, 0.1, 0.9])
    found = hybrid.mixed([indian, salsa, both, fleeting, torch.zeros(0)])
    assert found["windows"] == 16 and found["visit both"] == 0.2
    assert found["share of windows"] == {"indian": 0.5, "salsa": 0.5}
    assert hybrid.mixed([torch.zeros(0)])["visit both"] == 0


def test_result_is_told(untrained, tmp_path):
    untrained("aclstm-indian")
    path = next(tmp_path.rglob("at-40.safetensors"))
    hybrid.main(["--model", str(path), "--starts", "2", "--seconds", "8", "--output", "found.json"])
    found = json.loads((tmp_path / "found.json").read_text(encoding="utf-8"))
    assert found["right"]["mean"] > 0.9
    assert [len(its["salsa"]) for its in found["rollouts"]] == [4, 4]
    assert math.isclose(sum(found["share of windows"].values()), 1)
    # bones of a network that was never trained fit no body: it fails at once
    assert found["until they fail"]["windows"] < found["windows"]
    assert {its["begins in"].split("/")[1][:5] for its in found["rollouts"]} == {"india", "salsa"}
