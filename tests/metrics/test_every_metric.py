"""What must hold for every metric: units, frame rates, batches, places, and bad input."""

import inspect
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache

import numpy as np
import pytest
import torch
from torch import Tensor

from motionlab import MotionLabError, Skeleton, contacts, metrics
from motionlab.datasets import gaits
from motionlab.kinematics import yaw_matrix
from motionlab.metrics import bones, change, feet, gait, path, prediction, smoothness


@dataclass(frozen=True)
class Clip:
    """What metrics measure, and how much larger than life it is."""

    positions: Tensor
    other: Tensor  # positions of another motion, to be compared with
    contacts: Tensor
    skeleton: Skeleton
    fps: float
    curve: Tensor
    scale: float = 1.0


@dataclass(frozen=True)
class Case:
    """A metric, the power of length in its unit, and by how much twice the rate may change it:
    by a share of the value, or by an amount in its unit."""

    measure: Callable[[Clip], Tensor]
    power: int
    rate_tolerance: float
    rate_amount: float = 1e-3
    turns: bool = True  # the same for a body that stands elsewhere and faces elsewhere


CASES = {
    "position_error": Case(lambda c: prediction.position_error(c.positions, c.other), 1, 0.01),
    "mean_joint_error": Case(lambda c: prediction.mean_joint_error(c.positions, c.other), 1, 0.01),
    "at_milliseconds": Case(
        lambda c: prediction.at_milliseconds(
            prediction.mean_joint_error(c.positions, c.other)[..., 1:], c.fps, (80, 320, 640)
        ),
        1,
        0.02,
    ),
    "npss": Case(
        lambda c: prediction.npss(
            c.positions.flatten(-2), c.other.flatten(-2), c.fps, pooled=False
        ),
        0,
        0.03,
        turns=False,
    ),
    "motion_change": Case(lambda c: change.motion_change(c.positions, c.fps), 1, 0.01),
    "feature_change": Case(lambda c: change.feature_change(c.positions[..., 5, :], c.fps), 1, 0.01),
    "foot_skate": Case(lambda c: feet.foot_skate(slid(c), c.contacts, c.skeleton, c.fps), 1, 0.001),
    "foot_skate of found contacts": Case(
        lambda c: feet.foot_skate(c.positions, found(c), c.skeleton, c.fps),
        1,
        0,
        0.15,  # cm/s
    ),
    "foot_skate_ratio": Case(
        lambda c: feet.foot_skate_ratio(
            c.positions, found(c), c.skeleton, c.fps, speed=0.02 * c.scale
        ),
        0,
        0,
        0.03,  # a few steps more or less lie above the limit
    ),
    "foot_skate_weighted": Case(
        lambda c: feet.foot_skate_weighted(c.positions, c.skeleton, c.fps, height=0.025 * c.scale),
        1,
        0.02,
    ),
    "penetration": Case(lambda c: feet.penetration(sunk(c), c.skeleton), 1, 0.01),
    "floating": Case(lambda c: feet.floating(sunk(c, -0.02), c.skeleton), 1, 0.01),
    "floating in contact": Case(
        lambda c: feet.floating(sunk(c, -0.02), c.skeleton, contacts=c.contacts), 1, 0.01
    ),
    "acceleration": Case(lambda c: smoothness.acceleration(c.positions, c.fps), 1, 0.02),
    "jerk": Case(lambda c: smoothness.jerk(c.positions, c.fps), 1, 0.02),
    "bone_length_error": Case(
        lambda c: bones.bone_length_error(1.1 * c.positions, c.skeleton).mean, 1, 0.001
    ),
    "root_path_error rms": Case(lambda c: path.root_path_error(c.positions, c.curve).rms, 1, 0.01),
    "root_path_error mean square": Case(
        lambda c: path.root_path_error(c.positions, c.curve).mean_square, 2, 0.02
    ),
    "speed": Case(lambda c: gait.speed(c.positions, c.fps), 1, 0.002),
    "turn_rate": Case(lambda c: gait.turn_rate(c.positions, c.skeleton, c.fps), 0, 0.01),
    "step_length": Case(
        lambda c: gait.step_length(c.positions, c.contacts, c.skeleton, c.fps), 1, 0.01
    ),
    "cadence": Case(lambda c: gait.cadence(c.contacts, c.fps), 0, 0.01),
}
every = pytest.mark.parametrize("case", CASES.values(), ids=CASES.keys())
PER_FRAME = ("positions", "other", "contacts")


def found(clip):
    return contacts.label_positions(
        clip.positions, clip.skeleton, clip.fps, speed=0.45 * clip.scale
    )


def slid(clip):
    """The motion on a conveyor belt that runs at 10 cm/s."""
    positions = clip.positions.clone()
    way = 0.1 * clip.scale * torch.arange(positions.shape[-3]).to(positions) / clip.fps
    positions[..., 0] += way[:, None]
    return positions


def sunk(clip, depth=0.03):
    positions = clip.positions.clone()
    positions[..., 1] -= depth * clip.scale
    return positions


@cache
def clip(fps=30, speed=1.3, seconds=10):
    make = lambda speed: gaits.make(seconds=seconds, speed=speed, turn_rate=0.3, fps=fps, seed=1)
    motion = make(speed)
    return Clip(
        motion.positions().double(), make(speed + 0.4).positions().double(), motion.contacts,
        motion.skeleton, fps, torch.tensor([[0.0, 0.0], [1.0, 4.0], [5.0, 5.0]]).double(),
    )  # fmt: skip


def close(a, b, **tolerance):
    torch.testing.assert_close(a, b, equal_nan=True, **tolerance)


@every
def test_scaled_lengths_scale_and_ratios_stay(case):
    small, s = clip(), 2.5
    skeleton = small.skeleton
    big = replace(
        small,
        positions=s * small.positions,
        other=s * small.other,
        skeleton=replace_lengths(skeleton, s),
        curve=s * small.curve,
        scale=s,
    )
    close(case.measure(big), s**case.power * case.measure(small), rtol=1e-4, atol=1e-4)


def replace_lengths(skeleton, s):
    return replace(skeleton, offsets=s * skeleton.offsets, end_offsets=s * skeleton.end_offsets)


@every
@pytest.mark.parametrize("speed", [1.3, 3.2])
def test_twice_the_frame_rate_tells_the_same(case, speed):
    slow, fast = (
        torch.as_tensor(case.measure(clip(fps, speed))).nanmean().item() for fps in (30, 60)
    )
    assert fast == pytest.approx(slow, rel=case.rate_tolerance, abs=case.rate_amount)


@every
def test_a_batch_is_a_loop(case):
    walk, run = clip(), clip(speed=3.2)
    both = replace(
        walk, **{name: torch.stack([getattr(walk, name), getattr(run, name)]) for name in PER_FRAME}
    )
    values = case.measure(both)
    assert len(values) == 2
    close(values[0], case.measure(walk))
    close(values[1], case.measure(run))
    nested = replace(both, **{name: getattr(both, name)[None] for name in PER_FRAME})
    close(case.measure(nested), values[None])


@pytest.mark.parametrize("name", [name for name, case in CASES.items() if case.turns])
def test_another_place_and_direction_tell_the_same(name):
    case = CASES[name]
    here = clip()
    turn = yaw_matrix(torch.tensor(2.2).double())
    shift = torch.tensor([3.0, 0, -2.0]).double()
    moved = {name: getattr(here, name) @ turn.mT + shift for name in ("positions", "other")}
    curve = torch.stack([here.curve[:, 0], 0 * here.curve[:, 0], here.curve[:, 1]], -1)
    curve = (curve @ turn.mT + shift)[:, [0, 2]]
    moved = replace(here, **moved, curve=curve)
    close(case.measure(moved), case.measure(here), rtol=1e-6, atol=1e-6)


@every
def test_single_precision_is_enough(case):
    here = clip()
    single = replace(here, positions=here.positions.float(), other=here.other.float())
    # half a millimetre in an acceleration of 30 fps is 0.5 m/s²: rounding is 1e-7 of it
    close(case.measure(single).double(), case.measure(here).double(), rtol=0.01, atol=0.01)


@every
def test_an_interval_over_clips(case):
    clips = [clip(seconds=4), clip(speed=3.2, seconds=4), clip(speed=0.8, seconds=4)]
    values = [torch.as_tensor(case.measure(c)).nanmean().item() for c in clips]
    interval = metrics.bootstrap(values)
    assert interval.value == pytest.approx(np.mean(values)) and interval.clips == 3
    rounding = 1e-9 * max(map(abs, values))
    assert min(values) - rounding <= interval.low <= interval.value
    assert interval.value <= interval.high <= max(values) + rounding


def test_every_metric_takes_its_arguments_in_one_order():
    """Motion, contacts, whose body or its limits, frame rate: by position or by name."""
    order = ("contacts", "skeleton", "limits", "fps")
    timed = [getattr(metrics, name) for name in metrics.__all__]
    timed += [metrics.Limits.fit, metrics.Frechet.fit, metrics.Frechet.moments]
    timed = [metric for metric in timed if inspect.isroutine(metric)]
    for metric in timed:
        parameters = inspect.signature(metric).parameters
        found = [name for name in parameters if name in order]
        if "fps" not in found:
            continue
        assert found == sorted(found, key=order.index), metric
        assert all(parameters[n].kind is inspect.Parameter.POSITIONAL_OR_KEYWORD for n in found)


@pytest.mark.parametrize(
    "name", ["motion_change", "npss", "foot_skate_weighted", "jerk", "speed", "cadence"]
)
@pytest.mark.parametrize("fps", ["30", None, 0, float("nan"), 10**400, torch.ones(2)],
                         ids=["text", "none", "zero", "nan", "huge", "two"])  # fmt: skip
def test_bad_rates_are_answered(name, fps):
    with pytest.raises(MotionLabError, match="fps"):
        CASES[name].measure(replace(clip(), fps=fps))


@pytest.mark.parametrize(
    "name", sorted(CASES.keys() - {"cadence", "feature_change"})
)  # no positions
@pytest.mark.parametrize("bad", ["nan", "flat", "empty", "no clips"])
def test_bad_positions_are_answered(name, bad):
    here, case = clip(), CASES[name]
    positions = {
        "nan": torch.where(here.positions > 0, here.positions, torch.nan),
        "flat": here.positions[..., :2],
        "empty": here.positions[:0],
        "no clips": here.positions[None][:0],
    }[bad]
    labels = here.contacts[None][:0] if bad == "no clips" else here.contacts[: len(positions)]
    broken = replace(here, positions=positions, contacts=labels)
    with pytest.raises(MotionLabError):
        case.measure(broken)
