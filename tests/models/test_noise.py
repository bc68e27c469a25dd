"""Noise with a memory: its recursion, its spread, and motion in pieces that is motion at once."""

import math

import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from motionlab import Skeleton, datasets
from motionlab.encodings import JointAngles, Normalizer
from motionlab.errors import EncodingError, ModelError
from motionlab.models import LstmGmm, State, next_noise
from motionlab.models.sampler import can_round
from motionlab.training.checkpoints import load_weights, save_weights

rounds = pytest.mark.skipif(
    not can_round(torch.zeros(1)), reason="no products with rounded weights: needs an x86 processor"
)


def chance(seed=0):
    return torch.Generator().manual_seed(seed)


@pytest.fixture(scope="module")
def clips():
    encoding = JointAngles(Skeleton.canonical(), contacts=True)
    return encoding, torch.stack(
        [encoding.encode(m)[:40] for m in datasets.load("gaits", "val")[:4]]
    )


def network(clips, **settings):
    encoding, features = clips
    torch.manual_seed(0)
    model = LstmGmm(encoding, Normalizer.fit(list(features)), width=24, **settings)
    torch.nn.init.normal_(model.leave.weight, std=0.3)  # components that differ
    return model.eval()


@pytest.fixture(scope="module", params=[0.0, 0.9], ids=["paper", "skip"])
def model(clips, request):
    return network(clips, components=3, skip=request.param).requires_grad_(False)


@pytest.fixture(scope="module")
def start(model, clips):
    return model.observe(clips[1])


# -- the recursion --------------------------------------------------------------------------------


@pytest.mark.parametrize("memory", [0.0, 0.5, 0.9, 0.99])
def test_it_keeps_its_spread_and_forgets_at_its_rate(memory):
    g, rows = chance(), []
    noise = torch.randn(20_000, 1, generator=g)
    for _ in range(21):
        rows.append(noise[:, 0])
        noise = next_noise(noise, memory, g)
    rows = torch.stack(rows)
    assert rows.var(1).sub(1).abs().max() < 0.05  # five standard errors
    assert rows.mean(1).abs().max() < 0.036
    for after in (1, 5, 20):
        found = (rows[0] * rows[after]).mean().item()
        assert found == pytest.approx(memory**after, abs=0.05)


@settings(max_examples=50, deadline=None)
@given(memory=st.floats(0, 1, exclude_max=True), seed=st.integers(0, 2**32 - 1))
def test_it_is_a_turn_from_the_noise_before_towards_new_noise(memory, seed):
    before, fresh = torch.randn(2, 3, 5, dtype=torch.float64, generator=chance(seed + 1))
    assert torch.equal(next_noise(before, 0.0, chance(seed)),
                       torch.randn(3, 5, dtype=torch.float64, generator=chance(seed)))  # fmt: skip
    angle = math.acos(memory)
    white = next_noise(before, 0.0, chance(seed))
    expected = math.cos(angle) * before + math.sin(angle) * white
    torch.testing.assert_close(
        next_noise(before, memory, chance(seed)), expected, atol=1e-7, rtol=0
    )


# -- drawing with it ------------------------------------------------------------------------------


@pytest.mark.parametrize("memory", [0.0, 0.5, 0.95])
def test_frames_are_drawn_as_the_equations_say(model, start, memory):
    """z = mu + T sigma eps of a component, eps by the recursion: spelled out, draw for draw."""
    warmth = {"temperature": 0.7, "component_temperature": 2.0}
    made = model.generate(12, start, generator=chance(), memory=memory, **warmth)
    g, state, noise = chance(), start, None
    mixture = model.predict(state)
    for t in range(12):
        mean, std = mixture.choose(g, 2.0)
        white = torch.randn(std.shape, generator=g)
        noise = white if noise is None else memory * noise + math.sqrt(1 - memory**2) * white
        frame = model.normalizer.inverse(mean + 0.7 * std * noise)
        torch.testing.assert_close(made[:, t], frame, rtol=0, atol=1e-4)
        mixture, state = model.step(frame, state)


@pytest.mark.parametrize("grad", [True, False])
@pytest.mark.parametrize("noise", [0.0, 0.1])
def test_without_memory_it_is_what_it_was_bit_for_bit(model, start, grad, noise):
    g, same = chance(), chance()
    with torch.set_grad_enabled(grad):
        white = model.generate(20, start, generator=g, noise=noise, temperature=0.5)
        found = model.generate(20, start, generator=same, noise=noise, temperature=0.5, memory=0.0)
    assert torch.equal(found, white) and torch.equal(g.get_state(), same.get_state())
    if not grad:
        return
    g, state, frames = chance(), start, []
    mixture = model.predict(state)
    for t in range(20):  # the paper's: a component, a point of its Gaussian
        frames.append(model.normalizer.inverse(mixture.sample(g, 0.5)))
        if t < 19:
            disturbance = noise * torch.randn(frames[-1].shape, generator=g) if noise else None
            mixture, state = model.step(frames[-1], state, disturbance)
    assert torch.equal(found, torch.stack(frames, 1)) and torch.equal(
        g.get_state(), same.get_state()
    )


def test_with_a_memory_motion_is_as_wide_and_less_atremble(clips):
    model = network(clips, components=1).requires_grad_(False)
    many = model.observe(clips[1])[[0] * 600]
    white, slow = (
        model.normalizer(model.generate(30, many, generator=chance(1), memory=memory))
        for memory in (0.0, 0.9)
    )
    first = torch.stack([made[:, 0].std(0) for made in (white, slow)])
    torch.testing.assert_close(first[0], first[1])  # the first draw knows of no other
    tremble = torch.stack([made.diff(dim=1).square().mean() for made in (white, slow)])
    assert tremble[1] < 0.5 * tremble[0]
    sums = torch.stack([made.mean(1).std(0).mean() for made in (white, slow)])
    assert sums[1] > 1.5 * sums[0]


# -- in pieces ------------------------------------------------------------------------------------

WAYS = [
    {"memory": 0.9},
    {"memory": 0.9, "noise": 0.05, "temperature": 0.5},
    {"noise": 0.05},
    {"memory": 0.5, "component_temperature": 3.0},
]


@pytest.mark.parametrize("precision", [
    "loop", "full", pytest.param("half", marks=rounds), pytest.param("int8", marks=rounds)
])  # fmt: skip
@pytest.mark.parametrize("way", WAYS, ids=str)
def test_pieces_are_what_is_generated_at_once(model, start, way, precision):
    grad, precision = precision == "loop", "full" if precision == "loop" else precision
    with torch.set_grad_enabled(grad):
        whole = model.generate(40, start, generator=chance(2), precision=precision, **way)
        g, state, pieces = chance(2), start, []
        for n in (1, 7, 12, 1, 19):
            piece, state = model.go_on(n, state, generator=g, precision=precision, **way)
            pieces.append(piece)
    assert torch.equal(torch.cat(pieces, 1), whole)
    assert state.noise.shape == (4, model.kept) and len(state.frame) == 4


def test_one_goes_on_alone_from_a_file_or_in_double(model, start, tmp_path):
    """Slices of a state take the noise along, and so do files of weights."""
    calm = {"component_temperature": 1e-9, "temperature": 0.3, "memory": 0.9}
    _, state = model.go_on(9, start, generator=chance(), **calm)
    for rows, count in ((slice(1, 3), 2), (2, 1), ([0, 0, 3], 3), (-1, 1)):
        assert [len(part) for part in state[rows]] == [count] * len(state)
    assert torch.equal(state[[1, 1]].noise[0], state.noise[1])
    save_weights(tmp_path / "w.safetensors", model, {"name": "x"}, starts=state)
    loaded = load_weights(tmp_path / "w.safetensors")[0].requires_grad_(False)
    expected = model.generate(9, state[2], generator=chance(1), **calm)
    found = loaded.generate(9, loaded.starts[2], generator=chance(1), **calm)
    assert torch.equal(found, expected)
    double = LstmGmm.from_config(model.config()).double().requires_grad_(False)
    double.load_state_dict(model.state_dict())
    assert double.go_on(2, state, **calm)[1].noise.dtype == torch.float64


def test_weights_with_old_starts_begin_with_fresh_noise(model, start, tmp_path):
    """Files hold nothing of noise that there isn't: as those did that knew of none."""
    save_weights(tmp_path / "w.safetensors", model, {"name": "x"}, starts=start)
    loaded = load_weights(tmp_path / "w.safetensors")[0].requires_grad_(False)
    assert loaded.starts.noise.shape == (4, 0) and loaded.starts[1:3].noise.shape == (2, 0)
    found = loaded.generate(5, loaded.starts[1:3], generator=chance(), memory=0.9)
    assert torch.equal(found, model.generate(5, start[1:3], generator=chance(), memory=0.9))
    white = model.generate(5, start[1:3], generator=chance())
    assert torch.equal(found[:, 0], white[:, 0]) and not torch.allclose(found[:, 1], white[:, 1])


def test_the_memory_may_change_from_piece_to_piece(model, start):
    """What was drawn white is remembered as soon as there is a memory."""
    _, state = model.go_on(5, start, generator=chance())
    slow, _ = model.go_on(1, state, generator=chance(1), memory=0.999, temperature=0.1)
    mean, std = model.predict(state).choose(chance(1))
    noise = (model.normalizer(slow[:, 0]) - mean) / (0.1 * std)
    assert (noise - state.noise).abs().max() < 0.4  # sqrt(1 - 0.999²) is 0.045


def test_a_frame_that_was_put_into_a_state_counts(model, start):
    _, state = model.go_on(5, start, generator=chance(), memory=0.9)
    moved = state._replace(frame=start.frame)
    bare = State(start.frame, state.hidden, state.cell, state.noise)
    draw = lambda state: model.generate(3, state, generator=chance(1), memory=0.9)
    assert torch.equal(draw(moved), draw(bare))
    if model.skip:
        assert not torch.allclose(draw(moved), draw(state))


def test_gradients_go_through_pieces_and_noise(clips):
    model = network(clips, components=2)
    start = model.observe(clips[1])
    _, state = model.go_on(3, start, generator=chance(), memory=0.9)
    made, _ = model.go_on(3, state, generator=chance(1), memory=0.9)
    made.sum().backward()
    assert model.enter[0].weight.grad.abs().sum() > 0


# -- bad input ------------------------------------------------------------------------------------


@pytest.mark.parametrize("memory", [1, 1.0, -0.1, 1.5, math.nan, math.inf, None, "long"])
@pytest.mark.parametrize("grad", [True, False])
def test_a_memory_that_is_none(model, start, memory, grad):
    with torch.set_grad_enabled(grad), pytest.raises(ModelError, match="memory is .* less than 1"):
        model.generate(3, start, memory=memory)


def test_a_state_without_noise_where_some_is_needed(start):
    with pytest.raises(ModelError, match="no noise to go on from"):
        next_noise(start.noise, 0.9, chance())


@torch.no_grad()
def test_a_state_with_noise_of_another_kind(model, start):
    wide = start._replace(noise=torch.zeros(4, model.kept + 1))
    few = start._replace(noise=torch.zeros(3, model.kept))
    for state in (wide, few):
        with pytest.raises(ModelError, match="holds `noise` of shape"):
            model.generate(3, state, memory=0.9)
    broken = start._replace(noise=torch.full((4, model.kept), torch.nan))
    with pytest.raises(ModelError, match="NaN or infinite"):
        model.go_on(3, broken, memory=0.9)
    with pytest.raises(ModelError, match="no state of this model"):
        model.go_on(3, tuple(start), memory=0.9)


@torch.no_grad()
def test_starts_that_are_none(model, start, clips):
    encoding, features = clips
    one = State(start.frame[0], start.hidden[0], start.cell[0])  # a character without its batch
    for state in (one, features, features[:, :1], features[0, 0]):
        with pytest.raises(ModelError, match="no state of this model; `observe` gives one"):
            model.generate(3, state, memory=0.9)
    motion = datasets.load("gaits", "val")[0]
    with pytest.raises(ModelError, match="not Motion; of a motion at 30 frames a second"):
        model.observe(motion)
    with pytest.raises(EncodingError, match="another frame rate"):
        model.observe(encoding.encode(motion.resample(60)))
    features = features.clone()
    features[1, 3, 5] = torch.nan
    with pytest.raises(ModelError, match="NaN or infinite"):
        model.observe(features)


@torch.no_grad()
def test_who_left_all_bounds_can_be_left_out(model, start):
    far = start._replace(frame=start.frame.clone())
    far.frame[2] = math.inf
    with pytest.raises(ModelError, match="NaN or infinite"):
        model.go_on(3, far, memory=0.9)
    alive = far.frame.isfinite().all(1)
    assert model.go_on(3, far[alive], memory=0.9)[0].isfinite().all()
