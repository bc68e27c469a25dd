"""Initial state estimation against finite differences, single characters and the zero state."""

from dataclasses import replace

import pytest
import torch

from motionlab.errors import ModelError
from motionlab.models import State
from motionlab.solvers import initial_state
from motionlab.training import PRESETS, build, prepare
from motionlab.training.loop import draw
from motionlab.training.windows import Windows


@pytest.fixture(scope="module")
def trained():
    """A small network after a hundred updates on gaits, in float64, and validation windows."""
    data = prepare("gaits").without_contacts()
    preset = replace(PRESETS["lstm-gmm"]["smoke"], width=24)
    model, windows = build(data, preset), Windows(data.clips("train"), preset.frames)
    adam = torch.optim.Adam(model.parameters(), 3e-3)
    for update in range(100):
        adam.zero_grad()
        batch, extras = draw(windows, preset, update)
        model.loss(batch, **extras).backward()
        adam.step()
    clips = torch.stack([clip[20:30] for clip in data.clips("val")[:6]]).double()
    return model.double().eval(), clips


def likelihood(model, state, second):
    return model.predict(state).log_prob(model.normalizer(second)).detach()


def test_the_second_frame_becomes_likely(trained):
    model, clips = trained
    zero, found = model.observe(clips[:, :1]), initial_state(model, clips[:, :2])
    before, after = (likelihood(model, state, clips[:, 1]) for state in (zero, found))
    assert (after > before + 1).all()
    longer = initial_state(model, clips[:, :2], iterations=200)
    assert (likelihood(model, longer, clips[:, 1]) >= after).all()
    assert torch.equal(found.frame, clips[:, 0])
    assert (found.hidden.abs() < 1).all() and not any(part.requires_grad for part in found)


def test_three_frames_make_the_third_likely_too(trained):
    model, clips = trained

    def of_the_third(state):
        later = model.step(clips[:, 1], state)[1]
        return likelihood(model, later, clips[:, 2]).mean()

    two, three = (initial_state(model, clips[:, :frames]) for frames in (2, 3))
    assert of_the_third(three) > of_the_third(two) + 1
    assert (
        likelihood(model, three, clips[:, 1]).mean()
        > likelihood(model, model.observe(clips[:, :1]), clips[:, 1]).mean()
    )


def test_one_step_follows_the_gradient(trained):
    """Adam's first step has the length of the rate and the sign of the gradient, which here comes
    from finite differences; the state after it is the network's."""
    model, clips = trained
    first, second = clips[:1, 0], clips[:1, 1]

    def energy(hidden, cell):
        mixture, state = model.step(first, State(first, hidden.tanh(), cell))
        return -mixture.log_prob(model.normalizer(second)).sum().item(), state

    zero, rate, step = model.zero_state(1), 1e-3, 1e-5
    free = {"hidden": zero.hidden.clone(), "cell": zero.cell.clone()}
    moved = {}
    for name, part in free.items():
        gradient = torch.zeros_like(part)
        for index in range(part.numel()):
            ends = []
            for sign in (1, -1):
                other = {**free, name: part.clone()}
                other[name].view(-1)[index] += sign * step
                ends.append(energy(**other)[0])
            gradient.view(-1)[index] = (ends[0] - ends[1]) / (2 * step)
        moved[name] = part - rate * gradient / (gradient.abs() + 1e-8)
    value, expected = energy(**moved)
    assert value < energy(**free)[0]
    found = initial_state(model, clips[:1, :2], iterations=1, rate=rate)
    for part, its in zip(found, expected, strict=True):
        torch.testing.assert_close(part, its, rtol=1e-4, atol=1e-6)


def test_batched_equals_one_by_one(trained):
    model, clips = trained
    clips = clips[:3, :4]
    ones = [initial_state(model, clip, iterations=30) for clip in clips]  # (frames, dim)
    for part, its in zip(
        initial_state(model, clips, iterations=30), zip(*ones, strict=True), strict=True
    ):
        torch.testing.assert_close(part, torch.cat(its), rtol=1e-6, atol=1e-6)


def test_the_model_is_left_as_it_was(trained):
    model, clips = trained
    before = [parameter.clone() for parameter in model.parameters()]
    model.zero_grad()
    with torch.no_grad():  # the search turns gradients on where it needs them
        initial_state(model, clips, iterations=3)
    assert all(map(torch.equal, before, model.parameters()))
    assert all(parameter.grad is None for parameter in model.parameters())


@pytest.mark.parametrize("options", [{"iterations": 0}, {"rate": 0.0}, {"rate": torch.inf},
                                     {"rate": torch.nan}], ids=str)  # fmt: skip
def test_settings_that_make_no_sense(trained, options):
    with pytest.raises(ModelError, match="above 0"):
        initial_state(*trained, **options)


def test_features_that_make_no_start(trained):
    model, clips = trained
    broken = clips.clone()
    broken[0, 1, 4] = torch.nan
    for features, said in ((clips[:, :1], "2 frames"), (clips[..., :5], "shape"), (broken, "NaN")):
        with pytest.raises(ModelError, match=said):
            initial_state(model, features)
