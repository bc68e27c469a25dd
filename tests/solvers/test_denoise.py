"""A clip with noise on it comes back nearer to what it was."""

from dataclasses import replace

import pytest
import roma
import torch

import motionlab
from motionlab import datasets
from motionlab.motion import Motion
from motionlab.solvers import NoiseLevels, denoise


def noisy(motion: Motion, levels: NoiseLevels, seed: int = 0) -> Motion:
    """White noise on the root's place and on every angle."""
    chance = torch.Generator().manual_seed(seed)
    normal = lambda *shape: torch.randn(*shape, generator=chance)
    turns = levels.angle_rad * normal(*motion.rotations.shape[:2], 3)
    return replace(
        motion,
        root_positions=motion.root_positions + levels.root_m * normal(len(motion), 3),
        rotations=motion.rotations @ roma.rotvec_to_rotmat(turns),
        contacts=None,
    )


def error(motion: Motion, truth: Motion) -> float:
    """Centimetres, mean over joints and frames."""
    return 100 * float((motion.positions() - truth.positions()).norm(dim=-1).mean())


@pytest.fixture(scope="module")
def clips():
    return [clip[:100] for clip in datasets.load("gaits", "val")[:2]]


@pytest.fixture(scope="module")
def model():
    return motionlab.load("lstm-gmm-contacts")


def test_a_noisy_clip_comes_back_nearer_to_what_it_was(clips, model):
    levels = NoiseLevels(0.02, 0.08)
    seen = [noisy(clip, levels, i) for i, clip in enumerate(clips)]
    for found, truth, was in zip(denoise(seen, model), clips, seen, strict=True):
        assert len(found.motion) == len(truth)
        assert error(found.motion, truth) < 0.6 * error(was, truth)
        said = found.record["noise"]
        assert said["estimated"]
        assert said["root_m"] == pytest.approx(levels.root_m, rel=0.2)
        assert said["angle_rad"] == pytest.approx(levels.angle_rad, rel=0.2)
