"""Naming styles: a classifier that names what differs, and the number of styles that are visited."""

from __future__ import annotations

import pytest

from experiments.rnn_gan import styles
from motionlab.datasets import gaits
from motionlab.encodings import JointAngles


@pytest.fixture(scope="module")
def clips():
    """Slow walks are one style, fast ones another."""
    encoding = JointAngles(gaits.make(seconds=1).skeleton)
    made = []
    for split, seeds in (("train", range(6)), ("test", range(6, 9))):
        for style, speed in (("slow", 0.8), ("fast", 1.7)):
            for seed in seeds:
                motion = gaits.make(seconds=4, speed=speed, noise=0.3, seed=seed)
                made.append(styles.Clip(style, split, "walk", encoding.encode(motion)))
    return encoding, made


def test_styles_are_effective_if_they_are_frequent():
    assert styles.effective([100, 0, 0]) == pytest.approx(1)
    assert styles.effective([5, 5, 5, 5]) == pytest.approx(4)
    assert 1 < styles.effective([99, 1]) < 1.1


def test_what_differs_is_named(clips):
    encoding, made = clips
    data = type("Data", (), {"encoding": encoding})
    naming = styles.Naming(data, made, ["fast", "slow"], seed=0)
    assert styles.matrix(naming, [c for c in made if c.split == "test"]) == [[3, 0], [0, 3]]
    legs = styles.Naming(data, made, ["fast", "slow"], 0, styles.LEGS)
    assert 0 < len(legs.columns) < len(naming.columns) == len(naming.body.feature_names)
    assert styles.matrix(legs, [c for c in made if c.split == "test"]) == [[3, 0], [0, 3]]


def test_the_start_is_the_middle_walk(clips):
    _, made = clips
    odd = [made[0], *made[6:8], made[0]._replace(action="run")]
    start = styles.start_of(odd, 30.0)
    assert len(start) == 60 and start.equal(sorted(
        (c.features for c in odd[:3]), key=lambda f: float(f[:, :2].norm(dim=-1).mean())
    )[1][:60])  # fmt: skip
