"""The runtime, driven by a network that always says the same, so that the walk is known."""

import math

import pytest
import torch
from steady_pfnn import PACE, REST, STRIDE, TURN, bend, layout, steady

from motionlab.models.pfnn.layout import GAITS, split
from motionlab.models.pfnn.walk import begin, seen, step

FORWARD = torch.tensor([[0.0, 0.0, 1.0]])


def walked(network, frames: int, gaits: torch.Tensor | None = None):
    gaits = torch.zeros(1, network.layout.gaits) if gaits is None else gaits
    walk, shown = begin(network, torch.zeros(1, 3), FORWARD), []
    for _ in range(frames):
        frame, walk = step(network, walk, gaits)
        shown.append(frame)
    return walk, shown


def test_steps_and_turns_add_up():
    walk, _ = walked(steady(layout()), 50)
    place, yaw = walk.root
    assert torch.allclose(place[0, [0, 2]], bend(50), atol=1e-5)
    assert float(yaw) == pytest.approx(50 * TURN, abs=1e-5)
    assert float(place[0, 0]) > 0  # a turn of -1 leads to the left, where x is
    assert float(walk.phase) == pytest.approx(50 * STRIDE % 1 * 2 * math.pi, abs=1e-4)


def test_the_trajectory_is_where_the_root_was_and_is_said_to_be():
    walk, _ = walked(steady(layout()), 70)
    wanted = torch.stack([bend(70 + k) for k in range(-30, 26)])
    assert torch.allclose(walk.places[0, :56:5, [0, 2]], wanted[::5], atol=1e-4)
    yaws = TURN * torch.arange(70 - 30, 70 + 26)
    directions = torch.stack([yaws.sin(), yaws.cos()], dim=-1)
    assert torch.allclose(walk.directions[0, :56:5, [0, 2]], directions[::5], atol=1e-4)


def test_a_steady_bend_looks_the_same_from_every_frame():
    """All that the network sees is in the root's frame: what it saw once it sees again."""
    network = steady(layout())
    first, later = (seen(network, walked(network, n)[0], torch.zeros(1, 0)) for n in (70, 95))
    assert torch.allclose(first, later, atol=1e-4)
    parts = split(network.layout.seen, first[0])
    now = network.layout.points // 2
    assert parts["places"][:, now].abs().max() < 1e-6
    assert torch.allclose(parts["directions"][:, now], torch.tensor([0.0, 1.0]), atol=1e-6)
    # the joints are those of the frame before, seen from the root of the frame before
    assert torch.allclose(parts["joints"][:, [0, 2]], REST[:, [0, 2]], atol=2 * PACE)
    assert torch.allclose(parts["joints"][:, 1], REST[:, 1], atol=1e-5)


def test_joints_are_half_what_is_said_and_half_where_they_were_going():
    still = {"step": torch.zeros(2), "turn": torch.zeros(1)}
    moving = torch.full((21, 3), 0.01)
    _, shown = walked(steady(layout(), velocities=moving, **still), 40)
    first, last = shown[0].joints[0], shown[-1].joints[0]
    assert torch.allclose(first, REST + 0.5 * moving, atol=1e-6)
    assert torch.allclose(last, REST + moving, atol=1e-5)  # where x = (x + v) / 2 + rest / 2


def test_rotations_are_twice_the_logarithm_seen_from_the_root():
    half = torch.zeros(21, 3)
    half[:, 1] = 0.15
    _, shown = walked(steady(layout(), rotations=half), 11)
    yaw = 10 * TURN + 0.3
    wanted = torch.tensor([math.sin(yaw), 0.0, math.cos(yaw)])
    assert torch.allclose(shown[-1].rotations[0, 5, :, 2], wanted, atol=1e-5)


def test_who_stands_stays_and_goes_through_the_stride_at_a_tenth():
    network = steady(layout(gaits=6))
    stand = torch.eye(6)[[GAITS.index("stand")]]
    walk, _ = walked(network, 20, stand)
    assert torch.allclose(walk.root[0], torch.zeros(1, 3))
    assert float(walk.phase) == pytest.approx(0.1 * 20 * STRIDE * 2 * math.pi, rel=1e-4)
