"""Rows of what was tried: each changes what it says, for as long as it lasts, and nothing after."""

from __future__ import annotations

import math

import numpy as np
import pytest
import torch
from tiny_lstm import tiny_clips, tiny_lstm

from experiments.rnn_gan.steering_attempts import ATTEMPTS, AskedGliding, otherwise
from motionlab.solvers import live_control
from motionlab.solvers.guided import Going
from motionlab.solvers.live_aim import HURRY, SLOWED, Aim


@pytest.fixture(scope="module")
def walker():
    model = tiny_lstm(tiny_clips("walk_1.2", "run_3.0"), updates=4)
    model.start_names = ("walk 1.2 m/s", "run 3.0 m/s")
    return model


def test_a_row_is_left_as_it_was_found():
    plain = live_control.Gliding, live_control.LiveControl.go_on, Aim.wanted
    for changes in ATTEMPTS.values():
        with otherwise(changes):
            now = live_control.Gliding, live_control.LiveControl.go_on, Aim.wanted
            assert (now != plain) == bool(changes)
        assert (live_control.Gliding, live_control.LiveControl.go_on, Aim.wanted) == plain


def test_who_glides_at_a_walk_and_is_asked_to_run_is_reminded_of_a_run(walker):
    with otherwise(ATTEMPTS["reminded at the speed that is asked"]):
        live = live_control.LiveControl(walker, "walk", 2, way="push")
        live.steer([1.2, 3.0])
        live.go_on()
    assert isinstance(live.gliding, AskedGliding)
    assert [live.gliding.start_for(row, live.going) for row in (0, 1)] == [0, 1]


def test_who_turns_gets_no_faster():
    velocity = torch.tensor([[0.0, 1.5]] * 3).double()
    going = Going(30.0, torch.zeros(3, 3).double(), velocity, torch.zeros(3).double())
    aim = Aim.none(going)
    aim.speed[:], aim.direction[:] = 3.0, torch.tensor([0.0, 0.5, 1.2]).double()
    plain = aim.wanted(going)
    with otherwise(ATTEMPTS["who turns gets no faster"]):
        speed, bend, off = aim.wanted(going)
    np.testing.assert_allclose(speed, [1.5 + HURRY, 1.5 + HURRY / 2, SLOWED])
    np.testing.assert_array_equal(bend, plain[1])
    assert plain[0][1] == 1.5 + HURRY and math.isclose(off[1], 0.5)
