"""The procedural gaits: contacts that are true, feet that hold, speeds that are kept."""

import numpy as np
import pytest
import torch

from motionlab import MotionLabError, Skeleton
from motionlab.datasets import gaits

FEET = ("LeftFoot", "LeftToes", "RightFoot", "RightToes")
SPEEDS = (0.6, 1.0, 1.4, 1.9, 2.0, 2.2, 3.0, 4.0, 5.0)
TURNS = ((1.2, 0.8), (1.2, -0.8), (3.0, 0.6), (0.0, 1.0))
CHANGES = (
    [0, 0, 1.3, 1.3, 1.3, 0, 0],
    [1.4, 1.4, 3.5, 3.5, 1.4],
    [0, 0, 4, 4, 0],
    [0, 0.5, 0, 1, 0, 2, 0],
)


def feet(motion):
    """Positions of the labelled joints, (frames, 4, 3)."""
    return motion.positions()[:, [motion.skeleton.index(name) for name in FEET]].double()


def everything():
    for speed in SPEEDS:
        yield f"{speed}", dict(speed=speed, seconds=4)
    for speed, turn in TURNS:
        yield f"{speed} turning {turn}", dict(speed=speed, turn_rate=turn, seconds=4)
    for change in CHANGES:
        yield f"{change}", dict(speed=change, seconds=7)


ALL = dict(everything())
each = pytest.mark.parametrize("options", ALL.values(), ids=ALL.keys())


@each
@pytest.mark.parametrize("fps", [30, 60, 120])
def test_labelled_feet_rest(options, fps):
    motion = gaits.make(**options, fps=fps, seed=5)
    step = feet(motion).diff(dim=0).norm(dim=-1)
    held = motion.contacts[1:] & motion.contacts[:-1]
    assert held.any()
    assert step[held].max() < 1e-4  # metres; 1 mm is asked for
    # What is labelled in neither of two frames moves (a foot turns back in the air at some point).
    free = ~motion.contacts[1:] & ~motion.contacts[:-1]
    if free.any():
        assert step[free].median() * fps > 0.15
    # Labelled feet are on the floor: ankles at 10 cm, toes at 2.5 cm.
    height = feet(motion)[..., 1] - torch.tensor([0.1, 0.0251] * 2)
    assert height[motion.contacts].abs().max() < 1e-4


@each
def test_body_is_sound(options):
    motion = gaits.make(**options, seed=2)
    skeleton, points = motion.skeleton, motion.positions()
    assert skeleton.matches(Skeleton.canonical())
    assert points[..., 1].min() > -0.005
    turns = motion.rotations
    torch.testing.assert_close(turns.mT @ turns, torch.eye(3).expand_as(turns), rtol=0, atol=1e-5)
    for side in ("Left", "Right"):
        hip, knee, ankle = (
            points[:, skeleton.index(side + joint)] for joint in ("UpperLeg", "LowerLeg", "Foot")
        )
        # The knee lies in front of the line from hip to ankle, as the pelvis faces.
        ahead = motion.orientations()[:, 0, :, 2]
        assert ((knee - (hip + ankle) / 2) * ahead).sum(-1).min() > 0
        assert (hip - ankle).norm(dim=-1).max() < 0.9995 * 0.8007
        # Hands keep clear of the body's middle line.
        hand = points[:, skeleton.index(side + "Hand")] - points[:, skeleton.index("Spine")]
        chest = motion.orientations()[:, skeleton.index("Chest")]
        across = (chest.mT @ hand[..., None])[:, 0, 0] * (1 if side == "Left" else -1)
        assert across.min() > 0.08


@each
def test_no_pops(options):
    # The real runs' hips, heads and hands reach 66, 41 and 88 m/s²; their knees and toes 69, 121.
    points = gaits.make(**options, seed=2).positions().double()
    push = (points.diff(n=2, dim=0) * 30**2).norm(dim=-1).amax(0)
    skeleton = Skeleton.canonical()
    for joint, most in (("Hips", 45), ("Head", 45), ("LeftHand", 90), ("LeftLowerLeg", 200)):
        assert push[skeleton.index(joint)] < most, joint
    assert push[skeleton.index("LeftToes")] < 150


@pytest.mark.parametrize("speed", SPEEDS)
@pytest.mark.parametrize("turn", [0.0, 0.5])
def test_speed_and_turn_rate(speed, turn):
    motion = gaits.make(speed=speed, turn_rate=turn, seconds=10, seed=1)
    way = motion.root_positions[:, [0, 2]].double()
    # Path length over whole seconds; sway makes it longer, so chords of one stride's mean.
    smooth = torch.nn.functional.avg_pool1d(way.T[None], 31, 1)[0].T
    length = smooth.diff(dim=0).norm(dim=-1).sum()
    # A mean over an arc of angle a is nearer to the centre by sin(a/2)/(a/2).
    half = turn * 30 / 30 / 2
    length = length / (np.sin(half) / half if half else 1)
    assert length / ((len(smooth) - 1) / 30) == pytest.approx(speed, rel=0.02)
    facing = motion.orientations()[:, 0, :, 2].double().numpy()
    yaw = np.unwrap(np.arctan2(facing[:, 0], facing[:, 2]))
    rate = np.polyfit(np.arange(len(yaw)) / 30, yaw, 1)[0]
    assert rate == pytest.approx(turn, abs=0.02)


def stance(motion):
    return motion.contacts[:, :2].any(1).float().mean().item()


def test_stance_shrinks_and_running_flies():
    slow, brisk, run = (gaits.make(speed=v, seconds=12, seed=0) for v in (0.6, 1.5, 3.5))
    assert 0.5 < stance(brisk) <= stance(slow) + 0.02 < 0.7
    assert 0.25 < stance(run) < 0.42
    down = [m.contacts[:, :2].any(1).int() + m.contacts[:, 2:].any(1).int() for m in (brisk, run)]
    assert (down[0] == 2).any() and (down[0] > 0).all()  # double support, never none
    assert (down[1] == 0).any() and (down[1] < 2).all()  # flight, never double support


def test_step_length_is_obeyed():
    motion = gaits.make(speed=1.2, step_length=0.5, seconds=10, noise=0)
    strikes = (motion.contacts[1:, 0] & ~motion.contacts[:-1, 0]).nonzero()[:, 0] + 1
    ankles = feet(motion)[strikes, 0, 2]
    torch.testing.assert_close(
        ankles.diff(), torch.full((len(ankles) - 1,), 1.0).double(), rtol=0.02, atol=0
    )


def test_stands_still_with_feet_side_by_side():
    motion = gaits.make(speed=0, seconds=3)
    assert motion.contacts.all()
    points = feet(motion)
    torch.testing.assert_close(points[:1].expand_as(points), points, rtol=0, atol=1e-5)
    assert (points[0, 0, 2] - points[0, 2, 2]).abs() < 0.05
    assert 1e-4 < motion.positions()[:, 4].std(dim=0).norm() < 0.05  # breathing and swaying


def test_starts_and_stops_side_by_side():
    motion = gaits.make(speed=[0, 0, 1.3, 1.3, 1.3, 0, 0, 0], seconds=8, seed=4, noise=0)
    for frame in (0, -1):
        assert motion.contacts[frame].all()
        left, right = feet(motion)[frame, 0], feet(motion)[frame, 2]
        assert (left - right)[2].abs() < 0.02 and 0.1 < (left - right)[0] < 0.25


def test_frame_rate_does_not_matter():
    for options in (dict(speed=1.3, turn_rate=0.4), dict(speed=[0, 1.5, 3, 0], seconds=5)):
        coarse, fine = (gaits.make(**options, fps=fps, seed=8) for fps in (30, 60))
        torch.testing.assert_close(fine[::2].positions(), coarse.positions(), rtol=0, atol=1e-6)
        assert (fine[::2].contacts == coarse.contacts).all()


def test_seed_decides():
    a, b = gaits.make(seed=3), gaits.make(seed=torch.Generator().manual_seed(3))
    assert torch.equal(a.positions(), b.positions())
    assert not torch.allclose(a.positions(), gaits.make(seed=4).positions(), atol=0.01)


@pytest.mark.parametrize("speed", [0.0, 1.2, 3.0])
def test_left_turn_mirrors_right_turn(speed):
    left = gaits.make(speed=speed, turn_rate=0.6, phase=0.1, noise=0)
    right = gaits.make(speed=speed, turn_rate=-0.6, phase=0.6, noise=0)
    torch.testing.assert_close(left.mirror().positions(), right.positions(), rtol=0, atol=1e-4)
    assert (left.mirror().contacts == right.contacts).all()


def test_speed_over_time_as_array_and_function():
    array = gaits.make(speed=[1.0, 1.5], seconds=4)
    function = gaits.make(speed=lambda t: 1 + t / 8, seconds=4)
    torch.testing.assert_close(array.positions(), function.positions(), rtol=0, atol=1e-5)


def test_parameters_do_what_they_say():
    swing = lambda m: (m.positions()[:, m.skeleton.index("LeftHand")] - m.root_positions)[
        :, 2
    ].std()
    assert swing(gaits.make(arm_swing=1.5)) > 1.3 * swing(gaits.make(arm_swing=1.0))
    bob = lambda m: m.root_positions[:, 1].std()
    assert bob(gaits.make(speed=3, bounce=1.4)) > 1.15 * bob(gaits.make(speed=3))
    fore = lambda m: (m.positions()[:, m.skeleton.index("Neck")] - m.root_positions)[:, 2].mean()
    assert fore(gaits.make(lean=0.3)) > fore(gaits.make()) + 0.05


@pytest.mark.parametrize(
    "options",
    [
        *(
            dict(speed=v)
            for v in (-0.1, 6.1, float("nan"), float("inf"), "fast", [], [[1, 2]], None)
        ),
        *(dict(seconds=v) for v in (0, -1, float("nan"), "long", None)),
        *(dict(fps=v) for v in (0, -30, float("nan"), float("inf"), None)),
        *(dict(turn_rate=v) for v in (9, float("nan"), "left")),
        dict(speed=[1, float("nan")]),
        dict(speed=lambda t: "x"),
        dict(speed=lambda t: np.ones(3)),
        dict(step_length=0),
        dict(bounce=-1),
        dict(arm_swing=float("nan")),
        dict(lean=2),
        dict(noise=-1),
        dict(phase=float("inf")),
        dict(seed="a"),
    ],
    ids=lambda v: str(v).split(" at ")[0],
)
def test_bad_arguments(options):
    with pytest.raises(MotionLabError, match="gaits: "):
        gaits.make(**options)


def test_the_data_set():
    clips = gaits.load()
    assert len({clip.name for clip in clips}) == len(clips) == 40
    assert 180 < sum(clip.seconds for clip in clips) < 360
    assert all(clip.fps == 30 and clip.source == "gaits" for clip in clips)
    parts = [gaits.load(split) for split in ("train", "val", "test")]
    assert sum(map(len, parts)) == len(clips) and all(parts)
    for clip in clips:
        step = feet(clip).diff(dim=0).norm(dim=-1)
        assert step[clip.contacts[1:] & clip.contacts[:-1]].max() < 1e-4, clip.name
        assert clip.positions()[..., 1].min() > -0.005, clip.name
