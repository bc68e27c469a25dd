"""What all networks that name the next frame have in common, whatever is inside them."""

import json
import math

import pytest
import torch

from motionlab import datasets
from motionlab.encodings import Normalizer, RootRelative
from motionlab.errors import ModelError
from motionlab.models import AcLstm, State, auto_condition
from motionlab.models.erd import Erd
from motionlab.models.seq2seq import Seq2Seq
from motionlab.training import checkpoints

FRAMES = 12


@pytest.fixture(scope="module")
def encoding():
    return RootRelative(datasets.load("gaits", "val")[0].skeleton, fps=30)


@pytest.fixture(scope="module")
def features(encoding):
    clips = [encoding.encode(clip) for clip in datasets.load("gaits", "val")[:3]]
    return torch.stack([clip[40 : 40 + FRAMES] for clip in clips]).double()


@pytest.fixture(scope="module", params=[AcLstm, Erd, Seq2Seq], ids=lambda kind: kind.__name__)
def model(encoding, features, request):
    torch.manual_seed(0)
    # a tenth of Erd's width must be some units, or all of them may happen to be silent
    more = {AcLstm: {}, Erd: {"width": 100}, Seq2Seq: {"seen": 5}}[request.param]
    normalizer = Normalizer.fit(list(features))
    made = request.param(encoding, normalizer, **{"width": 20} | more).double()
    for parameter in made.parameters():
        torch.nn.init.normal_(parameter, std=0.3)  # large words, so that feeding back matters
    return made


def by_hand(model, features, noise, real):
    """Outputs (batch, frames, dim) of a loop over `step` that chooses each input by itself."""
    rows = []
    for b in range(len(features)):
        state, said, row = model.zero_state(1), None, []
        for t in range(features.shape[1]):
            x = features[b : b + 1, t] + noise[b : b + 1, t] * model.normalizer.std
            if not real[b][t]:
                x = said
            said, state = model.step(x, state)
            row.append(said)
        rows.append(torch.stack(row, dim=1))
    return torch.cat(rows)


def differ(model, one, other):
    """Whether each of some frames (..., dim) has a channel that is another one."""
    return ((one - other) / model.normalizer.std).abs().amax(-1) > 1e-4


def masks():
    g = torch.Generator().manual_seed(7)
    drawn = torch.rand(3, FRAMES, generator=g) < 0.5
    drawn[:, 0] = True
    return {
        "one of u = 3, v = 2": auto_condition(FRAMES, 3, 2),
        "another one in each window": drawn,
        "the first frame only": torch.arange(FRAMES) < 1,
        "all": torch.ones(FRAMES, dtype=torch.bool),
    }


# -- windows --------------------------------------------------------------------------------------


@pytest.mark.parametrize("which", masks())
def test_a_mask_is_a_loop_over_step_that_feeds_back(model, features, which):
    real = masks()[which]
    noise = 0.1 * torch.randn(features.shape, generator=torch.Generator().manual_seed(1)).double()
    found = model(features, noise, real)
    expected = by_hand(model, features, noise, real.expand(3, FRAMES))
    torch.testing.assert_close(found, expected)
    off = model.normalizer(expected[:, :-1]) - model.normalizer(features[:, 1:])
    skipped = model.seen - 1 if isinstance(model, Seq2Seq) else 0
    loss = off[:, skipped:].square().mean()
    torch.testing.assert_close(model.loss(features, noise, real), loss)


def test_all_recorded_is_teacher_forcing(model, features):
    forced = model(features)
    for real in (torch.ones(FRAMES, dtype=torch.bool), auto_condition(FRAMES, 4, 0)):
        torch.testing.assert_close(model(features, real=real), forced)
    fed = model(features, real=auto_condition(FRAMES, 4, 1))
    torch.testing.assert_close(fed[:, :4], forced[:, :4])
    assert differ(model, fed[:, 4], forced[:, 4]).all()


def test_outputs_know_nothing_of_later_frames(model, features):
    changed = features.clone()
    changed[:, 8] += 0.1
    torch.testing.assert_close(model(changed)[:, :8], model(features)[:, :8])
    assert differ(model, model(changed)[:, 8], model(features)[:, 8]).all()


def cut_memory(model):
    """Nothing is left of a frame but what the network says of it."""
    own = slice(-model.width, None)
    with torch.no_grad():
        if isinstance(model, AcLstm):
            for layer in model.gates:
                layer.weight[:, own] = 0
                layer.bias[model.width : 2 * model.width] = -100  # keeps nothing of C
        elif isinstance(model, Erd):
            for layer in (0, 1):
                getattr(model.lstm, f"weight_hh_l{layer}").zero_()
                getattr(model.lstm, f"bias_ih_l{layer}")[model.width : 2 * model.width] = -100
        else:
            model.gru.weight_hh_l0.zero_()
            model.gru.bias_ih_l0[model.width : 2 * model.width] = -100  # keeps nothing of h


@pytest.mark.parametrize("memory", [True, False], ids=["whole", "only by what was fed back"])
def test_no_gradient_is_cut(model, features, memory):
    weights = {name: value.clone() for name, value in model.state_dict().items()}
    if not memory:
        cut_memory(model)
    real = torch.arange(6) < 1
    first = features[:, 0].clone().requires_grad_()

    def last(first):
        """Squared error of what is said after frame 5, which follows from frame 0 alone."""
        said = model(torch.cat([first[:, None], features[:, 1:6]], 1), real=real)[:, -1]
        return (model.normalizer(said) - model.normalizer(features[:, 6])).square().mean()

    found = torch.autograd.grad(last(first), first)[0]
    towards = torch.randn(first.shape, generator=torch.Generator().manual_seed(2)).double()
    towards *= model.normalizer.std
    with torch.no_grad():
        up, down = (last(first + h * towards) for h in (1e-5, -1e-5))
    model.load_state_dict(weights)
    assert (found.abs().amax(-1) > 0).all()
    assert (found * towards).sum().item() == pytest.approx(((up - down) / 2e-5).item(), rel=1e-3)


def test_gradients_of_the_weights_are_finite_differences(model, features):
    real = auto_condition(FRAMES, 2, 3)
    parameters = [*model.parameters()]
    found = torch.autograd.grad(model.loss(features, real=real), parameters)
    g = torch.Generator().manual_seed(3)
    towards = [torch.randn(p.shape, generator=g).to(p) for p in parameters]
    losses = []
    for h in (1e-6, -1e-6):
        moved = {
            name: p.detach() + h * way
            for (name, p), way in zip(model.named_parameters(), towards, strict=True)
        }
        with torch.no_grad():
            out = torch.func.functional_call(model, moved, (features, None, real))
        skipped = model.seen - 1 if isinstance(model, Seq2Seq) else 0
        off = model.normalizer(out[:, skipped:-1]) - model.normalizer(features[:, skipped + 1 :])
        losses.append(off.square().mean().item())
    slope = sum((grad * way).sum().item() for grad, way in zip(found, towards, strict=True))
    assert slope == pytest.approx((losses[0] - losses[1]) / 2e-6, rel=1e-4)


def test_noise_disturbs_recorded_inputs_only(model, features):
    noise = torch.zeros_like(features)
    noise[:, 3] = 1.0
    fed = auto_condition(FRAMES, 3, 1)  # frame 3 is fed back
    torch.testing.assert_close(model.loss(features, noise, fed), model.loss(features, real=fed))
    assert differ(model, model(features, noise)[:, 3], model(features)[:, 3]).all()


def test_half_precision_loss_is_nearly_the_loss(model, features):
    real = auto_condition(FRAMES, 3, 2)
    with torch.autocast("cpu", torch.bfloat16):
        loss = model.loss(features, real=real)
    assert loss.item() == pytest.approx(model.loss(features, real=real).item(), rel=0.05)


# -- one frame after the other --------------------------------------------------------------------


def test_generate_is_a_loop_over_step(model, features):
    state = model.observe(features)
    made = model.generate(6, state)
    x = model.predict(state)
    for t in range(6):
        torch.testing.assert_close(made[:, t], x)
        x, state = model.step(x, state)
    with torch.no_grad():
        torch.testing.assert_close(model.generate(6, model.observe(features)), made)


def test_observe_is_a_loop_over_step(model, features):
    state = model.zero_state(len(features))
    for t in range(FRAMES):
        said, state = model.step(features[:, t], state)
    for part, its in zip(state, model.observe(features), strict=True):
        torch.testing.assert_close(part, its)
    torch.testing.assert_close(model.predict(state), said)
    torch.testing.assert_close(model(features)[:, -1], said)


def test_a_batch_is_its_members_one_by_one(model, features):
    start = model.observe(features)
    ones = [model.observe(clip) for clip in features]  # (frames, dim): a batch of one
    made = model.generate(5, start)
    torch.testing.assert_close(made, torch.cat([model.generate(5, one) for one in ones]))
    torch.testing.assert_close(model.generate(5, start[1]), made[1:2])
    torch.testing.assert_close(model.generate(5, start[[2, 0]]), made[[2, 0]])


def test_weights_are_stored_with_starts(model, features, tmp_path, monkeypatch):
    monkeypatch.setitem(checkpoints._KINDS, type(model).__name__, type(model))
    json.dumps(model.config())
    whole = type(model).from_config(model.config())
    whole.load_state_dict(model.state_dict())
    starts = whole.observe(features)
    checkpoints.save_weights(tmp_path / "m.safetensors", whole, {"by": "test"}, starts=starts)
    loaded, about = checkpoints.load_weights(tmp_path / "m.safetensors")
    assert about == {"by": "test"} and loaded.config() == model.config() and loaded.fps == 30
    assert isinstance(loaded.starts, State)
    torch.testing.assert_close(loaded.generate(4, loaded.starts), whole.generate(4, starts))


# -- bad input ------------------------------------------------------------------------------------


def test_features_of_another_shape(model):
    for shape in [(2, FRAMES, 7), (4,), (2, 0, 78)]:
        for method in (model, model.loss, model.observe):
            with pytest.raises(ModelError, match="shape"):
                method(torch.zeros(shape))


@pytest.mark.parametrize("value", [math.nan, math.inf])
def test_features_that_are_no_numbers(model, features, value):
    broken = features.clone()
    broken[1, 3, 5] = value
    for method in (model, model.loss, model.observe):
        with pytest.raises(ModelError, match="NaN or infinite"):
            method(broken)


def test_one_frame_is_too_short_a_window(model, features):
    with pytest.raises(ModelError, match=r"needs (at least 2|more than the 5) frames"):
        model.loss(features[:, :1])


@pytest.mark.parametrize("n", [0, -3, 2.5, "5"])
def test_generate_refuses_a_number_of_frames(model, features, n):
    with pytest.raises(ModelError, match="ask for 1 or more"):
        model.generate(n, model.observe(features))


def test_generate_refuses_what_is_no_state_of_it(model, features):
    state = model.observe(features)
    narrow = state._replace(hidden=state.hidden[..., :8], cell=state.cell[..., :8])
    flat = state._replace(cell=state.cell.new_zeros(3, 7, 20))
    for start in (narrow, flat, None, features):
        with pytest.raises(ModelError, match="no state of this model"):
            model.generate(3, start)
    hidden = state.hidden.clone()
    hidden[0, 0, 0] = math.nan
    with pytest.raises(ModelError, match="NaN"):
        model.generate(3, state._replace(hidden=hidden))


def test_the_first_frame_is_recorded(model, features):
    for method in (model, model.loss):
        with pytest.raises(ModelError, match="first frame can't be fed back"):
            method(features, real=torch.arange(FRAMES) > 0)


def test_a_mask_of_another_shape(model, features):
    for real in (torch.ones(FRAMES - 1).bool(), torch.ones(FRAMES), torch.ones(2, FRAMES).bool()):
        with pytest.raises(ModelError, match=r"real is .* it must be bool"):
            model.loss(features, real=real)


def test_normalizer_of_another_encoding(model, encoding):
    with pytest.raises(ModelError, match="71 channels"):
        type(model)(encoding, Normalizer(71))
