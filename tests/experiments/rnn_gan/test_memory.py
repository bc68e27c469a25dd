"""The rule by which temperature and memory are fitted: it can go either way, and it runs."""

import math

import pytest

from experiments.rnn_gan import memory, samples, variety

SIX = [f"{gait}, {quantity}" for gait in samples.GAITS for quantity in samples.QUANTITIES]


def row(a=1.0, j=1.0, spreads=(1.0,) * 6, sound=(1.0, 1.0), skate=1.5, **sampling):
    over = {"acceleration (m/s²)": a, "jerk (m/s³)": j, "foot skate, weighted (cm/s)": skate}
    return {
        "sampling": sampling, "samples over data": over,
        "spread over people's": dict(zip(SIX, spreads, strict=True)),
        "sound": dict(zip(samples.GAITS, sound, strict=True)),
    }  # fmt: skip


def test_who_is_as_people_are_costs_nothing_and_who_is_not_by_how_much():
    assert memory.cost(row()) == 0
    assert memory.cost(row(a=1.1)) == pytest.approx(1) == memory.cost(row(a=1 / 1.1))
    assert memory.cost(row(j=1.2)) == pytest.approx(1)
    assert memory.cost(row(spreads=[1 / 1.5] * 6)) == pytest.approx(1)
    assert memory.cost(row(spreads=[1.5] * 6)) == pytest.approx(0.5)  # enough is what is claimed
    assert memory.cost(row(spreads=[1.0] * 5 + [0.0])) == math.inf
    assert memory.cost({**row(), "samples over data": {}}) == math.inf  # all fell apart


def test_the_nearest_of_the_sound_is_taken():
    white = row(a=1.05, j=1.4, spreads=[0.25] * 6, memory=0.0)
    good = row(a=0.98, j=1.1, spreads=[0.9] * 6, memory=0.9)
    wild = row(spreads=[1.0] * 6, sound=(1.0, 0.94), memory=0.95)
    slides = row(skate=2.1, memory=0.8)
    assert memory.choose([white, good, wild, slides]) is good
    assert memory.left_out(wild, white) == "less sound than white noise"
    assert memory.left_out(slides, white) == "skates" and not memory.left_out(good, white)
    tremble = row(a=1.5, j=3.0, spreads=[1.0] * 6, memory=0.5)
    assert memory.choose([white, tremble]) is white  # no memory is better


def test_white_noise_is_tried_first_and_every_pair_once(monkeypatch):
    class Data:
        clips = staticmethod(lambda split: split)

    monkeypatch.setattr(memory, "fit_temperature", lambda model, clips: 0.29)
    tried = memory.pairs(None, Data)
    assert tried[0] == {"temperature": 0.29, "memory": 0.0}
    assert len({tuple(pair.values()) for pair in tried}) == len(tried) == 21
    assert {"temperature": 0.3, "memory": 0.9} in tried


def test_what_is_turned_up_is_fitted_anew_where_it_changes_how_lively_samples_are(monkeypatch):
    class Data:
        clips = staticmethod(lambda split: split)

    width = lambda model, clips, component_temperature=1.0, memory=0.0: (
        0.3 / component_temperature + memory / 10
    )
    monkeypatch.setattr(variety, "fit_temperature", width)
    rows = [{"turned up": name} | sampling for name, sampling in variety.settings(None, Data)]
    calm, *others = rows
    assert calm == {"turned up": "nothing", "temperature": 0.3, "component_temperature": 1.0}
    assert len({tuple(row.items()) for row in rows}) == len(rows) == 9
    slow = [row for row in others if row["turned up"] == "memory"]
    assert [row["temperature"] for row in slow] == pytest.approx([0.38, 0.39])
    assert all("memory" not in row for row in rows if row not in slow)


def test_weights_that_are_used_with_a_memory_have_a_white_row_of_their_own(monkeypatch):
    class Used:
        sampling = {"temperature": 0.5, "memory": 0.9}

    class Data:
        clips = staticmethod(lambda split: split)

    monkeypatch.setattr(samples, "fit_temperature", lambda model, clips: 0.2)
    assert samples.white(Used, Data) == {"temperature": 0.2}
    Used.sampling = {"temperature": 0.3}
    assert samples.white(Used, Data) == {"temperature": 0.3}
