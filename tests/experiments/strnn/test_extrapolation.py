"""Forecasts and open loops of networks whose answers are known."""

import json
import math
from collections import Counter

import pytest
import torch

from experiments.strnn import extrapolation
from motionlab.errors import DataError
from motionlab.training import PRESETS, Prepared, build
from motionlab.training.checkpoints import save_weights
from motionlab.training.strnn import in_body_frame


def test_an_oracle_foretells_without_error(walks):
    data = in_body_frame(walks)
    (clip, *_) = clips = data.clips("val")
    rows = torch.cat(clips)

    def oracle(seen, n):
        at = [int((rows == window[-1]).all(-1).nonzero()[0]) for window in seen]
        return torch.stack([rows[i + 1 : i + 1 + n] for i in at])

    found = extrapolation.forecasts(oracle, clips, data, 20)
    assert [*found] == ["80 ms", "160 ms", "320 ms", "400 ms", "560 ms", "20 frames"]
    assert max(found.values()) == 0
    floors = extrapolation.floors(clips, data)
    still, mean, ridge = (
        floors[name] for name in ("zero velocity", "mean frame", "ridge regression")
    )
    assert still["80 ms"] < still["320 ms"] and ridge["80 ms"] < 0.3 * still["80 ms"]
    assert 0.5 < mean["20 frames"] < 2


def test_prefixes_come_from_the_middle(walks):
    clips, kinds = in_body_frame(walks).clips("val"), ["walks"] * 3
    found = extrapolation.prefixes(clips, kinds, 2, 20)
    assert torch.equal(found[0], clips[0][55:75]) and torch.equal(found[1], clips[2][55:75])
    with pytest.raises(DataError, match="200 frames"):
        extrapolation.prefixes(clips, kinds, 2, 100)


@pytest.mark.parametrize(
    ("have", "wanted", "expected"),
    [
        ({"a": 30, "b": 30, "c": 30}, 9, {"a": 3, "b": 3, "c": 3}),
        ({"a": 30, "b": 1, "c": 30}, 9, {"a": 4, "b": 1, "c": 4}),
        ({"a": 30, "b": 2}, 3, {"a": 1, "b": 2}),
        ({"a": 2, "b": 1}, 9, {"a": 2, "b": 1}),
    ],
)
def test_starts_are_of_every_kind(have, wanted, expected):
    kinds = [kind for kind, count in have.items() for _ in range(count)]
    clips = [torch.full((40, 1), float(i)) for i in range(len(kinds))]
    short = [torch.zeros(39, 1)] * 5  # count for nothing
    found = extrapolation.long_clips([*clips, *short], [*kinds, *"ddddd"], wanted, 20)
    at = [int(clip[0]) for clip in found]
    assert Counter(kinds[i] for i in at) == expected and len(set(at)) == len(at)


def test_real_motion_in_open_loop_is_sound_and_near_itself(walks):
    data = in_body_frame(walks)
    real = extrapolation.real_of(data)
    made = torch.stack([clip[:140] for clip in data.clips("val")])
    found = extrapolation.opened(made, data, real, 20)
    assert found["alive"] == 1 and found["bones, worst (cm)"] < 0.1
    assert found["movement, last minute, over real"] == pytest.approx(1, abs=0.5)
    assert found["steps across seams"] == pytest.approx(1, abs=0.1)
    assert found["largest shared end"] <= 1
    near = extrapolation.manifold(made, data, real, data.clips("val"))
    assert near["of real"] < 0.5 < near["to real"]  # real are those that were "made"


def test_failures_are_told(walks):
    data = in_body_frame(walks)
    real = extrapolation.real_of(data)
    clip = data.clips("val")[0][:140]
    still, wild = clip[:1].repeat(140, 1), clip.clone()
    still[:, data.encoding.slices["root"]][:, 6:] = 0
    wild[70:] *= 100
    found = extrapolation.opened(torch.stack([clip, still, wild]), data, real, 20)
    assert found["failed"]["frozen"] == found["failed"]["diverged"] == 1
    assert found["alive"] == pytest.approx(1 / 3)
    assert "in loops, of those alive" not in extrapolation.opened(wild[None], data, real, 20)
    gone = torch.full_like(wild, math.nan)
    assert extrapolation.manifold(gone[None], data, real, [clip]) == {}


def test_a_result_is_written(walks, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(Prepared, "find", lambda name: walks)
    preset = PRESETS["strnn-temporal"]["smoke"]
    save_weights("some.safetensors", build(walks, preset), {"name": "strnn-temporal"})
    extrapolation.main(
        ["some.safetensors", "--starts", "2", "--frames", "150",
         "--noise", "0", "0.1", "--output", "found.json"]
    )  # fmt: skip
    found = json.loads((tmp_path / "found.json").read_text())
    (row,) = found["rows"].values()
    assert row["weights"]["settings"]["spatial"] is False and row["decoded"] > 0.1
    assert {"open loop, noise 0", "open loop, noise 0.1"} < set(row)
    assert found["starts"] == 2 and set(found["real"]["by source"]) == {"gaits"}
    assert found["sources of starts"] == {"gaits": 2} and found["noise"] == [0, 0.1]


def test_a_verdict_is_of_the_noise_that_was_chosen_and_of_the_same_without_residual(
    walks, tmp_path, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(Prepared, "find", lambda name: walks)
    network = build(walks, PRESETS["strnn-temporal-hy"]["smoke"])
    torch.nn.init.normal_(
        network.filter[-1].weight, std=0.5, generator=torch.Generator().manual_seed(3)
    )
    save_weights("some.safetensors", network, {"name": "strnn-temporal-hy"})
    (tmp_path / "val.json").write_text(json.dumps(validated({0.02: loop(), 0.05: loop()})))
    extrapolation.main(
        ["some.safetensors", "--starts", "2", "--frames", "150", "--noise-chosen-in", "val.json",
         "--without-residual", "--output", "found.json"]
    )  # fmt: skip
    found = json.loads((tmp_path / "found.json").read_text())
    (row,) = found["rows"].values()
    titles = [title for title in row if title.startswith("open loop")]
    assert [*titles] == [
        "open loop, noise 0", "open loop, noise 0.02", "open loop, noise 0, without residual"
    ]  # fmt: skip
    assert row[titles[0]] != row[titles[2]]


def loop(alive=1.0, looping=0.0, period=2.0, moves=0.9):
    return {"alive": alive, "in loops, of those alive": looping,
            "periods (s)": [period] * (looping > 0), "movement, last minute, over real": moves}  # fmt: skip


def validated(loops, split="val"):
    rows = {f"open loop, noise {noise:g}": its for noise, its in ({0.0: loop()} | loops).items()}
    return {"split": split, "noise": [0.0, *loops], "rows": {"some": rows}}


@pytest.mark.parametrize(
    ("loops", "chosen"),
    [
        ({0.02: loop(), 0.05: loop()}, 0.02),
        ({0.02: loop(looping=0.3), 0.05: loop()}, 0.05),
        ({0.02: loop(looping=0.3, period=20.0), 0.05: loop()}, 0.02),
        ({0.02: loop(moves=0.3), 0.05: loop(looping=0.1)}, 0.05),
        ({0.02: loop(looping=0.4), 0.05: loop(looping=0.3), 0.1: loop(alive=0.2)}, 0.05),
        ({0.02: loop(alive=0.1), 0.05: loop(alive=0.2)}, 0.02),
    ],
)
def test_the_noise_is_the_smallest_that_will_do(loops, chosen):
    assert extrapolation.choose_noise(validated(loops)) == chosen


def test_noise_is_never_chosen_on_test_clips():
    for found in (validated({0.02: loop()}, "test"), validated({})):
        with pytest.raises(DataError, match="on validation clips"):
            extrapolation.choose_noise(found)


def test_other_weights_are_refused(tmp_path, walks):
    preset = PRESETS["lstm-gmm-contacts"]["smoke"]
    save_weights(tmp_path / "a.safetensors", build(walks, preset), {"name": "lstm-gmm"})
    with pytest.raises(DataError, match="LstmGmm, no STRNN"):
        extrapolation.main([str(tmp_path / "a.safetensors")])
