"""Prediction errors of motions whose error is known."""

import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.stats import wasserstein_distance

from motionlab.errors import MetricError
from motionlab.metrics.prediction import at_milliseconds, mean_joint_error, npss, position_error


def test_moved_by_a_centimetre():
    true = torch.randn(7, 26, 3)
    predicted = true + torch.tensor([0.0, 0.006, 0.008])
    torch.testing.assert_close(mean_joint_error(predicted, true), torch.ones(7))
    torch.testing.assert_close(position_error(predicted, true), torch.full((7,), 0.01 * 26**0.5))


def test_one_point_off():
    true = torch.zeros(2, 5, 4, 3)
    predicted = true.clone()
    predicted[1, 3, 2, 0] = 0.2
    expected = torch.zeros(2, 5)
    expected[1, 3] = 0.2
    torch.testing.assert_close(position_error(predicted, true), expected)
    torch.testing.assert_close(mean_joint_error(predicted, true), 100 * expected / 4)


def test_errors_can_be_differentiated():
    predicted = torch.randn(4, 5, 3, requires_grad=True)
    position_error(predicted, torch.zeros(4, 5, 3)).sum().backward()
    assert torch.isfinite(predicted.grad).all() and (predicted.grad != 0).all()


# -- at milliseconds ---------------------------------------------------------------------------


def test_frame_one_is_one_frame_after_the_seed():
    errors = torch.tensor([1.0, 2.0, 4.0])  # at 100, 200, 300 ms
    found = at_milliseconds(errors, 10, [0, 50, 100, 150, 250, 300])
    assert found.tolist() == [0, 0.5, 1, 1.5, 3, 4]


@pytest.mark.parametrize("fps", [24, 25, 30, 59.94, 60, 120])
def test_an_error_that_grows_steadily_is_read_alike_at_every_rate(fps):
    errors = torch.arange(1, int(0.7 * fps) + 1, dtype=torch.float64) / fps  # metres = seconds
    found = at_milliseconds(errors.expand(2, 3, -1), fps)
    expected = torch.tensor([0.08, 0.16, 0.24, 0.32, 0.40, 0.48, 0.56, 0.64], dtype=torch.float64)
    torch.testing.assert_close(found, expected.expand(2, 3, 8))


@settings(max_examples=50, deadline=None)
@given(
    errors=st.lists(st.floats(0, 10), min_size=1, max_size=20),
    fps=st.floats(5, 240),
    part=st.floats(0, 1),
)
def test_reads_as_numpy_interpolates(errors, fps, part):
    when = part * len(errors) * 1000 / fps
    grid = 1000 * np.arange(len(errors) + 1) / fps
    found = at_milliseconds(torch.tensor(errors, dtype=torch.float64), fps, [when])
    assert found.item() == pytest.approx(np.interp(when, grid, [0, *errors]), abs=1e-6)


@pytest.mark.parametrize(
    ("errors", "fps", "times", "message"),
    [
        ([1.0] * 10, 30, [80, 400], "reach from 0 to 333.333 ms"),
        ([1.0] * 10, 30, [-1], "goes from -1"),
        ([1.0, float("nan")], 30, [10], "errors[1] is NaN"),
        ([], 30, [10], "at least one frame"),
        ([1.0], -30, [10], "fps is -30"),
        ([1.0], 30, 80, "goes from 80 to 80"),
        ([1.0], 30, "soon", "milliseconds must be an array"),
    ],
)
def test_times_outside_are_refused(errors, fps, times, message):
    with pytest.raises(MetricError) as error:
        at_milliseconds(torch.tensor(errors), fps, times)
    assert message in str(error.value)


# -- npss ----------------------------------------------------------------------------------------


def distance(predicted, true, **options):
    """NPSS of one second."""
    return npss(predicted, true, predicted.shape[-2], highest=1000, **options)


def waves(cycles, frames=60, amplitude=1.0, phase=0.0):
    time = torch.arange(frames, dtype=torch.float64)[:, None] / frames
    return amplitude * torch.cos(2 * torch.pi * torch.tensor(cycles) * time + phase)


def test_npss_is_the_distance_between_two_frequencies():
    assert distance(waves([7.0]), waves([3.0])).item() == pytest.approx(4)
    assert distance(waves([3.0], phase=1.2), waves([3.0])).item() == pytest.approx(0, abs=1e-7)
    assert distance(2 * waves([3.0]), waves([3.0])).item() == pytest.approx(0, abs=1e-7)


def test_npss_weighs_features_by_their_power():
    true = torch.cat([waves([3.0], amplitude=2.0), waves([5.0])], -1)  # powers 4 : 1
    predicted = torch.cat([waves([4.0], amplitude=2.0), waves([5.0])], -1)
    assert distance(predicted, true).item() == pytest.approx(4 / 5)
    both = distance(torch.stack([predicted, true]), torch.stack([true, true]), pooled=False)
    assert both.tolist() == pytest.approx([0.8, 0], abs=1e-7)
    assert distance(torch.stack([predicted, true]), torch.stack([true, true])) == pytest.approx(0.4)


def test_npss_against_scipy():
    torch.manual_seed(0)
    predicted, true = torch.randn(2, 3, 33, 4, dtype=torch.float64)
    total, weight = 0.0, 0.0
    for sequence in range(3):
        for feature in range(4):
            a, b = (
                np.abs(np.fft.rfft(x[sequence, :, feature].numpy())) ** 2 for x in (predicted, true)
            )
            bins = np.arange(len(a))
            total += b.sum() * wasserstein_distance(bins, bins, a, b)
            weight += b.sum()
    assert distance(predicted, true).item() == pytest.approx(total / weight)


def test_npss_of_a_frozen_prediction_is_the_mean_frequency():
    frozen = torch.ones(60, 1, dtype=torch.float64)
    assert distance(frozen, waves([3.0])).item() == pytest.approx(3)
    assert distance(0 * frozen, waves([3.0])).item() == pytest.approx(3)
    assert distance(waves([3.0]), 0 * frozen).isnan()


@pytest.mark.parametrize("seconds", [1, 4])
def test_npss_is_in_hertz(seconds):
    predicted, true = (waves([hertz * seconds], 60 * seconds) for hertz in (7.0, 3.0))
    assert npss(predicted, true, 60).item() == pytest.approx(4)
    assert npss(predicted, true, 60, highest=5).isfinite()  # what is left is rounding


def test_npss_does_not_care_for_the_frame_rate():
    """Waves that do not fit the window leak into all frequencies, and at 30 fps fold back."""
    found = [
        npss(waves([4.5, 2.0], 4 * fps), waves([3.2, 2.3], 4 * fps), fps).item()
        for fps in (30, 60, 120)
    ]
    assert found[0] == pytest.approx(found[1], rel=0.1)
    assert found[2] == pytest.approx(found[1], rel=0.02)


@pytest.mark.parametrize("function", [position_error, mean_joint_error])
@pytest.mark.parametrize(
    ("predicted", "true", "message"),
    [
        (torch.zeros(4, 5, 3), torch.zeros(3, 5, 3), "resample them to the same frames"),
        (torch.zeros(4, 15), torch.zeros(4, 15), "predicted has shape (4, 15)"),
        (torch.zeros(0, 5, 3), torch.zeros(0, 5, 3), "predicted has 0 frames"),
        (torch.zeros(4, 5, 3), torch.full((4, 5, 3), float("inf")), "true[0, 0, 0] is NaN or inf"),
        ("motion", torch.zeros(4, 5, 3), "predicted must be an array"),
    ],
    ids=["frames", "features", "empty", "infinite", "text"],
)
def test_bad_input(function, predicted, true, message):
    with pytest.raises(MetricError) as error:
        function(predicted, true)
    assert message in str(error.value)


def test_npss_bad_input():
    with pytest.raises(MetricError, match="at least 2"):
        npss(torch.zeros(1, 4), torch.zeros(1, 4), 30)
    with pytest.raises(MetricError, match="frames, dim"):
        npss(torch.zeros(4), torch.zeros(4), 30)
