"""LSTM-3LR: what is fed back, what is learned through it, what it says when input is bad."""

import math
from itertools import pairwise

import pytest
import torch

from motionlab import datasets
from motionlab.encodings import Normalizer, RootRelative
from motionlab.errors import ModelError
from motionlab.models import AcLstm, State, auto_condition
from motionlab.training.checkpoints import load_weights, save_weights


@pytest.fixture(scope="module")
def clips():
    motions = datasets.load("gaits")[:4]
    encoding = RootRelative(motions[0].skeleton, motions[0].fps)
    return encoding, torch.stack([encoding.encode(motion)[:24] for motion in motions])


@pytest.fixture(scope="module", params=[False, True], ids=["direct", "staircase"])
def model(clips, request):
    encoding, features = clips
    torch.manual_seed(0)
    made = AcLstm(encoding, Normalizer.fit(list(features)), width=12, staircase=request.param)
    return made.double()


@pytest.fixture
def windows(clips):
    return clips[1].double()


def test_a_pattern_of_recorded_and_fed_back_frames():
    found = auto_condition(11, 2, 3).int().tolist()
    assert found == [1, 1, 0, 0, 0, 1, 1, 0, 0, 0, 1]
    assert auto_condition(7, 3, 0).all()


@pytest.mark.parametrize(("real", "fed"), [(0, 5), (-1, 5), (5, -1), (2.5, 5), (5, None)])
def test_a_pattern_that_makes_no_sense(real, fed):
    with pytest.raises(ModelError, match="u must"):
        auto_condition(10, real, fed)


def test_loss_is_that_of_a_loop_of_steps(model, windows):
    real = auto_condition(windows.shape[1], 3, 4)
    state, said, errors = model.zero_state(len(windows)), None, []
    for t in range(windows.shape[1] - 1):
        frame = windows[:, t] if real[t] else said
        said, state = model.step(frame, state)
        errors.append(model.normalizer(said) - model.normalizer(windows[:, t + 1]))
    torch.testing.assert_close(
        model.loss(windows, real=real), torch.stack(errors).square().mean(), rtol=1e-8, atol=0
    )


def test_nothing_fed_back_is_teacher_forcing(model, windows):
    frames = windows.shape[1]
    plain = model.loss(windows)
    assert torch.equal(plain, model.loss(windows, real=auto_condition(frames, 5, 0)))
    assert plain != model.loss(windows, real=auto_condition(frames, 5, 5))


def test_a_mask_of_each_window_of_its_own(model, windows):
    real = torch.rand(windows.shape[:2], generator=torch.Generator().manual_seed(1)) < 0.6
    real[:, 0] = True
    each = [
        model.loss(window[None], real=mask[None])
        for window, mask in zip(windows, real, strict=True)
    ]
    torch.testing.assert_close(model.loss(windows, real=real), torch.stack(each).mean())


def test_no_gradient_is_cut_where_frames_are_fed_back(model, windows):
    """The last loss depends on frame 0 only through frames that the network made."""
    window = windows[:1, :8].clone().requires_grad_()
    real = torch.arange(8) < 1

    def last(features):
        said = model(features, real=real)[:, -1]
        return (said - windows[:1, 8]).square().sum()

    (gradient,) = torch.autograd.grad(last(window), window)
    assert not gradient[:, 1:].any()
    channel = int(gradient[0, 0].abs().argmax())
    step = torch.zeros_like(window)
    step[0, 0, channel] = 1e-5
    slope = (last(window + step) - last(window - step)).item() / 2e-5
    assert gradient[0, 0, channel].item() == pytest.approx(slope, rel=1e-5)
    assert abs(slope) > 0


def test_noise_is_on_recorded_frames_only(model, windows):
    noise = torch.randn(windows.shape, generator=torch.Generator().manual_seed(0)).double()
    real = auto_condition(windows.shape[1], 2, 2)
    elsewhere = noise * (~real[:, None])
    assert torch.equal(model.loss(windows, real=real), model.loss(windows, elsewhere, real))
    assert model.loss(windows, noise, real) != model.loss(windows, real=real)


def test_a_staircase_takes_a_frame_a_layer(clips, windows):
    encoding, features = clips
    normalizer = Normalizer.fit(list(features))
    changed = windows.clone()
    changed[:, 10] += 1
    late = {}
    for staircase in (False, True):
        torch.manual_seed(0)
        model = AcLstm(encoding, normalizer, width=12, staircase=staircase).double()
        differs = (model(windows) != model(changed)).any(-1).any(0)
        late[staircase] = int(differs.int().argmax())
    assert late == {False: 10, True: 12}


def test_observed_and_generated_is_step_after_step(model, windows):
    state = model.zero_state(len(windows))
    for frame in windows.unbind(1):
        said, state = model.step(frame, state)
    seen = model.observe(windows)
    for part, its in zip(seen, state, strict=True):
        torch.testing.assert_close(part, its)
    frames = []
    for _ in range(12):
        frames.append(said)
        said, state = model.step(said, state)
    slow = model.generate(12, seen)
    torch.testing.assert_close(slow, torch.stack(frames, 1))
    with torch.no_grad():
        torch.testing.assert_close(model.generate(12, seen), slow)
        torch.testing.assert_close(model.generate(12, seen[1]), slow[1:2])


def test_noise_is_drawn_from_the_generator(model, windows):
    state, chance = model.observe(windows), lambda: torch.Generator().manual_seed(4)
    slow = model.generate(6, state, generator=chance(), noise=0.3)
    assert not torch.allclose(slow[:, 1:], model.generate(6, state)[:, 1:])
    assert torch.equal(slow[:, 0], model.generate(6, state)[:, 0])
    with torch.no_grad():
        torch.testing.assert_close(model.generate(6, state, generator=chance(), noise=0.3), slow)
    with pytest.raises(ModelError, match="noise"):
        model.generate(6, state, noise=-0.1)


def test_rounded_weights_go_the_same_way_for_a_while(clips, windows):
    encoding, features = clips
    torch.manual_seed(0)
    model = AcLstm(encoding, Normalizer.fit(list(features)), width=12)
    with torch.no_grad():
        state = model.observe(windows)
        exact, half = (model.generate(5, state, precision=p) for p in ("full", "half"))
    assert 0 < (exact - half).abs().max() < 1e-2


def test_a_few_updates_learn_to_walk_on(clips, windows):
    """Trained with its own frames among the inputs, error of what follows falls."""
    encoding, features = clips
    torch.manual_seed(0)
    model = AcLstm(encoding, Normalizer.fit(list(features)), width=64)
    optimizer = torch.optim.Adam(model.parameters(), 5e-3)
    real, losses = auto_condition(24, 3, 3), []
    for _ in range(60):
        optimizer.zero_grad()
        loss = model.loss(features, real=real)
        loss.backward()
        optimizer.step()
        losses.append(loss.item())
    assert losses[-1] < 0.35 * losses[0]
    assert all(b < a for a, b in pairwise(losses[::20]))


def test_weights_are_stored_and_come_back(model, windows, tmp_path):
    single = AcLstm.from_config(model.config())
    single.load_state_dict(model.state_dict())
    save_weights(tmp_path / "w.safetensors", single, {"name": "x"}, starts=single.observe(windows))
    found, about = load_weights(tmp_path / "w.safetensors")
    assert about == {"name": "x"} and found.staircase == model.staircase and found.fps == model.fps
    assert torch.equal(found.generate(3, found.starts), single.generate(3, single.observe(windows)))


@pytest.mark.parametrize(
    ("features", "words"),
    [(torch.zeros(2, 5, 3), "needs"), (torch.zeros(2, 0, 63), "needs"), (None, "needs at least 2")],
)
def test_features_that_do_not_fit(model, windows, features, words):
    with pytest.raises(ModelError, match=words):
        model.loss(windows[:, :1] if features is None else features)


def test_bad_input(model, windows):
    holes = windows.clone()
    holes[0, 3, 5] = math.nan
    with pytest.raises(ModelError, match="NaN"):
        model.loss(holes)
    with pytest.raises(ModelError, match="first frame"):
        model.loss(windows, real=torch.zeros(windows.shape[1], dtype=torch.bool))
    state = model.observe(windows)
    for n in (0, -1, 2.5):
        with pytest.raises(ModelError, match="1 or more"):
            model.generate(n, state)
    with pytest.raises(ModelError, match="no state"):
        model.generate(5, State(state.frame, state.hidden[:, :2], state.cell[:, :2]))
    with pytest.raises(ModelError, match="NaN"):
        model.generate(5, state._replace(cell=state.cell * math.nan))
    with pytest.raises(ModelError, match="precision"), torch.no_grad():
        model.generate(5, state, precision="quarter")
    with pytest.raises(ModelError, match="channels"):
        AcLstm(model.encoding, Normalizer(7))
