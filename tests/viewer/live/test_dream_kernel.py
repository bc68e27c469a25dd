"""Sliders in a kernel: what they change, and how fast."""

from __future__ import annotations

import copy
import time

import ipywidgets
import pytest
import torch
from tiny_lstm import tiny_aclstm, tiny_clips, tiny_lstm

from motionlab.errors import ViewerError
from motionlab.models import Refiner
from motionlab.viewer import dream
from motionlab.viewer.live.player import Player


@pytest.fixture(scope="module")
def model():
    model = tiny_lstm(tiny_clips("walk_1.2", "run_3.0"))
    model.sampling = {"temperature": 0.5}
    return model


@pytest.fixture
def box(model):
    return dream(model, seconds=1)


def fields(box) -> dict[str, ipywidgets.Widget]:
    return {field.description: field for field in box.children[1].children}


def player(box) -> Player:
    return box.children[0]


def test_there_is_a_field_for_every_choice_of_generate(box):
    assert set(fields(box)) == {
        "Start", "Temperature", "Component temperature", "Memory of the noise", "Input noise",
        "Characters", "Seed", "Seconds",
    }  # fmt: skip
    assert fields(box)["Temperature"].value == 0.5  # as the weights ask for
    assert player(box).payload["frames"] == 31  # the start itself and a second
    assert player(box).payload["tracks"][0]["contacts"] is not None


def test_a_refiner_is_ticked_off(model):
    refiner = Refiner(model.encoding, model.normalizer, width=8)
    chance = torch.Generator().manual_seed(0)
    refiner.leave.weight.data = torch.randn(refiner.leave.weight.shape, generator=chance)
    box = dream(model, seconds=1, refiner=refiner)
    assert player(box).payload["tracks"] != player(dream(model, seconds=1)).payload["tracks"]
    fields(box)["Refine the feet"].value = False
    assert player(box).payload["tracks"] == player(dream(model, seconds=1)).payload["tracks"]


def test_no_label_is_cut_off(box):
    """8 pixels a letter are enough in JupyterLab, 7 are not."""
    for label, field in fields(box).items():
        assert 8 * len(label) <= int(field.style.description_width.removesuffix("px"))


def test_a_model_may_have_moved_since_it_was_loaded(model, box):
    moved = dream(copy.deepcopy(model).double(), seconds=1)
    assert moved.children[0].payload["frames"] == player(box).payload["frames"]


@pytest.mark.parametrize(
    ("field", "value"),
    [("Start", 1), ("Temperature", 1.0), ("Component temperature", 0.05),
     ("Memory of the noise", 0.9), ("Input noise", 0.3), ("Seed", 7)],
)  # fmt: skip
def test_a_change_brings_another_motion_and_back_the_same(box, field, value):
    before, old = player(box).payload, fields(box)[field].value
    player(box).frame = 9
    fields(box)[field].value = value
    after = player(box).payload
    assert after["tracks"] != before["tracks"]
    assert player(box).frame == 0 and player(box).playing
    fields(box)[field].value = old
    assert player(box).payload == before


def test_characters_are_futures_of_one_start_in_one_picture(box):
    fields(box)["Characters"].value = 3
    content = player(box).payload
    assert len({track["turns"] for track in content["tracks"]}) == 3
    assert player(box).overlay


def test_a_dancer_has_the_fields_that_it_has_a_use_for():
    dancer = tiny_aclstm(tiny_clips("walk_1.2", "run_3.0"))
    box = dream(dancer, seconds=1)
    before = player(box).payload
    assert set(fields(box)) == {"Start", "Input noise", "Characters", "Seed", "Seconds"}
    assert before["frames"] == 31 and before["tracks"][0]["contacts"] is None
    fields(box)["Seed"].value = 7
    assert player(box).payload == before  # there is no chance in it
    fields(box)["Characters"].value = 2
    assert "one future" in box.children[2].value
    fields(box)["Input noise"].value = 0.3
    first, second = player(box).payload["tracks"]
    assert first["local"] != second["local"] and first["local"] != before["tracks"][0]["local"]
    assert "one future" not in box.children[2].value


def test_it_begins_with_the_start_that_is_asked_for(box, model):
    begun = dream(model, seconds=1, start=1)
    assert fields(begun)["Start"].value == 1
    assert player(begun).payload["tracks"] != player(box).payload["tracks"]
    fields(box)["Start"].value = 1
    assert player(begun).payload["tracks"] == player(box).payload["tracks"]
    with pytest.raises(ViewerError, match="start is -1"):
        dream(model, start=-1)


def test_seconds_are_seconds(box):
    fields(box)["Seconds"].value = 4
    assert player(box).payload["frames"] == 4 * 30 + 1


def test_what_cannot_be_shown_is_said_and_the_last_motion_stays(box, model, monkeypatch):
    before = player(box).payload
    nan = lambda n, state, **_: torch.full((len(state.frame), n, model.encoding.dim), torch.nan)
    monkeypatch.setattr(model, "generate", nan)
    fields(box)["Seed"].value = 3
    assert "NaN" in box.children[2].value
    assert player(box).payload == before


def test_a_model_without_starts_is_refused(model, monkeypatch):
    monkeypatch.setattr(model, "start_names", ())
    with pytest.raises(ViewerError, match=r"model\.starts"):
        dream(model)


def test_all_but_the_network_takes_a_moment(model, monkeypatch):
    """From slider to motion half a second is allowed; nearly all of it is the network's."""
    made = model.generate(300, model.starts[0])
    monkeypatch.setattr(model, "generate", lambda n, state, **_: made)
    box, spent = dream(model, seconds=10), []
    for seed in range(1, 6):
        begin = time.process_time()  # others' work on this machine does not count
        fields(box)["Seed"].value = seed
        spent.append(time.process_time() - begin)
    assert player(box).payload["frames"] == 301
    assert min(spent) < 0.15, spent
