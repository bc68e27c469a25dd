"""`training.evaluation` against the model, plain sums, and models that fail on purpose."""

import math

import pytest
import torch

import motionlab
from motionlab import contacts, metrics
from motionlab.errors import TrainingError
from motionlab.training import evaluation


@pytest.fixture(scope="module")
def model(shipped):
    return motionlab.load(shipped)


def test_likelihood_is_the_mean_over_frames(model, gaits):
    clips = [clip[: 20 + 7 * i] for i, clip in enumerate(gaits.data.clips("val"))]
    logs = torch.cat([model.log_prob(clip[None])[0] for clip in clips])
    found = evaluation.likelihood(model, [*clips, clips[0][:1]])
    assert found.value == pytest.approx(logs.mean().item(), abs=1e-4)
    assert found.low < found.value < found.high and found.clips == len(clips)


def test_starting_windows_are_spread_over_all_clips():
    clips = [torch.full((length, 2), float(i)) for i, length in enumerate([90, 31, 29, 60])]
    windows = evaluation.starting_windows(clips, 6, 30)
    assert windows[:, 0, 0].tolist() == [0, 0, 0, 1, 3, 3]
    assert evaluation.starting_windows(clips, 2, 30)[:, 0, 0].tolist() == [0, 3]
    assert len(evaluation.starting_windows(clips, 100, 30)) == 6
    with pytest.raises(TrainingError, match="No clip has the 100 frames"):
        evaluation.starting_windows(clips, 2, 100)


class Player(torch.nn.Module):
    """A "model" that plays back whatever it is told to."""

    def __init__(self, model, frames):
        super().__init__()
        self.encoding, self.frames = model.encoding, frames
        self.log_prob = model.log_prob

    def observe(self, features, doubt=True):
        return features

    def generate(self, n, start, generator):
        return self.frames[None, :n].expand(len(start), -1, -1).clone()


def test_a_replay_of_the_data_scores_as_the_data(model, gaits):
    clip = gaits.data.clips("val")[0][:90]
    found = evaluation.evaluate(Player(model, clip), gaits.data, starts=4, seconds=3)
    points = model.encoding.positions(clip)
    down = contacts.label_positions(points, model.encoding.skeleton, 30)
    assert found.samples["speed (m/s)"].value == pytest.approx(
        metrics.speed(points, 30).mean().item(), rel=1e-5
    )
    assert found.samples["foot skate (cm/s)"].value == pytest.approx(
        metrics.foot_skate(points, down, model.encoding.skeleton, 30).item(), rel=1e-5
    )
    assert (found.starts, found.frozen, found.diverged) == (4, 0, 0)


def test_statues_and_explosions_are_counted(model, gaits):
    clip = gaits.data.clips("val")[0]
    still = clip[:1].expand(900, -1).clone()
    still[:, :3] = 0
    found = evaluation.evaluate(Player(model, still), gaits.data, starts=3, seconds=30)
    assert (found.frozen, found.diverged) == (3, 0)
    assert found.samples["speed (m/s)"].value == 0
    for value in (50.0, torch.nan, torch.inf):
        wild = clip[:90].clone()
        wild[60:, 3] = value  # the height
        found = evaluation.evaluate(Player(model, wild), gaits.data, starts=3, seconds=3)
        assert (found.frozen, found.diverged, found.samples) == (0, 3, {})


def test_features_of_another_kind(model, gaits):
    plain = gaits.data.without_contacts()
    with pytest.raises(TrainingError, match="another kind"):
        evaluation.evaluate(model, plain)
    with pytest.raises(TrainingError, match="no split 'dev'"):
        evaluation.evaluate(model, gaits.data, "dev")


def test_means_are_over_frames_and_leave_out_what_is_not_defined():
    values = [{"a": 1.0, "b": math.nan}, {"a": 4.0, "b": 2.0}, {"a": 4.0, "b": math.nan}]
    found = evaluation.over_all(values, [10, 20, 30])
    assert found["a"].value == pytest.approx((10 + 80 + 120) / 60)
    assert found["b"].value == 2.0 and found["b"].clips == 1
    assert "c" not in evaluation.over_all([{"c": math.nan, "a": 1.0}], [1])
