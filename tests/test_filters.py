"""Filters against SciPy, polynomials and a Kalman smoother written out; turns, gaps, and what is refused."""

import numpy as np
import pytest
import roma
import torch
from scipy.ndimage import gaussian_filter1d
from scipy.signal import butter, filtfilt, savgol_filter

from motionlab import Motion, Skeleton, corrupt, filters
from motionlab.datasets import gaits
from motionlab.errors import MotionError
from motionlab.kinematics import heading, yaw_matrix

ALL = {
    "gaussian": lambda motion, missing=None: filters.gaussian(motion, 1.5, missing),
    "savitzky-golay": lambda motion, missing=None: filters.savitzky_golay(motion, 9, 3, missing),
    "butterworth": lambda motion, missing=None: filters.butterworth(motion, 5.0, missing),
    "kalman": lambda motion, missing=None: filters.kalman(motion, 5.0, missing),
    "median": lambda motion, missing=None: filters.median(motion, 3, missing),
}
STEADY = [name for name in ALL if name != "median"]


def made(places, turns=None, fps=30.0):
    """A motion of places (frames, 3) and rotation vectors (frames, joints, 3)."""
    skeleton = Skeleton.canonical()
    turns = torch.zeros(len(places), skeleton.joints, 3) if turns is None else turns
    return Motion(skeleton, torch.as_tensor(places), roma.rotvec_to_rotmat(turns.double()), fps)


@pytest.fixture(scope="module")
def walk():
    return gaits.make(seconds=4.0)


@pytest.fixture()
def noise():
    return torch.randn(60, 3, generator=torch.Generator().manual_seed(0))


def test_places_are_filtered_as_scipy_does(noise):
    motion, x = made(noise), noise.double().numpy()
    close = lambda found, wanted: torch.testing.assert_close(
        found.root_positions, torch.from_numpy(wanted).float(), rtol=0, atol=2e-5
    )
    close(filters.gaussian(motion, 2.0), gaussian_filter1d(x, 2.0, axis=0, mode="nearest"))
    close(filters.savitzky_golay(motion, 7, 2), savgol_filter(x, 7, 2, axis=0))
    b, a = butter(2, 4.0 / 0.802, fs=30)
    inner = filtfilt(b, a, x, axis=0, padlen=59)
    found = filters.butterworth(motion, 4.0).root_positions
    assert (found - torch.from_numpy(inner.copy()).float())[20:-20].abs().max() < 2e-3
    close(filters.median(motion, 3)[1:-1],
          np.median([x[:-2], x[1:-1], x[2:]], axis=0))  # fmt: skip


def rts(seen, fps, ratio):
    """A Kalman filter and RTS smoother written out: constant velocity, white acceleration.

    seen : (frames,), NaN where nothing was; ratio : of measurement variance to spectral density.
    """
    dt = 1 / fps
    step = np.array([[1, dt], [0, 1]])
    drive = np.array([[dt**3 / 3, dt**2 / 2], [dt**2 / 2, dt]])
    state, spread, kept = np.zeros(2), 1e7 * np.eye(2), []
    for value in seen:
        if kept:
            state, spread = step @ state, step @ spread @ step.T + drive
        before = state, spread
        if not np.isnan(value):
            gain = spread[:, 0] / (spread[0, 0] + ratio)
            state = state + gain * (value - state[0])
            spread = spread - np.outer(gain, spread[0])
        kept.append((state, spread, *before))
    smooth = [kept[-1][0]]
    for now, after in zip(kept[-2::-1], kept[:0:-1], strict=True):
        back = now[1] @ step.T @ np.linalg.inv(after[3])
        smooth.append(now[0] + back @ (smooth[-1] - after[2]))
    return np.array(smooth[::-1])[:, 0]


@pytest.mark.parametrize("lost", [[], [7, 8, 30, 31, 32, 33]])
def test_kalman_is_the_smoother_written_out(noise, lost):
    cutoff, fps = 3.0, 30.0
    missing = torch.zeros(60, dtype=torch.bool)
    missing[lost] = True
    found = filters.kalman(made(noise, fps=fps), cutoff, missing).root_positions
    seen = noise.double().numpy().copy()
    seen[lost] = np.nan
    ratio = fps / (2 * np.pi * cutoff) ** 4
    for axis in range(3):
        wanted = rts(seen[:, axis], fps, ratio)
        assert np.abs(found[:, axis].numpy() - wanted).max() < 2e-3


def test_a_smooth_line_goes_straight_on_where_nothing_is_seen():
    """Through points of a straight line it is that line, in gaps and beyond the ends; elsewhere, too."""
    line = torch.arange(40.0)[:, None].double() * torch.tensor([0.1, -3.0, 1.0, 1.0])
    seen = torch.ones(40, 4, dtype=torch.bool)
    seen[[0, 1, 2, *range(15, 20), 38, 39]] = False
    seen[:, 2], seen[4:, 3] = False, False
    hidden = torch.where(seen, line, 99.0)
    found = filters.smooth_lines(hidden, seen, torch.tensor([5.0, 80.0, 5.0, 5.0]))
    torch.testing.assert_close(found[:, :2], line[:, :2], rtol=0, atol=1e-6)
    assert not found[:, 2].any()  # never seen
    assert (found[:, 3] == 3).all()  # too few for a spline: their mean
    bent = hidden.clone()
    bent[:, 0] += (torch.arange(40) / 5).sin()
    its = filters.smooth_lines(bent, seen, 30.0)[:, 0]
    torch.testing.assert_close(its[-3:].diff(n=2), torch.zeros(1).double(), rtol=0, atol=1e-9)


@pytest.mark.parametrize("name", ["butterworth", "kalman"])
def test_a_cut_off_halves_what_it_should(name):
    """Half of the size for the smoother, half of the power for Butterworth, at any frame rate."""
    left = {"butterworth": 0.5**0.5, "kalman": 0.5}[name]
    for fps in (30.0, 120.0):
        time = torch.arange(round(20 * fps)) / fps
        wave = torch.zeros(len(time), 3)
        wave[:, 1] = (2 * torch.pi * 3.0 * time).sin()
        found = getattr(filters, name)(made(wave, fps=fps), 3.0).root_positions[:, 1]
        inner = slice(round(5 * fps), -round(5 * fps))
        share = (found * wave[:, 1])[inner].sum() / wave[:, 1][inner].square().sum()
        assert float(share) == pytest.approx(left, rel=0.1)


@pytest.mark.parametrize("name", STEADY)
def test_steady_motion_stays_and_nothing_lags(name):
    """Who moves and turns steadily does so afterwards, round and round, in the middle."""
    time = torch.arange(120) / 30
    places = torch.stack([0.5 * time, torch.ones(120), 1.2 * time], 1)
    turns = torch.zeros(120, 21, 3)
    turns[:, 0, 1] = 5.0 * time  # three turns about the vertical
    turns[:, 5, 0] = 0.4 * time - 0.8
    motion = made(places, turns)
    found = ALL[name](motion)
    inner = slice(20, -20)
    assert (found.root_positions - motion.root_positions)[inner].abs().max() < 1e-3
    off = roma.rotmat_geodesic_distance(found.rotations, motion.rotations)
    assert off[inner].max() < 3e-3


@pytest.mark.parametrize("name", [*ALL])
def test_a_world_turned_about_the_vertical_changes_nothing(name, walk):
    turn = yaw_matrix(torch.tensor(2.8))
    turned = made_like(walk, walk.root_positions @ turn.T, turn)
    found, again = ALL[name](walk), ALL[name](turned)
    back = again.root_positions @ turn
    if name == "median":  # a median of coordinates is none of places
        back = found.root_positions
    torch.testing.assert_close(back, found.root_positions, rtol=0, atol=1e-4)
    torch.testing.assert_close(turn.T @ again.rotations[:, 0], found.rotations[:, 0], rtol=0, atol=1e-4)  # fmt: skip


def made_like(motion, places, turn):
    rotations = motion.rotations.clone()
    rotations[:, 0] = turn @ rotations[:, 0]
    return Motion(motion.skeleton, places, rotations, motion.fps)


@pytest.mark.parametrize("name", STEADY)
def test_noise_becomes_less_and_rotations_stay_rotations(name, walk):
    noisy = corrupt.tremble(walk, 0.02, 0.08, generator=torch.Generator().manual_seed(1))
    found = ALL[name](noisy)
    off = lambda motion: float((motion.positions() - walk.positions()).norm(dim=-1).mean())
    assert off(found) < 0.7 * off(noisy)
    identity = found.rotations @ found.rotations.mT
    torch.testing.assert_close(identity, torch.eye(3).expand_as(identity), rtol=0, atol=1e-5)
    assert found.contacts is noisy.contacts and found.fps == noisy.fps


def test_a_median_takes_out_what_lasts_a_frame(walk):
    wrong, mask = corrupt.outliers(walk, 0.03, generator=torch.Generator().manual_seed(0))
    found = filters.median(wrong, 3)
    off = (found.positions() - walk.positions()).norm(dim=-1).mean(-1)
    lone = mask[1:-1] & ~mask[:-2] & ~mask[2:]
    assert lone.any() and off[1:-1][lone].max() < 0.15
    assert (wrong.positions() - walk.positions()).norm(dim=-1).mean(-1)[mask].min() > 0.15


@pytest.mark.parametrize("name", [*ALL])
def test_what_was_not_seen_is_not_looked_at(name, walk):
    missing = torch.zeros(len(walk), walk.skeleton.joints, dtype=torch.bool)
    missing[40:55, 4:7] = True
    missing[70:72] = True
    rotations, places = walk.rotations.clone(), walk.root_positions.clone()
    rotations[missing] = roma.random_rotmat(int(missing.sum()))
    places[missing[:, 0]] += 5
    wild = Motion(walk.skeleton, places, rotations, walk.fps)
    found, again = ALL[name](walk, missing), ALL[name](wild, missing)
    torch.testing.assert_close(found.rotations, again.rotations, rtol=0, atol=1e-5)
    torch.testing.assert_close(found.root_positions, again.root_positions, rtol=0, atol=1e-5)


def test_gaps_are_filled_along_lines_and_arcs():
    time = torch.arange(30.0)
    turns = torch.zeros(30, 21, 3)
    turns[:, 3, 0] = 0.05 * time
    turns[:, 0, 1] = 0.1 * time
    straight = made(torch.stack([time, time * 0, time * 2], 1), turns)
    missing = torch.zeros(30, dtype=torch.bool)
    missing[[0, 1, 10, 11, 12, 29]] = True
    seen = filters.filled(straight, missing)
    inner = slice(2, 29)
    torch.testing.assert_close(seen.root_positions[inner], straight.root_positions[inner])
    torch.testing.assert_close(seen.rotations[inner], straight.rotations[inner], rtol=0, atol=1e-5)
    assert torch.equal(seen.root_positions[0], straight.root_positions[2])
    assert torch.equal(seen.rotations[29], straight.rotations[28])
    assert filters.filled(straight, None) is straight
    yaw = heading(seen.rotations[:, 0])
    assert float(yaw[11]) == pytest.approx(1.1, abs=1e-5)


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        (lambda m: filters.gaussian(m, 0), "width is 0; it must be a positive number"),
        (lambda m: filters.savitzky_golay(m, 8, 3), "frames must be odd"),
        (lambda m: filters.savitzky_golay(m, 401, 3), "no more than the motion has"),
        (lambda m: filters.butterworth(m, 13.0), "must be below 12 Hz"),
        (lambda m: filters.butterworth(m, float("nan")), "must be a positive number"),
        (lambda m: filters.kalman(m[:4], 3.0), "4 of 4 frames are seen; it needs 5"),
        (lambda m: filters.median(m, 4), "must be an odd number"),
        (lambda m: filters.filled(m, torch.zeros(7, dtype=torch.bool)), r"shape \(7,\); it must be bool"),
        (lambda m: filters.filled(m, torch.ones(len(m), dtype=torch.bool)), "Hips.* is seen in no frame"),
        (lambda m: filters.gaussian("walk", 2.0), "takes a Motion"),
    ],
)  # fmt: skip
def test_nonsense_is_refused_with_a_remedy(walk, wrong, said):
    with pytest.raises(MotionError, match=said):
        wrong(walk)
