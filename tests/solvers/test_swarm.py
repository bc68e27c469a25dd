"""The swarm on functions whose least value is known."""

import math

import pytest
import torch

from motionlab.errors import SolverError
from motionlab.solvers.swarm import swarm

FUNCTIONS = {  # all 0 at `at` everywhere; what is left after the swarm
    "sphere": (lambda x: x.square().sum(-1), 0.0, 5, 1e-6),
    "Rosenbrock": (
        lambda x: (100 * (x[..., 1:] - x[..., :-1] ** 2) ** 2 + (1 - x[..., :-1]) ** 2).sum(-1),
        1.0, 2, 1e-4,
    ),
    "Rastrigin": (
        lambda x: (x**2 - 10 * (2 * math.pi * x).cos() + 10).sum(-1), 0.0, 2, 1e-4,
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", FUNCTIONS)
def test_standard_functions(name):
    function, at, dim, left = FUNCTIONS[name]
    assert function(torch.full((1, dim), at)).item() == 0
    centre = torch.tensor([[2.3] * dim, [-1.7] * dim, [3.1] * dim], dtype=torch.double)
    chance = torch.Generator().manual_seed(0)
    found = swarm(function, centre, 2.0, particles=40, iterations=200, generator=chance)
    assert found.place.shape == (3, dim) and found.evaluations == 40 * 201
    torch.testing.assert_close(function(found.place), found.value)
    assert (found.value < left).all()
    assert (found.place - at).abs().max() < 0.1


def test_it_is_never_worse_than_the_centre_and_the_same_each_time():
    cliff = lambda x: torch.where(x[..., 0] == 1, 0.0, torch.nan)  # a number nowhere else
    centre = torch.ones(2, 3)
    found = swarm(cliff, centre, 1.0, particles=5, iterations=3)
    assert torch.equal(found.place, centre) and (found.value == 0).all()
    runs = [
        swarm(FUNCTIONS["sphere"][0], centre, 1.0, generator=torch.Generator().manual_seed(3))
        for _ in range(2)
    ]
    assert torch.equal(runs[0].place, runs[1].place) and (runs[0].value < 3).all()


def test_more_moves_find_no_less():
    function, centre = FUNCTIONS["Rastrigin"][0], torch.full((1, 4), 2.5)
    values = [
        swarm(function, centre, 1.0, iterations=n, generator=torch.Generator().manual_seed(1)).value
        for n in (0, 5, 50)
    ]
    assert values[0] >= values[1] >= values[2]


def test_what_is_no_swarm_is_told():
    for options in ({"particles": 1}, {"iterations": -1}):
        with pytest.raises(SolverError, match="at least 2 and 0"):
            swarm(FUNCTIONS["sphere"][0], torch.ones(1, 2), 1.0, **options)
    with pytest.raises(SolverError, match="at the centre"):
        swarm(lambda x: x[..., 0] * math.nan, torch.ones(1, 2), 1.0)
