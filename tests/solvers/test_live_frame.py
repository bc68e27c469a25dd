"""What is done to drawn frames: bounds of bodies, whatever was drawn, and a stand."""

import math

import pytest
import torch
from tiny_lstm import tiny_clips, tiny_lstm

from motionlab.solvers.energy import Before
from motionlab.solvers.guided import Going
from motionlab.solvers.live_control import LiveControl
from motionlab.solvers.live_frame import (
    ASIDE,
    BACK,
    BRAKES,
    GLIDES,
    LIMIT,
    SLOWER,
    SWAY,
    SWING,
    Gliding,
    bounded,
    stand_of,
    stood,
)  # fmt: skip

COLUMNS = [0, 1, 2]


@pytest.fixture(scope="module")
def walker():
    model = tiny_lstm(tiny_clips("walk_1.2", "run_3.0", "walk_0.8_turn_left_0.5"), updates=12)
    model.start_names = ("walk 1.2 m/s", "run 3.0 m/s", "stand")
    return model


def drawn(model, count, size):
    chance = torch.Generator().manual_seed(0)
    return size * torch.randn(count, model.kept, generator=chance)


def goings(model, count):
    chance = torch.Generator().manual_seed(1)
    place, velocity, turn = (
        torch.randn(shape, generator=chance).double()
        for shape in ((count, 3), (count, 2), (count,))
    )
    return Going(model.fps, place, 3 * velocity, 3 * turn)


@pytest.mark.parametrize("size", [1.0, 8.0, 1e6])
def test_a_frame_is_what_a_body_can_do_who_is_asked_for_this(walker, size):
    going, normalizer = goings(walker, 200), walker.normalizer
    speed, bend = torch.rand(200).double() * 3, torch.randn(200).double()
    seen = bounded(drawn(walker, 200, size), COLUMNS, normalizer, going, speed, bend)
    assert seen.isfinite().all() and seen[:, 3:].abs().max() <= LIMIT
    left, ahead, turn = (normalizer.inverse(seen)[:, :3] * walker.fps).double().unbind(1)
    most = torch.maximum(speed, going.velocity.norm(dim=1) - BRAKES) + SWAY
    assert (torch.hypot(left, ahead) <= most + 1e-4).all()
    assert left.abs().max() <= ASIDE + 1e-4 and ahead.min() >= -BACK - 1e-4
    assert (turn.abs() <= torch.maximum(bend.abs(), going.turn.abs() - SLOWER) + SWING + 1e-4).all()


def test_what_a_body_does_anyway_is_left_as_it_is(walker):
    (clip,) = tiny_clips("walk_1.2")
    rows = walker.encoding.encode(clip)[5:40]
    seen = walker.normalizer(rows)
    velocity, none = torch.tensor([[0.0, 1.2]]).double(), torch.zeros(1).double()
    going = Going(walker.fps, torch.zeros(1, 3).double(), velocity, none)
    going = going[torch.zeros(len(rows), dtype=torch.long)]
    asked = torch.full((len(rows),), 1.2).double()
    kept = bounded(seen.clone(), COLUMNS, walker.normalizer, going, asked, 0 * asked)
    torch.testing.assert_close(kept, seen.clamp(-LIMIT, LIMIT))


def test_who_is_far_too_fast_is_slowed_at_the_pace_of_people(walker):
    """A network that would go on at 9 m/s for ever, asked for 1."""
    seen = walker.normalizer(torch.zeros(1, walker.encoding.dim))
    seen[:, 1] = 1e3
    velocity, none = torch.tensor([[0.0, 9.0]]).double(), torch.zeros(1).double()
    going, paces = Going(walker.fps, torch.zeros(1, 3).double(), velocity, none), []
    std, mean = walker.normalizer.std[:3], walker.normalizer.mean[:3]
    for _ in range(150):
        kept = bounded(seen.clone(), COLUMNS, walker.normalizer, going, none + 1.0, none)
        going.move(kept[:, :3] * std + mean)
        paces.append(float(going.velocity.norm()))
    slowing = -torch.tensor(paces).diff() * walker.fps
    assert slowing[60:].max() < 4 and 0.9 < paces[-1] < 1.0 + SWAY + 0.05


def test_a_stand_is_come_to_and_without_one_bodies_move_less(walker):
    body = torch.arange(walker.kept) > 2
    stand = stand_of(walker)
    first = last = drawn(walker, 4, 1.0)
    for _ in range(30):
        last = stood(last, last, body, stand)
    assert (last - stand)[:, body].abs().max() < 0.02 * (first - stand)[:, body].abs().max()
    torch.testing.assert_close(last[:, ~body], first[:, ~body])
    moved = stood(first + 1, first, body, None) - first
    assert (moved[:, body] < 0.5).all() and (moved[:, ~body] > 0.99).all()
    walker_without = tiny_lstm(tiny_clips("walk_1.2"), updates=1)
    assert stand_of(walker_without) is None


def test_who_glides_is_reminded_of_steps_and_who_walks_or_stands_is_not(walker):
    (clip,) = tiny_clips("walk_1.2")
    walk = walker.encoding.encode(clip)[10:70]
    stiff = torch.cat([walk[:, :3], walk[:1, 3:].expand(60, -1)], 1)  # goes, and moves no limb
    still = walk[:1].repeat(60, 1)
    still[:, :3] = 0
    features = torch.stack([walk, stiff, still])
    gliding, place = Gliding(walker, 3), torch.zeros(3, 3)
    state = walker.observe(features[:, :1])
    held = state.hidden.clone()
    going = Going.of(walker.fps, place.double(), features[:, :9, :3])
    for i in range(1, 56, 5):
        before = features[:, i - 1]
        gliding.remind(features[:, i : i + 5], before, Before(state, before, place), going)
        if i + 5 <= GLIDES * walker.fps:
            torch.testing.assert_close(state.hidden, held)
    assert gliding.reminded[0] == gliding.reminded[2] == 0 < gliding.reminded[1]
    torch.testing.assert_close(state.hidden[[0, 2]], held[[0, 2]])
    torch.testing.assert_close(state.hidden[1], walker.starts.hidden[0])  # the walk's, at its speed


@pytest.mark.parametrize("window", [1, 5])
def test_random_commands_for_some_seconds_lead_to_no_strange_frame(walker, window):
    one = LiveControl(walker, "walk", 3, futures=4, window=window)
    chance, made = torch.Generator().manual_seed(3), []
    push = one.behind.go_on
    one.behind.go_on = lambda frames: made.append(frames.clone()) or push(frames)
    while one.frames < 8 * walker.fps:
        pace, way = torch.rand(2, 3, generator=chance)
        one.steer(torch.where(pace < 0.2, 0.0, 100 * pace), 2 * math.pi * way)  # 100 m/s, too
        for _ in range(1 if window == 1 else 3):
            one.go_on()
    features = torch.cat(made, 1)
    assert one.lost == [0, 0, 0]
    assert walker.normalizer(features)[..., 3:].abs().max() <= LIMIT + 1e-3
    steps = features[..., :2].norm(dim=-1) * walker.fps
    assert steps.max() <= one.fastest + SWAY + 1e-3
