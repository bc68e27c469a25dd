"""Measures with known answers: people foretell themselves, and a coin is right half of the time."""

from __future__ import annotations

import itertools
import math
from types import SimpleNamespace

import numpy as np
import pytest
import torch

from experiments.claims.comparison import METHODS, PAIRS, order_of
from experiments.comparison import measures, speed
from experiments.comparison.begun import joints_of
from experiments.comparison.methods import Method
from experiments.comparison.order import CRITIC, FRECHET, MANIFOLD, order
from motionlab import metrics


def test_errors_of_what_came_are_0_and_of_what_is_off_as_far_as_it_is(walks):
    rows, encoding = walks
    came = joints_of(encoding, rows)[:, :20]
    made = torch.stack([came[0], came[1] + torch.tensor([0.03, 0.0, 0.04]), came[2], came[3]])
    made[2, 10:] = torch.nan
    same, off, gone, _ = measures.errors(made, came, 30)
    # at 80 ms as much as in the frames around
    assert max(same) == 0 and off == pytest.approx([5.0] * 6, abs=1e-3)
    assert all(map(math.isinf, gone))


@pytest.mark.parametrize("right", [[0.5] * 6, [1.0] * 6, [0.9, 0.2, 0.6, 0.7, 0.4, 0.8]])
def test_a_critics_p_is_the_share_of_all_exchanges(right):
    off = np.array(right) - 0.5
    every = [np.dot(signs, off) for signs in itertools.product([-1, 1], repeat=6)]
    wanted = np.mean([value >= off.sum() - 1e-12 for value in every])
    assert measures.by_chance(right) == pytest.approx(wanted, abs=0.02)


def test_a_walk_that_is_moved_stands_where_the_other_stood(walks):
    rows, encoding = walks
    one, other = joints_of(encoding, rows)[:2]
    skeleton = encoding.skeleton
    there = measures.moved_to(one[:50], one[60:90], 30, skeleton)
    assert torch.allclose(
        metrics.facing(there, skeleton)[29], metrics.facing(one[60:90], skeleton)[-1], atol=1e-5
    )
    assert torch.allclose(there[29, 0, [0, 2]], one[89, 0, [0, 2]], atol=1e-5)
    apart = lambda points: (points[:, :, None] - points[:, None]).norm(dim=-1)
    moved = measures.moved_to(other[:10], one[:30], 5, skeleton)
    assert torch.allclose(apart(moved), apart(other[:10]), atol=1e-4)


def test_order_of_methods_that_slide_more_and_more(walks):
    """Judges see GAN2 as recorded, GAN1 off by some, RNN by more; and nothing between equals."""
    rows, encoding = walks
    points = [joints_of(encoding, some) for some in rows.repeat(3, 1, 1)]
    reference = metrics.Frechet.fit(points, encoding.skeleton, 30)
    gait = SimpleNamespace(frechet=reference)
    chance = torch.Generator().manual_seed(0)

    def found(noise):
        shaken = [p + noise * torch.randn(p.shape, generator=chance) for p in points]
        values = (noise + 0.01 * torch.rand(len(points), generator=chance)).tolist()
        return {CRITIC: values, MANIFOLD: values, measures.SKATE: values, measures.JERK: values,
                "moments": [reference.moments(p, 30) for p in shaken]}  # fmt: skip

    people = {key: [0.0] * len(points) for key in (measures.SKATE, measures.JERK)}
    each = dict(zip(METHODS, map(found, (0.0, 0.05, 0.2)), strict=True))
    judges = order(each, people, gait)
    assert set(judges) == {CRITIC, FRECHET, MANIFOLD, measures.SKATE, measures.JERK}
    said = {judge: [order_of(pairs[pair]) for pair in PAIRS] for judge, pairs in judges.items()}
    assert all(words == ["as people"] * 3 for words in said.values()), said
    equal = order(dict.fromkeys(METHODS, each["GAN1"]), people, gait)
    assert all(order_of(pair) == "undecided" for its in equal.values() for pair in its.values())


def test_speed_is_a_ratio_to_the_reference_and_none_where_it_is_too_dear(begun, monkeypatch):
    cost = {speed.REFERENCE: 2.0, "slow": 8.0}
    monkeypatch.setattr(speed, "seconds", lambda method, many: cost[method.title] * len(many))
    row = lambda name, kind, **more: Method(name, kind, "", None, **more)
    reference = row("RNN", "as it ships")
    slow = row("slow", "nobody trained it", without={"256": "too dear"})
    assert speed.ratios(reference, reference, begun) == {"1": 1.0, "256": 1.0}
    assert speed.ratios(slow, reference, begun) == {"1": 0.25, "256": None}
