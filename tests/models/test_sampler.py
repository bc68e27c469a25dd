"""The fast sampler against the loop that can be read, and its rounded weights against whole ones."""

import copy
import math
from types import SimpleNamespace

import pytest
import torch

from motionlab import Skeleton, datasets
from motionlab.encodings import JointAngles, Normalizer
from motionlab.errors import ModelError
from motionlab.models import LstmGmm, State, sampler_few
from motionlab.models.sampler import can_round, choose

OPTIONS = [
    {},
    {"temperature": 0.3},
    {"component_temperature": 0.2},
    {"noise": 0.1},
    {"temperature": 0.7, "component_temperature": 3.0, "noise": 0.05},
    {"memory": 0.8},
]
rounds = pytest.mark.skipif(
    not can_round(torch.zeros(1)), reason="no products with rounded weights: needs an x86 processor"
)


@pytest.fixture(scope="module", params=[True, False], ids=["contacts", "plain"])
def features(request):
    encoding = JointAngles(Skeleton.canonical(), contacts=request.param)
    clips = torch.stack([encoding.encode(m)[:40] for m in datasets.load("gaits", "val")[:4]])
    return encoding, clips


@pytest.fixture(scope="module", params=[0.0, 0.9], ids=["paper", "skip"])
def model(features, request):
    encoding, clips = features
    normalizer = Normalizer.fit(list(clips))
    assert len(normalizer.kept) < encoding.dim  # there are constant channels
    torch.manual_seed(0)
    made = LstmGmm(encoding, normalizer, width=32, components=3, skip=request.param)
    torch.nn.init.normal_(made.leave.weight, std=0.3)  # components that differ
    return made.eval()


@pytest.fixture
def start(model, features):
    return State(*(part.clone() for part in map(torch.detach, model.observe(features[1]))))


def chance(seed=0):
    return torch.Generator().manual_seed(seed)


def in_double(model):
    double = LstmGmm.from_config(model.config()).double()
    double.load_state_dict(model.state_dict())
    return double


def assert_same_motion(model, fast, slow, tolerance):
    """In units of the features' spread."""
    normalize = model.normalizer
    torch.testing.assert_close(normalize(fast), normalize(slow), rtol=0, atol=tolerance)
    torch.testing.assert_close(fast, slow, rtol=0, atol=1e-3)  # the constant channels, too


# -- the same network -----------------------------------------------------------------------------


@pytest.mark.parametrize("rows", [[0], [0, 1, 2, 3], [0, 1, 2] * 6], ids=len)
@pytest.mark.parametrize("options", OPTIONS, ids=str)
def test_it_draws_the_motion_of_the_loop(model, start, options, rows):
    slow, fast, start = chance(), chance(), start[rows]
    expected = model.generate(40, start, generator=slow, **options)
    assert expected.requires_grad
    with torch.no_grad():
        found = model.generate(40, start, generator=fast, **options)
    assert not found.requires_grad and found.shape == expected.shape
    assert_same_motion(model, found, expected.detach(), 1e-4)
    assert torch.equal(fast.get_state(), slow.get_state())


@pytest.mark.parametrize("rows", [[0], [0, 1, 2] * 6], ids=len)
def test_in_double_it_is_the_loop_to_the_last_digits(model, features, rows):
    double = in_double(model)
    start = double.observe(features[1])[rows]
    expected = double.generate(40, start, generator=chance(), noise=0.05)
    with torch.no_grad():
        found = double.generate(40, start, generator=chance(), noise=0.05)
    assert found.dtype == torch.float64
    torch.testing.assert_close(found, expected, rtol=0, atol=1e-9)


@torch.no_grad()
def test_a_batch_is_its_characters_one_by_one(model, start):
    model, start = in_double(model), State(*(part.double() for part in start))
    calm = {"temperature": 1e-9, "component_temperature": 1e-9}  # leaves nothing to chance
    together = model.generate(20, start, **calm)
    ones = [State(*(part[i : i + 1] for part in start)) for i in range(4)]
    alone = torch.cat([model.generate(20, one, **calm) for one in ones])
    torch.testing.assert_close(alone, together, rtol=0, atol=1e-4)


@torch.no_grad()
def test_the_start_and_the_weights_are_left_alone(model, start):
    before = [part.clone() for part in (*start, *model.state_dict().values())]
    model.generate(10, start, noise=0.1)
    for part, its in zip((*start, *model.state_dict().values()), before, strict=True):
        assert torch.equal(part, its)


def test_a_start_may_ask_for_gradients(model, features):
    learning = copy.deepcopy(model).requires_grad_()
    start = learning.observe(features[1])
    assert start.hidden.requires_grad
    with torch.no_grad():
        made, after = learning.go_on(3, start, generator=chance())
        torch.testing.assert_close(
            made, model.generate(3, model.observe(features[1]), generator=chance())
        )
    assert not any(part.requires_grad for part in (made, *after))


def test_inference_mode_autocast_and_one_frame(model, start):
    with torch.inference_mode():
        expected = model.generate(30, start, generator=chance())
        with torch.autocast("cpu", dtype=torch.bfloat16):
            found = model.generate(30, start, generator=chance())
        assert torch.equal(found, expected)
        assert model.generate(1, start).shape == (4, 1, model.encoding.dim)


@pytest.mark.parametrize("precision", [pytest.param("half", marks=rounds)])
def test_weights_made_in_inference_mode_are_rounded_too(model, start, precision):
    expected = copy.deepcopy(model)
    with torch.inference_mode():
        made = copy.deepcopy(model)
        draw = lambda net: net.generate(5, start, generator=chance(), precision=precision)
        assert torch.equal(draw(made), draw(expected))
        made.lstm.weight_hh_l1.mul_(-1)
        assert not torch.allclose(draw(made), draw(expected))


@pytest.mark.parametrize("precision", ["full", pytest.param("half", marks=rounds)])
@torch.no_grad()
def test_it_follows_weights_that_change(model, start, precision):
    draw = lambda: model.generate(5, start, generator=chance(), precision=precision)
    before = draw()
    assert torch.equal(draw(), before)
    model.lstm.weight_hh_l1.mul_(-1)
    assert not torch.allclose(draw(), before)
    model.lstm.weight_hh_l1.mul_(-1)
    assert torch.equal(draw(), before)


@pytest.mark.parametrize("grad", [True, False])
def test_a_start_follows_the_model(model, start, grad):
    double = in_double(model)
    with torch.set_grad_enabled(grad):
        found = double.generate(5, start, generator=chance())
        expected = double.generate(5, State(*(part.double() for part in start)), generator=chance())
    assert found.dtype == torch.float64 and torch.equal(found, expected)


def test_a_generator_elsewhere_is_told(model, start):
    elsewhere = SimpleNamespace(device=torch.device("cuda"))
    with pytest.raises(ModelError, match="generator is on cuda, the model on cpu; use torch.Gen"):
        model.generate(2, start, generator=elsewhere)


def test_a_start_of_another_encoding_is_told(model, start):
    other = start._replace(frame=start.frame[:, :-1])
    with pytest.raises(ModelError, match="no state of this model"):
        model.generate(2, other)


# -- choosing a component -------------------------------------------------------------------------


def test_choose_is_multinomial():
    logs = torch.randn(50_000, 4, generator=chance()).log_softmax(-1)
    expected = torch.multinomial(logs.softmax(-1), 1, generator=chance(1))[:, 0]
    assert (choose(logs, chance(1)) == expected).float().mean() > 0.999


def test_choose_draws_by_the_weights():
    weights = torch.tensor([0.5, 0.3, 0.2, 0.0])
    chosen = choose(weights.log().expand(100_000, 4), chance())
    share = chosen.bincount(minlength=4) / len(chosen)
    torch.testing.assert_close(share, weights, rtol=0, atol=0.008)  # five standard errors
    assert share[3] == 0


# -- rounded weights ------------------------------------------------------------------------------


@rounds
@pytest.mark.parametrize(("precision", "tolerance"), [("half", 1e-3), ("int8", 0.05)])
@torch.no_grad()
def test_rounded_weights_begin_the_same_motion(features, precision, tolerance, monkeypatch):
    monkeypatch.setattr(sampler_few, "SMALL", 0)  # round all
    encoding, clips = features
    torch.manual_seed(0)
    model = LstmGmm(encoding, Normalizer.fit(list(clips)), width=32, components=1)
    start, calm = model.observe(clips), {"temperature": 1e-6}
    for many in (start[[0]], start[[0, 1] * 4]):  # few and many are multiplied in other ways
        exact, found = (
            model.normalizer(model.generate(5, many, generator=chance(), precision=p, **calm))
            for p in ("full", precision)
        )
        assert 0 < (found - exact).abs().max() < tolerance


@rounds
@torch.no_grad()
def test_half_loses_nothing_of_weights_stored_in_half(model, features, monkeypatch):
    monkeypatch.setattr(sampler_few, "SMALL", 0)  # round all
    stored = LstmGmm.from_config(model.config())
    stored.load_state_dict({name: t.half() for name, t in model.state_dict().items()})
    start = stored.observe(features[1])
    exact = stored.generate(40, start, generator=chance())
    found = stored.generate(40, start, generator=chance(), precision="half")
    assert_same_motion(stored, found, exact, 1e-4)


@rounds
@torch.no_grad()
def test_int8_takes_weights_that_are_zero(features):
    encoding, clips = features
    model = LstmGmm(encoding, Normalizer.fit(list(clips)), width=16)
    for parameter in model.parameters():
        parameter.zero_()
    made = model.generate(5, model.zero_state(2), precision="int8", generator=chance())
    expected = model.generate(5, model.zero_state(2), generator=chance())
    torch.testing.assert_close(made, expected)


# -- bad input ------------------------------------------------------------------------------------


@torch.no_grad()
def test_precisions_it_does_not_have(model, start):
    with pytest.raises(ModelError, match="one of"):
        model.generate(3, start, precision="bf16")
    double = in_double(model)
    for precision in ("half", "int8"):
        with pytest.raises(ModelError, match="float32 model on an x86"):
            double.generate(3, double.zero_state(), precision=precision)
        with torch.enable_grad(), pytest.raises(ModelError, match="no gradient"):
            model.generate(3, start, precision=precision)


@pytest.mark.parametrize("grad", [True, False])
@pytest.mark.parametrize("value", [math.nan, math.inf])
def test_a_start_that_is_no_number(model, start, grad, value):
    start.cell[1, 0, 3] = value
    with torch.set_grad_enabled(grad), pytest.raises(ModelError, match="NaN or infinite"):
        model.generate(3, start)


@torch.no_grad()
def test_who_leaves_all_bounds_ends_in_nan_alone(model, start):
    start.frame[2] = 1e38
    made = model.generate(5, start)
    assert made[[0, 1, 3]].isfinite().all()
    if model.skip:
        assert not made[2].isfinite().all()
        if can_round(made):
            alone = model.generate(5, start, precision="int8")
            assert alone[[0, 1, 3]].isfinite().all() and not alone[2].isfinite().all()
            with pytest.raises(ModelError, match="left all bounds"):  # many share their steps
                model.generate(5, start[[0, 1, 2, 3, 3]], precision="int8")
