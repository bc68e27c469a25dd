"""One window solved: never worse than its guess, by any method, and none drags another along."""

import pytest
import torch

from motionlab.models import Mixture
from motionlab.solvers import terms
from motionlab.solvers.energy import Energy
from motionlab.solvers.window import METHODS, solve, spread


@pytest.fixture
def energy(network, window):
    return Energy(network, window[0], {"speed": terms.speed(1.5, 30.0), "turn": terms.turn(0.3)})


@pytest.mark.parametrize("method", METHODS)
def test_nothing_is_worse_than_the_guess_and_searches_are_better(energy, window, method):
    _, s, d = window
    guess = energy(s, d)
    chance = torch.Generator().manual_seed(0)
    found = solve(energy, s, d, method, 8, chance)
    torch.testing.assert_close(energy(found.s, found.d), found.energy)
    assert (found.energy <= guess + 1e-9).all() and found.evaluations >= 1
    if method == "none":
        torch.testing.assert_close(found.s, s)
    if method in ("adam", "lbfgs"):
        assert (found.energy < guess - 1).all()


def test_windows_of_a_batch_are_solved_as_if_alone(network, window):
    before, s, d = window
    both = solve(Energy(network, before), s, d, steps=6)
    alone = solve(Energy(network, before[[1]]), s[1:], d[1:], steps=6)
    torch.testing.assert_close(both.s[1:], alone.s)
    torch.testing.assert_close(both.energy[1:], alone.energy)


@pytest.mark.parametrize("method", METHODS)
def test_a_term_that_breaks_does_not_break_the_motion(network, window, method):
    """A slope without a number moves nothing; a value without one is never the best. L-BFGS left alone
    has NaN for its unknowns then."""
    before, s, d = window
    calls = []

    def breaks(features, positions, contacts):
        calls.append(1)
        return features.sum((1, 2)) * (torch.nan if len(calls) > 1 else 1.0)

    chance = torch.Generator().manual_seed(0)
    found = solve(Energy(network, before, {"breaks": breaks}), s, d, method, 5, chance)
    assert found.s.isfinite().all() and found.energy.isfinite().all()
    if method not in ("swarm", "paper"):  # which ask one particle after the other
        torch.testing.assert_close(found.s, s)


@pytest.mark.parametrize("method", ["adam", "lbfgs"])
def test_a_window_that_breaks_does_not_stop_the_others(network, window, method):
    before, s, d = window
    calls = []

    def breaks(features, positions, contacts):
        calls.append(1)
        broken = torch.tensor([1.0, torch.nan if len(calls) > 1 else 1.0])
        return 0 * features.sum((1, 2)) * broken

    wishes = {"speed": terms.speed(1.5, 30.0), "breaks": breaks}
    guess = Energy(network, before, {"speed": wishes["speed"]})(s, d)
    found = solve(Energy(network, before, wishes), s, d, method, 8)
    assert found.s.isfinite().all()
    assert found.energy[0] < guess[0] - 1 and found.energy[1] <= guess[1] + 1e-4


def test_spread_is_that_of_the_component_a_frame_came_from():
    means = torch.tensor([0.0, 10.0, 20.0])[:, None].expand(3, 4)
    stds = torch.tensor([1.0, 2.0, 3.0])[:, None].expand(3, 4)
    mixture = Mixture(torch.tensor([0.2, 0.3, 0.5]).log(), means, stds)
    frames = torch.tensor([0.5, 11.0, 19.0, 60.0])[:, None].expand(4, 4)
    expected = torch.tensor([1.0, 2.0, 3.0, 3.0])[:, None].expand(4, 4)
    wide = Mixture(*(part.expand(4, *part.shape) for part in mixture))
    assert torch.equal(spread(wide, frames), expected)
