"""States to start from, and the temperature at which motion is as lively as the data."""

from types import SimpleNamespace

import pytest
import torch

from motionlab.models import State
from motionlab.training.finish import finish, fit_temperature

FRAMES = 300


class Trembling:
    """Points at rest, each frame off by a normal number times 1 cm times the temperature."""

    fps = 30.0
    encoding = SimpleNamespace(positions=lambda features: features.unflatten(-1, (-1, 3)))

    def observe(self, features):
        return State(features[:, -1], features[:, :0], features[:, :0])

    def generate(self, n, start, *, generator, temperature):
        return 0.01 * temperature * torch.randn(len(start.frame), n, 12, generator=generator)


@pytest.mark.parametrize(("true", "found"), [(0.3, 0.3), (0.75, 0.75), (0.02, 0.11), (3.0, 0.99)])
def test_the_temperature_of_the_data_is_found(true, found):
    chance = torch.Generator().manual_seed(5)
    clips = [0.01 * true * torch.randn(FRAMES, 12, generator=chance) for _ in range(6)]
    short = torch.zeros(20, 12)  # less than is seen at first: left out
    assert fit_temperature(Trembling(), [*clips, short]) == pytest.approx(found, abs=0.02)


def test_finished_weights_are_as_trained_and_begin_in_validation_clips(
    train, smoke, gaits, tmp_path
):
    from motionlab import load

    train(tmp_path, smoke(updates=10))
    before = load(tmp_path / "best.safetensors")
    sampling = finish(tmp_path / "best.safetensors", gaits)
    after = load(tmp_path / "best.safetensors")
    assert before.start_names == ("mean frame",) and len(after.start_names) > 3
    assert before.card == "" and all(name in after.card for name in after.start_names)
    assert after.sampling == sampling and after.about["preset"] == before.about["preset"]
    for name, weight in before.state_dict().items():
        assert torch.equal(weight, after.state_dict()[name])
    held_out = torch.cat(gaits.clips("val"))
    for frame in after.starts.frame:
        assert (held_out == frame).all(1).any()
    again = finish(tmp_path / "best.safetensors", gaits)
    assert again == sampling


def test_bounds_of_strange_starts_are_stored_where_there_are_clips_enough_for_them(
    train, smoke, gaits, tmp_path, monkeypatch
):
    from motionlab import load
    from motionlab.models import familiar

    train(tmp_path, smoke(updates=10))
    path = tmp_path / "best.safetensors"
    finish(path, gaits)
    assert load(path).familiar is None and "familiar" not in load(path).about
    monkeypatch.setattr(familiar, "LEAST", 10)
    finish(path, gaits)
    model = load(path)
    assert model.familiar == familiar.bounds(model, gaits.clips("val"))
    with pytest.warns(UserWarning, match="farther from the mean"):
        model.observe(3 * gaits.clips("val")[0])
    monkeypatch.undo()
    finish(path, gaits)  # what was stored is not kept
    assert load(path).familiar is None
