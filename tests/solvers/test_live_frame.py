"""What is done to drawn frames: bounds of bodies, whatever was drawn, and a stand."""

import math

import numpy as np
import pytest
import torch
from tiny_lstm import tiny_clips, tiny_lstm

from motionlab.encodings import JointAngles
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
    Steps,
    bounded,
    slowest_foot,
    stand_of,
    stood,
)  # fmt: skip
from motionlab.solvers.live_going import Rows
from motionlab.solvers.live_points import FeetPoints, rotations_of


@pytest.fixture(scope="module")
def walker():
    model = tiny_lstm(tiny_clips("walk_1.2", "run_3.0", "walk_0.8_turn_left_0.5"), updates=12)
    model.start_names = ("walk 1.2 m/s", "run 3.0 m/s", "stand")
    return model


def drawn(model, count, size):
    chance = torch.Generator().manual_seed(0)
    return (size * torch.randn(count, model.kept, generator=chance)).numpy()


def goings(model, count):
    chance = torch.Generator().manual_seed(1)
    place, velocity, turn = (
        torch.randn(shape, generator=chance).double()
        for shape in ((count, 3), (count, 2), (count,))
    )
    return Going(model.fps, place, 3 * velocity, 3 * turn)


def numbers(*values):
    return np.array(values, dtype=float)


def test_rows_move_as_going_does(walker):
    going = goings(walker, 50)
    rows = Rows.of(going)
    chance = torch.Generator().manual_seed(2)
    for step in torch.randn(20, 50, 3, generator=chance) / 10:
        going.move(step)
        rows.move(step.numpy())
    same = rows.going()
    for name in ("place", "velocity", "turn"):
        torch.testing.assert_close(getattr(same, name), getattr(going, name))
    assert Rows.of(going, 3).place.tolist() == going.place.repeat_interleave(3, 0).tolist()


def test_feet_of_futures_are_where_the_encoding_has_them(walker):
    (clip,) = tiny_clips("walk_0.8_turn_left_0.5")
    encoding = walker.encoding
    features = encoding.encode(clip)[4:28].reshape(2, 12, -1)
    start = torch.tensor([[1.0, 2.0, 0.5], [0.0, -1.0, 3.0]]).double()
    feet = FeetPoints(encoding)
    there = encoding.positions(features, start, points=frozenset(feet.feet))
    rows = Rows.of(Going.of(walker.fps, start, features[:, :1, :3]))
    places = [rows.place]
    for t in range(1, 12):
        rows.move(features[:, t, :3].numpy())
        places.append(rows.place)
    found = feet(features, np.stack(places, 1))
    torch.testing.assert_close(found[:, :, feet.feet], there[:, :, feet.feet], atol=1e-5, rtol=0)
    assert found[:, :, 0].isnan().all()  # nobody looks at the root


@pytest.mark.parametrize("rotation", ["vector", "6d"])
def test_bodies_of_a_window_stand_as_the_encoding_has_them(walker, rotation):
    (clip,) = tiny_clips("walk_0.8_turn_left_0.5")
    encoding = JointAngles(clip.skeleton, clip.fps, rotation=rotation)
    features = encoding.encode(clip)[4:28].reshape(2, 12, -1)
    start = torch.tensor([[1.0, 2.0, 0.5], [0.0, -1.0, 3.0]]).double()
    for theirs, ours in zip(
        encoding.rotations(features, start), rotations_of(encoding, features, start), strict=True
    ):
        torch.testing.assert_close(ours, theirs.float(), atol=2e-6, rtol=0)


@pytest.mark.parametrize("size", [1.0, 8.0, 1e6])
def test_a_frame_is_what_a_body_can_do_who_is_asked_for_this(walker, size):
    going, steps = Rows.of(goings(walker, 200)), Steps.of(walker.normalizer)
    chance = np.random.default_rng(0)
    speed, bend = 3 * chance.random(200), chance.normal(size=200)
    seen = bounded(drawn(walker, 200, size), steps, going, speed, bend)
    assert np.isfinite(seen).all() and np.abs(seen[:, 3:]).max() <= LIMIT
    rows = walker.normalizer.inverse(torch.from_numpy(seen)).double().numpy()
    left, ahead, turn = rows[:, :3].T * walker.fps
    most = np.maximum(speed, going.pace - BRAKES) + SWAY
    assert (np.hypot(left, ahead) <= most + 1e-4).all()
    assert np.abs(left).max() <= ASIDE + 1e-4 and ahead.min() >= -BACK - 1e-4
    most = np.maximum(np.abs(bend), np.abs(going.turn) - SLOWER) + SWING
    assert (np.abs(turn) <= most + 1e-4).all()


def test_what_a_body_does_anyway_is_left_as_it_is(walker):
    (clip,) = tiny_clips("walk_1.2")
    rows = walker.encoding.encode(clip)[5:40]
    seen = walker.normalizer(rows).numpy()
    count = len(seen)
    going = Rows(
        walker.fps, np.zeros((count, 3)), numbers([0, 1.2]).repeat(count, 0), np.zeros(count)
    )
    kept = bounded(seen, Steps.of(walker.normalizer), going, np.full(count, 1.2), np.zeros(count))
    np.testing.assert_allclose(kept, seen.clip(-LIMIT, LIMIT), rtol=1e-5, atol=1e-5)


def test_who_is_far_too_fast_is_slowed_at_the_pace_of_people(walker):
    """A network that would go on at 9 m/s for ever, asked for 1."""
    seen = walker.normalizer(torch.zeros(1, walker.encoding.dim)).numpy()
    seen[:, 1] = 1e3
    going = Rows(walker.fps, np.zeros((1, 3)), numbers([0, 9]), np.zeros(1))
    paces, steps = [], Steps.of(walker.normalizer)
    for _ in range(150):
        kept = bounded(seen, steps, going, numbers(1), numbers(0))
        going.move(steps.raw(kept))
        paces.append(float(going.pace[0]))
    slowing = -np.diff(paces) * walker.fps
    assert slowing[60:].max() < 4 and 0.9 < paces[-1] < 1.0 + SWAY + 0.05


def test_a_stand_is_come_to_and_without_one_bodies_move_less(walker):
    body = np.arange(walker.kept) > 2
    stand = stand_of(walker)
    first = last = drawn(walker, 4, 1.0)
    for _ in range(30):
        last = stood(last, last, body, stand)
    assert np.abs(last - stand)[:, body].max() < 0.02 * np.abs(first - stand)[:, body].max()
    np.testing.assert_array_equal(last[:, ~body], first[:, ~body])
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
    positions = walker.encoding.positions(features)
    slowest = slowest_foot(positions, walker.encoding.skeleton, walker.fps)
    state = walker.observe(features[:, :1])
    held = state.hidden.clone()
    going = Going.of(walker.fps, place.double(), features[:, :9, :3])
    for i in range(1, 56, 5):
        before = Before(state, features[:, i - 1], place)
        gliding.remind(slowest[:, i - 1 : i + 4], before, going)
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
