"""The LSTM-GMM against torch.distributions, brute force and sampling."""

import json
import math

import pytest
import torch
from torch.distributions import Categorical, Independent, MixtureSameFamily, Normal

from motionlab import Skeleton, datasets, encodings
from motionlab.encodings import JointAngles, Normalizer
from motionlab.errors import ModelError
from motionlab.models import LstmGmm, Mixture, State


@pytest.fixture(scope="module")
def clips():
    encoding = JointAngles(Skeleton.canonical(), contacts=True)
    motions = datasets.load("gaits", "val")
    return encoding, torch.stack([encoding.encode(motion)[:60] for motion in motions[:3]])


@pytest.fixture(scope="module", params=[0.0, 0.9], ids=["paper", "skip"])
def model(clips, request):
    encoding, features = clips
    torch.manual_seed(0)
    normalizer = Normalizer.fit(list(features))
    made = LstmGmm(encoding, normalizer, width=16, components=3, skip=request.param).double()
    torch.nn.init.normal_(made.leave.weight, std=0.3)  # components that differ
    return made


@pytest.fixture(scope="module")
def features(clips):
    return clips[1].double()


def mixture(*shape, components=5, kept=4, seed=0, dtype=torch.float64):
    g = torch.Generator().manual_seed(seed)
    normal = lambda *s: torch.randn(*shape, *s, generator=g, dtype=dtype)
    return Mixture(
        normal(components).log_softmax(-1),
        2 * normal(components, kept),
        normal(components, kept).exp(),
    )


def in_torch(mix: Mixture) -> MixtureSameFamily:
    return MixtureSameFamily(
        Categorical(logits=mix.log_weights), Independent(Normal(mix.means, mix.stds), 1)
    )


# -- the mixture ----------------------------------------------------------------------------------


def test_log_prob_is_torch_distributions():
    mix, values = mixture(2, 7), torch.randn(2, 7, 4, dtype=torch.float64)
    torch.testing.assert_close(mix.log_prob(values), in_torch(mix).log_prob(values))


def test_log_prob_by_hand():
    mix = mixture(components=2, kept=3)
    value = torch.tensor([0.3, -1.0, 2.0], dtype=torch.float64)
    total = 0.0
    for i in range(2):
        density = mix.log_weights[i].exp().item()
        for j in range(3):
            s, m = mix.stds[i, j].item(), mix.means[i, j].item()
            density *= math.exp(-(((value[j].item() - m) / s) ** 2) / 2) / (
                s * math.sqrt(2 * math.pi)
            )
        total += density
    assert mix.log_prob(value).item() == pytest.approx(math.log(total))


def test_log_prob_has_the_slopes_of_torch_distributions():
    mix, values = mixture(3, 2), torch.randn(3, 2, 4, dtype=torch.float64)
    values[0] = mix.means[0, :, 0]  # others are far away
    found = []
    for density in (lambda mix: mix, in_torch):
        parts = [part.detach().clone().requires_grad_() for part in (values, *mix)]
        total = density(Mixture(*parts[1:])).log_prob(parts[0])
        slopes = torch.autograd.grad((total * torch.arange(6).view(3, 2)).sum(), parts)
        weights = slopes[1]  # as torch sees them: only their differences count
        found.append(
            (total, slopes[0], *slopes[2:], weights - weights.sum(-1, True) * mix[0].exp())
        )
    for ours, theirs in zip(*found, strict=True):
        torch.testing.assert_close(ours, theirs)


def test_no_slope_is_a_number_that_processors_stumble_over():
    means = torch.tensor([[0.0], [14.0]])
    value = torch.zeros(1, requires_grad=True)
    parts = [torch.zeros(2), means.requires_grad_(), torch.ones(2, 1)]
    Mixture(*parts).log_prob(value).backward()
    assert means.grad[1] == 0 and means.grad[0] == 0
    tiny = torch.finfo(torch.float32).tiny
    value = torch.full((1,), 0.5, requires_grad=True)
    Mixture(*parts).log_prob(value).backward()
    assert (means.grad == 0).logical_or(means.grad.abs() > tiny).all()


def test_log_prob_of_what_is_far_away_stays_finite():
    mix = mixture(70, kept=70, dtype=torch.float32)
    values = torch.full((70, 70), 1e4, requires_grad=True)
    mix.log_prob(values).sum().backward()
    assert mix.log_prob(values).isfinite().all() and values.grad.isfinite().all()


def test_density_adds_up_to_one():
    mix = mixture(components=3, kept=1)
    grid = torch.linspace(-40, 40, 80_001, dtype=torch.float64)
    density = mix.log_prob(grid[:, None]).exp()
    assert torch.trapezoid(density, grid).item() == pytest.approx(1, abs=1e-6)


@pytest.mark.parametrize(
    ("temperature", "choice"), [(1.0, 1.0), (0.5, 1.0), (1.0, 0.3), (0.7, 2.0)]
)
def test_samples_have_the_moments_of_the_tempered_mixture(temperature, choice):
    mix = mixture()
    many = Mixture(*(part.expand(200_000, *part.shape) for part in mix))
    found = many.sample(torch.Generator().manual_seed(1), temperature, choice)
    weights = (mix.log_weights / choice).softmax(-1)[:, None]
    mean = (weights * mix.means).sum(0)
    spread = (weights * ((temperature * mix.stds) ** 2 + (mix.means - mean) ** 2)).sum(0)
    error = 5 * (spread / len(found)).sqrt()  # five standard errors
    assert ((found.mean(0) - mean).abs() < error).all()
    torch.testing.assert_close(found.var(0), spread, rtol=0.05, atol=0)


def test_mean_log_prob_of_samples_is_minus_the_entropy():
    mix = mixture(components=2, kept=1)
    many = Mixture(*(part.expand(100_000, *part.shape) for part in mix))
    found = many.log_prob(many.sample(torch.Generator().manual_seed(2))).mean()
    grid = torch.linspace(-40, 40, 40_001, dtype=torch.float64)
    logs = mix.log_prob(grid[:, None])
    assert found.item() == pytest.approx(torch.trapezoid(logs.exp() * logs, grid).item(), abs=0.02)


# -- the network ----------------------------------------------------------------------------------


def test_layers_are_those_of_the_paper(model):
    kinds = [type(m).__name__ for m in model.modules() if not list(m.children())]
    assert [k for k in kinds if k in ("Linear", "LSTM")] == ["Linear", "Linear", "LSTM", "Linear"]
    assert model.lstm.num_layers == 2


def test_steps_equal_the_whole_window(model, features):
    whole = model(features)
    state = model.zero_state(len(features))
    for t in range(features.shape[1]):
        mix, state = model.step(features[:, t], state)
        for part, its in zip(mix, whole, strict=True):
            torch.testing.assert_close(part, its[:, t])
    for part, its in zip(state, model.observe(features), strict=True):
        torch.testing.assert_close(part, its)
    for part, its in zip(model.predict(state), mix, strict=True):
        torch.testing.assert_close(part, its)


def test_log_prob_is_causal_and_of_the_next_frame(model, features):
    logs = model.log_prob(features)
    assert logs.shape == (3, 59)
    state = model.observe(features[:, :20])
    target = model.normalizer(features[:, 20])
    torch.testing.assert_close(logs[:, 19], model.predict(state).log_prob(target))
    changed = features.clone()
    changed[:, 30:] += 0.1
    torch.testing.assert_close(model.log_prob(changed)[:, :29], logs[:, :29])
    assert not torch.isclose(model.log_prob(changed)[:, 29], logs[:, 29]).any()


def test_noise_disturbs_the_inputs_only(model, features):
    noise = torch.randn_like(features)
    shifted = features + noise * model.normalizer.std  # in raw units
    logs = model(shifted[:, :-1]).log_prob(model.normalizer(features[:, 1:]))
    torch.testing.assert_close(model.log_prob(features, noise), logs)
    assert model.loss(features, 0 * noise) == -model.log_prob(features).mean()


def test_batch_equals_loop(model, features):
    logs = torch.cat([model.log_prob(clip[None]) for clip in features])
    torch.testing.assert_close(model.log_prob(features), logs)
    start = model.observe(features)
    ones = [model.observe(clip) for clip in features]  # (frames, dim): a batch of one
    for part, its in zip(start, zip(*ones, strict=True), strict=True):
        torch.testing.assert_close(part, torch.cat(its))
    # at temperatures near 0 there is no chance in it, so that generating can be compared
    cold = {"temperature": 1e-9, "component_temperature": 1e-3}
    torch.testing.assert_close(
        model.generate(8, start, **cold), torch.cat([model.generate(8, s, **cold) for s in ones])
    )


def test_gradients_reach_features_and_state(model, features):
    state = State(*(part.detach().requires_grad_() for part in model.observe(features[:, :5])))
    x = features[:, 5].clone().requires_grad_()
    target = model.normalizer(features[:, 6])
    likelihood = lambda x, hidden, cell: model.step(x, state._replace(hidden=hidden, cell=cell))[
        0
    ].log_prob(target)
    assert torch.autograd.gradcheck(likelihood, (x, state.hidden, state.cell), atol=1e-4)


@pytest.mark.parametrize("skip", [0.0, 0.4, 1.0])
def test_a_silent_network_keeps_its_share_of_the_frame(clips, skip):
    encoding, features = clips
    model = LstmGmm(encoding, Normalizer.fit(list(features)), width=8, skip=skip)
    torch.nn.init.zeros_(model.leave.weight)
    torch.nn.init.zeros_(model.leave.bias)
    mix, inputs = model(features), model.normalizer(features)
    torch.testing.assert_close(mix.means[..., 2, :], skip * inputs)
    unit = {0.0: 1.0, 0.4: 0.6, 1.0: 0.1}[skip]  # one at the paper's, never nothing
    torch.testing.assert_close(mix.stds - model.floor, torch.full_like(mix.stds, unit))
    torch.nn.init.constant_(model.leave.bias, 0.5)
    torch.testing.assert_close(model(features).means[..., 2, :], skip * inputs + 0.5 * unit)


def test_deviations_are_floored(clips):
    encoding, features = clips
    model = LstmGmm(encoding, Normalizer.fit(list(features)), width=8)
    torch.nn.init.constant_(model.leave.bias, -50.0)
    stds = model.normalizer.std.new_zeros(encoding.dim)
    stds[model.normalizer.kept] = model(features).stds[0, 0, 0]
    assert stds[encoding.slices["contacts"]].tolist() == pytest.approx([0.1, 0.1])
    assert stds[encoding.slices["root"]].tolist() == pytest.approx([0.01] * 6)


# -- generating -----------------------------------------------------------------------------------


def test_generate_goes_on_by_its_own_samples(model, features):
    start = model.observe(features)
    made = model.generate(5, start, generator=torch.Generator().manual_seed(3))
    g, state, mix = torch.Generator().manual_seed(3), start, model.predict(start)
    for t in range(5):
        x = model.normalizer.inverse(mix.sample(g))
        torch.testing.assert_close(made[:, t], x)
        mix, state = model.step(x, state)
    again = model.generate(5, start, generator=torch.Generator().manual_seed(3))
    assert torch.equal(made, again)
    other = model.generate(5, start, generator=torch.Generator().manual_seed(4))
    assert not torch.isclose(made, other).all()


def test_lower_temperature_is_calmer_and_noise_is_not(model, features):
    start = State(*(part[:1].expand(400, *part.shape[1:]) for part in model.observe(features)))

    def spread(**options):
        options = {"component_temperature": 1e-3, "temperature": 1e-6} | options
        g = torch.Generator().manual_seed(0)
        return model.normalizer(model.generate(2, start, generator=g, **options)).std(0)

    assert (spread(temperature=1.0)[0] > spread(temperature=0.5)[0]).all()
    torch.testing.assert_close(spread(temperature=0.5)[0], spread(temperature=1.0)[0] / 2)
    assert spread(noise=0.5)[0].max() < 1e-5  # the first frame comes from what was seen
    assert spread(noise=0.5)[1].min() > 1e-5


def test_generated_features_are_motion(model, features):
    made = model.generate(10, model.observe(features))
    motion = model.encoding.to_motion(made[0])
    assert len(motion) == 10 and motion.fps == model.fps == 30


def test_config_builds_the_model_again(model, features):
    config = json.loads(json.dumps(model.config()))
    copy = LstmGmm.from_config(config).double()
    copy.load_state_dict(model.state_dict())
    torch.testing.assert_close(copy.log_prob(features), model.log_prob(features))


# -- bad input ------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("shape", "wrong"), [((2, 5, 7), "shape"), ((4,), "shape"), ((2, 0, 68), "one frame")]
)
def test_features_of_another_shape(model, shape, wrong):
    with pytest.raises(ModelError, match=wrong):
        model.log_prob(torch.zeros(shape, dtype=torch.float64))
    with pytest.raises(ModelError, match=wrong):
        model.observe(torch.zeros(shape, dtype=torch.float64))


@pytest.mark.parametrize("value", [math.nan, math.inf])
def test_features_that_are_no_numbers(model, features, value):
    broken = features.clone()
    broken[1, 3, 5] = value
    with pytest.raises(ModelError, match="NaN or infinite"):
        model.loss(broken)


def test_one_frame_has_no_next(model, features):
    with pytest.raises(ModelError, match="at least 2 frames"):
        model.log_prob(features[:, :1])


@pytest.mark.parametrize(
    ("n", "options"),
    [
        (0, {}),
        (-3, {}),
        (5, {"temperature": 0}),
        (5, {"temperature": -1.0}),
        (5, {"temperature": math.nan}),
        (5, {"component_temperature": 0.0}),
        (5, {"component_temperature": math.inf}),
        (2.5, {}),
        ("5", {}),
        (5, {"temperature": "warm"}),
        (5, {"noise": -0.1}),
        (5, {"noise": math.nan}),
    ],
)
def test_generate_refuses(model, features, n, options):
    with pytest.raises(ModelError, match="generate"):
        model.generate(n, model.observe(features), **options)


def test_generate_refuses_what_is_no_state_of_it(model, features):
    state = model.observe(features)
    narrow = state._replace(hidden=state.hidden[..., :8], cell=state.cell[..., :8])
    for start in (narrow, None, features):
        with pytest.raises(ModelError, match="no state of this model"):
            model.generate(3, start)


def test_features_of_another_precision_or_in_numpy(model, features):
    logs = model.log_prob(features.float())
    torch.testing.assert_close(logs, model.log_prob(features), rtol=1e-3, atol=1e-3)
    assert torch.equal(model.log_prob(features.float().numpy()), logs)
    for part, its in zip(
        model.observe(features[0].numpy()), model.observe(features[0]), strict=True
    ):
        assert torch.equal(part, its)


@pytest.mark.parametrize("skip", [-0.1, 1.1, math.nan, "all"])
def test_a_share_is_between_nothing_and_all(clips, skip):
    with pytest.raises(ModelError, match="skip"):
        LstmGmm(clips[0], Normalizer(clips[0].dim), skip=skip)


def test_normalizer_of_another_encoding(clips):
    plain = encodings.from_config({**clips[0].config(), "contacts": False})
    with pytest.raises(ModelError, match="71 channels"):
        LstmGmm(plain, Normalizer(71))
