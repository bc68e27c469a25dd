"""Prediction errors of forecasts whose errors are known, and the paper's numbers."""

import json

import numpy as np
import pytest
import torch
from torch import nn

from experiments.aclstm import prediction
from motionlab.models.floor import ZeroVelocity

pytest.importorskip("lightning_fabric")
pytestmark = pytest.mark.usefixtures("dances")  # gaits for dances, in an empty folder


class Oracle(nn.Module):
    """Knows what comes next, or says something else of the first of the moments."""

    def __init__(self, encoding, true, first=None):
        super().__init__()
        self.encoding, self.fps, self.made = encoding, encoding.fps, true.clone()
        if first is not None:
            self.made[0, 5:] = first

    def observe(self, features):
        return features

    def generate(self, n, start, **options):
        return self.made[:, :n]


def test_who_knows_what_comes_makes_no_error(dances):
    seeds, encoding = dances.seeds("indian", 5), dances.of("indian").encoding
    assert not prediction.distances(Oracle(encoding, seeds.true), seeds.seen, seeds.true).any()
    found = prediction.distances(Oracle(encoding, seeds.true, torch.nan), seeds.seen, seeds.true)
    assert np.isinf(found[0]).all() and not found[1:].any()


@pytest.mark.parametrize("fps", [30.0, 60.0])
def test_zero_velocity_is_as_far_as_the_body_moved(dances, fps):
    seeds, encoding = dances.seeds("indian", 5, fps), dances.of("indian", fps).encoding
    found = prediction.distances(ZeroVelocity(encoding), seeds.seen, seeds.true)
    stays = seeds.seen[:, -1:].clone()
    stays[..., [0, 2]] = 0
    far = (seeds.true - stays).norm(dim=-1)
    at = 0.4 * fps  # a whole frame at both rates
    np.testing.assert_allclose(found[:, 4], far[:, round(at) - 1], rtol=1e-4)
    told = prediction.errors(ZeroVelocity(encoding), "indian", 5)
    assert told["value"] == pytest.approx(found.mean(0).tolist())
    assert all(
        a <= b <= c for a, b, c in zip(*(told[k] for k in ("low", "value", "high")), strict=True)
    )


def test_the_papers_numbers_say_what_the_paper_says_of_them():
    paper = prediction.PAPER
    assert all(len(row) == 8 for row in paper.values())
    for style in ("walking", "indian", "martial"):
        first = {name: row[0] for name, row in paper.items() if name.endswith(style)}
        last = {name: row[-1] for name, row in paper.items() if name.endswith(style)}
        assert len(first) == 5 and min(first, key=first.get) == f"seq2seq-{style}"
        if style != "walking":
            assert max(last, key=last.get) == f"seq2seq-{style}"
    indian = {name: row for name, row in paper.items() if name.endswith("indian")}
    best = [min(indian, key=lambda name: indian[name][at]) for at in range(8)]  # noqa: B023
    assert best.count("aclstm-indian") == 6
    table_2 = [paper[row] for row in ("length-1", "length-2", "aclstm-indian", "length-10")]
    for row, next_ in zip(table_2, table_2[1:], strict=False):
        assert all(a > b for a, b in zip(row, next_, strict=True))


def test_rows_that_are_trained_are_told(untrained, tmp_path):
    untrained("aclstm-indian", "fps-60")
    prediction.main(["--preset", "smoke", "--seeds", "4", "--output", "found.json"])
    found = json.loads((tmp_path / "found.json").read_text(encoding="utf-8"))
    assert list(found["rows"]) == ["aclstm-indian", "fps-60"] and list(found["floor"]) == ["indian"]
    aclstm = found["rows"]["aclstm-indian"]
    assert list(aclstm["seeds"]) == ["0", "1", "2"] and aclstm["paper (m)"][0] == 0.685
    assert aclstm["seeds"]["0"]["update"] == 40
    assert aclstm["seeds"]["0"]["errors (m)"] != aclstm["seeds"]["1"]["errors (m)"]
    assert set(found["floor"]["indian"]) == {
        "zero velocity",
        "constant velocity",
        "running average",
    }
    prediction.main(["--preset", "smoke", "--only", "fps-60", "--output", "less.json"])
    less = json.loads((tmp_path / "less.json").read_text(encoding="utf-8"))
    assert list(less["rows"]) == ["fps-60"]


def test_another_preset_must_not_overwrite_the_result(capsys):
    with pytest.raises(SystemExit):
        prediction.main(["--preset", "smoke"])
    assert "--output" in capsys.readouterr().err
