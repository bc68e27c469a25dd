"""Starts that are like nothing a network has learned: who is warned, and who is left in peace."""

import warnings
from dataclasses import replace
from types import SimpleNamespace

import pytest
import torch

from motionlab import datasets
from motionlab.datasets import gaits
from motionlab.errors import ModelError
from motionlab.models.familiar import LEAST, Familiar, bounds, measure
from tests.tiny_lstm import tiny_lstm

MOVES, LIE = "move as less than 1 %", "lie farther from the mean"


@pytest.fixture(scope="module")
def held_out():
    """Walks that the network has not seen."""
    return [gaits.make(seconds=4, speed=1.0 + 0.05 * i, seed=i) for i in range(9)]


@pytest.fixture
def model(trained, held_out):
    trained.familiar = bounds(trained, [trained.encoding.encode(m) for m in held_out])
    yield trained
    trained.familiar = None


@pytest.fixture(scope="module")
def trained():
    return tiny_lstm(datasets.load("gaits")[:4], updates=120)


def said(model, features, **options):
    """What `observe` says of features, each warning once for its line."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("default")
        for _ in range(3):
            model.observe(features, **options)
    assert all(w.filename == __file__ for w in caught)  # the line of whoever called
    return [str(w.message) for w in caught]


def encoded(model, motion):
    return model.encoding.encode(motion)[None]


def faster(motion, times):
    rows = slice(None, None, times)
    return replace(
        motion, root_positions=motion.root_positions[rows], rotations=motion.rotations[rows],
        contacts=motion.contacts[rows],
    )  # fmt: skip


def test_bounds_are_what_one_second_in_a_hundred_lies_beyond():
    nats = torch.arange(100.0)

    class Named(SimpleNamespace):
        """Of whom each second is as likely, and as far, as its number says."""

        def log_prob(self, features):
            return features[:, 1:, 0]

    model = Named(fps=30.0, normalizer=torch.nn.Identity())
    model.normalizer.mean = torch.zeros(1)
    clips = [torch.full((30, 1), float(n)) for n in nats]
    found = bounds(model, [*clips[::-1], torch.full((29, 1), -1e6)])  # no whole second
    assert found.likelihood == pytest.approx(nats.quantile(0.01).item(), abs=0.01)
    assert found.distance == pytest.approx(nats.square().quantile(0.99).item(), rel=1e-4)
    assert bounds(model, clips[: LEAST - 1]) is None and bounds(model, []) is None
    assert bounds(model, clips[:LEAST]) is not None


def test_what_is_measured_is_of_the_last_second(model, held_out):
    features = encoded(model, held_out[0])
    likelihood, distance = measure(model, features)
    torch.testing.assert_close(likelihood, model.log_prob(features[:, -30:]).mean(1))
    seen = model.normalizer(features[:, -30:])
    torch.testing.assert_close(distance, seen.square().mean((1, 2)))
    with pytest.raises(ModelError, match="at least 2 frames"):
        measure(model, features[:, :1])


def test_motion_of_its_kind_is_nothing_to_speak_of(model, held_out):
    for motion in held_out[1:4]:
        assert said(model, encoded(model, motion)) == []
        assert said(model, encoded(model, motion)[0]) == []  # a batch of one


def test_each_strange_start_is_told_once_with_what_to_do(model, held_out):
    motion = held_out[3]
    (fast,) = said(model, encoded(model, faster(motion, 4)))
    assert MOVES in fast and "resample(30)" in fast
    for unit in (0.01, 100):
        other = replace(motion, root_positions=unit * motion.root_positions)
        (poses,) = said(model, encoded(model, other))
        assert LIE in poses and "metres" in poses and "retarget" in poses


def test_in_a_large_batch_some_may_be_strange(model, held_out):
    usual = encoded(model, held_out[2])[:, :60]
    strange = encoded(model, faster(held_out[2], 4))[:, :30]
    usual = usual[:, -strange.shape[1] :]
    assert said(model, torch.cat([usual] * 39 + [strange])) == []
    assert len(said(model, torch.cat([usual] * 10 + [strange]))) == 1


def test_who_is_left_in_peace(model, held_out):
    strange = encoded(model, faster(held_out[0], 4))
    assert said(model, strange) and said(model, strange, doubt=False) == []
    assert said(model, strange[:, :14]) == []  # less than half a second
    assert said(model, strange.clone().requires_grad_()) == []  # a search
    model.familiar = None  # weights of before
    assert said(model, strange) == []


def test_the_state_and_its_gradient_are_the_same_with_bounds_and_without(model, held_out):
    results = []
    for familiar in (Familiar(-1e9, 1e9), None):
        model.familiar = familiar
        features = encoded(model, held_out[0]).requires_grad_()
        state = model.observe(features)
        (gradient,) = torch.autograd.grad(state.hidden.sum(), features)
        results.append((*model.observe(features.detach()), gradient))
    for with_bounds, without in zip(*results, strict=True):
        assert torch.equal(with_bounds, without)


def test_without_bounds_nothing_is_computed(model, held_out, monkeypatch):
    def fail(*_):
        raise AssertionError("observe measured without need")

    monkeypatch.setattr(model, "log_prob", fail)
    model.familiar = None
    model.observe(encoded(model, held_out[0]))
