"""What is told of refined samples: knees, stances, labels, distances from real motion."""

from __future__ import annotations

import math

import pytest
import torch

from experiments.rnn_gan import refined_samples as refined
from motionlab import contacts
from motionlab.datasets import gaits
from motionlab.encodings import JointAngles
from motionlab.metrics import Interval


@pytest.fixture(scope="module")
def walk():
    motion = gaits.make(seconds=4, speed=1.2)
    return motion, JointAngles(motion.skeleton, contacts=True)


def test_a_straight_leg_is_not_bent_and_a_square_one_is(walk):
    motion, _ = walk
    points = motion.positions().clone()
    hip, knee, ankle = (
        motion.skeleton.roles[f"left_{part}"] for part in ("upper_leg", "lower_leg", "foot")
    )
    points[:, hip] = torch.tensor([0.0, 0.8, 0.0])
    points[:, knee] = torch.tensor([0.0, 0.4, 0.0])
    for end, angle in ((torch.tensor([0.0, 0.0, 0.0]), 0), (torch.tensor([0.0, 0.4, -0.4]), 90)):
        points[:, ankle] = end
        assert refined.bend(points, motion.skeleton, "left") == pytest.approx(angle, abs=0.1)


def test_stances_are_counted_one_by_one():
    down = torch.tensor([[1, 0], [1, 0], [0, 1], [0, 1], [1, 1], [1, 0]], dtype=torch.bool)
    assert refined.stance(down, 10.0) == pytest.approx((2 + 2 + 3) / 3 / 10)
    assert math.isnan(refined.stance(torch.zeros(4, 2, dtype=torch.bool), 10.0))


def test_the_gaits_own_labels_agree_with_speed_and_flipped_ones_do_not(walk):
    motion, encoding = walk
    features = encoding.encode(motion)
    features[:, encoding.slices["contacts"]] = contacts.label(motion)[:, refined.TOES].float()
    found = refined.labels(encoding, [features[None]])
    assert found["F1"] > 0.95
    features[:, encoding.slices["contacts"]] = 1 - features[:, encoding.slices["contacts"]]
    assert refined.labels(encoding, [features[None]])["F1"] < 0.1


def starts(*values):
    return [{"x": list(of)} for of in values]


def test_distances_from_real_are_over_rnns_and_leave_nan_out():
    real = [{"x": 2.0}, {"x": 4.0}]  # mean 3
    rnn = starts((7.0, 7.0), (7.0, math.nan))
    ours = starts((4.0, 4.0), (4.0, 4.0))
    columns = [refined.totals(some, "x") for some in (ours, rnn, real)]
    assert refined.mean(columns[1]) == 7.0
    entries = list(zip(*columns, strict=True))
    assert refined.nearer(entries) == pytest.approx(0.25)
    assert refined.gap(entries) == pytest.approx(1.0 - 4.0)
    assert math.isnan(refined.mean(refined.totals(starts((math.nan,)), "x")))


def test_rows_are_grouped_by_the_clip_they_began_in():
    rows = [[{"x": i} for i in range(5)], [{"x": 10 + i} for i in range(5)]]
    assert refined.grouped(rows, 2) == [{"x": [0, 2, 4, 10, 12, 14]}, {"x": [1, 3, 11, 13]}]


def test_samples_begin_in_clips_by_turns_and_exploded_ones_are_drawn_again():
    class Generator:
        fps, sampling = 30.0, {}
        encoding = type("Encoding", (), {"dim": 3})

        def __init__(self):
            self.calls = []

        def observe(self, begun):
            return begun[:, -1]

        def generate(self, frames, state, generator):
            self.calls.append(len(state))
            made = state[:, None].expand(-1, frames, -1).clone()
            if len(self.calls) == 1:
                made[1, 5] = math.nan
            return made

    model = Generator()
    clips = [torch.full((60, 3), float(i)) for i in (1, 2, 3)]
    made = refined.samples(model, clips, 4, seed=0)
    assert made[:, 0, 0].tolist() == [1, 2, 3, 1] and model.calls == [4, 1]
    assert made.shape == (4, 300, 3)


def test_moved_roots_are_in_centimetres(walk):
    motion, encoding = walk
    raw = encoding.encode(motion)[None].repeat(4, 1, 1)
    ahead = raw.clone()
    ahead[:, 5, 1] += 0.03  # one step is 3 cm longer
    found = refined.moved(encoding, raw, [raw, ahead])["root moved (cm)"]
    assert found[0]["50%"] == pytest.approx(0, abs=1e-3)
    assert found[1]["50%"] == pytest.approx(3, rel=1e-2)


def test_a_variant_that_is_real_motion_is_not_told_from_it(walk):
    _, encoding = walk
    clips = [encoding.encode(gaits.make(seconds=3, speed=0.8 + i / 10, noise=0.3, seed=i))
             for i in range(8)]  # fmt: skip
    variant = refined.Variant(
        encoding, {"val": clips[::2], "test": clips[1::2]},
        [torch.stack(clips[1::2])], [torch.stack(clips[::2])],
    )  # fmt: skip
    told = refined.asked(variant)
    assert isinstance(told, Interval) and told.value == pytest.approx(0.5)
