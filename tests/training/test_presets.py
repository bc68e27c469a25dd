"""Learning rates and the model that a preset asks for."""

import math
from dataclasses import replace

import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st

from motionlab.errors import TrainingError
from motionlab.training import PRESETS, build


def test_every_model_has_every_preset():
    assert all(set(its) == {"smoke", "table", "ship", "paper"} for its in PRESETS.values())


@given(st.integers(1, 300), st.integers(0, 100), st.integers(0, 100))
def test_rate_rises_stays_and_falls(smoke, stay, warmup, decay):
    updates = warmup + stay + decay
    preset = smoke(updates=updates, warmup=warmup, decay=decay)
    rates = [preset.rate(i) for i in range(updates)]
    rise, level, fall = rates[:warmup], rates[warmup : warmup + stay], rates[warmup + stay :]
    assert level == [preset.learning_rate] * stay
    assert rise == sorted(rise) and fall == sorted(fall, reverse=True)
    assert 0 < min(rates) and max(rates) == preset.learning_rate
    # what was done before the fall is the same whatever the total
    longer = replace(preset, updates=updates + 1000)
    for i in range(updates - decay):
        assert longer.rate(i) == rates[i]


def test_the_papers_rate_falls_by_a_twentieth_an_epoch():
    preset = PRESETS["lstm-gmm"]["paper"]
    assert preset.skip == 0
    assert preset.rate(0) == 1e-3 and preset.rate(200) == pytest.approx(0.95e-3)


@pytest.mark.parametrize(
    "other",
    [{"updates": 0}, {"batch": 0}, {"frames": 1}, {"learning_rate": 0.0}, {"noise": -0.1},
     {"clip": 0.0}, {"warmup": -1}, {"learning_rate": math.nan}, {"noise": math.nan},
     {"shrink": -1.0}, {"skip": 1.5}, {"skip": math.nan}, {"optimizer": "adamw"}, {"seed": -1}, {"seed": 10**18}],
)  # fmt: skip
def test_settings_that_make_no_sense(smoke, other):
    with pytest.raises(TrainingError, match=next(iter(other))):
        smoke(**other)


def test_first_weights_depend_on_the_seed_alone(gaits, smoke):
    torch.manual_seed(1)
    before = torch.get_rng_state()
    first, again, other = (build(gaits, smoke(seed=seed)) for seed in (0, 0, 1))
    assert torch.equal(torch.get_rng_state(), before)  # nobody else's chance is touched
    assert torch.equal(first.leave.weight, again.leave.weight)
    assert not torch.equal(first.leave.weight, other.leave.weight)
    assert torch.equal(first.normalizer.std, gaits.normalizer.std)
