"""Feet locked frame after frame are those of the whole motion, as near as is known in time."""

from __future__ import annotations

import copy
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st
from other_rigs import along_bones, random_axes, redrawn, with_joints_between

from motionlab import Skeleton, contacts, load
from motionlab.datasets import gaits
from motionlab.errors import ModelError, SkeletonError
from motionlab.feet.contacts import foot_points
from motionlab.feet.lock_stream import LockStream
from motionlab.metrics import foot_skate
from motionlab.solvers import lock_feet

TOES = [1, 3]
AHEAD = 5


def sliding(seconds=4.0, speed=1.4, slide=0.15, seed=0, **more):
    """A gait whose feet slide to the left while they rest, and its exact contacts (frames, 2)."""
    motion = gaits.make(seconds=seconds, speed=speed, noise=0.5, seed=seed, **more)
    aside = slide * torch.arange(len(motion)) / motion.fps
    root = motion.root_positions + aside[:, None] * torch.tensor([1.0, 0.0, 0.0])
    return replace(motion, root_positions=root), motion.contacts[:, TOES]


def streamed(motion, down=None, pieces=(), **more):
    """The motion as a stream gives it back, which is fed pieces of so many frames, then the rest."""
    down = motion.contacts if down is None else down
    stream = LockStream(motion.skeleton, motion.fps, **more)
    sizes = [*pieces, len(motion) - sum(pieces)]
    parts = zip(
        *(x.split(sizes) for x in (motion.root_positions, motion.rotations, down)), strict=True
    )
    done = [stream.push(*part) for part in parts] + [stream.finish()]
    place, turns = (torch.cat(both) for both in zip(*done, strict=True))
    return replace(motion, root_positions=place, rotations=turns)


def toes_of(motion):
    return motion.positions()[:, [foot_points(motion.skeleton)[i] for i in TOES]]


def peak_acceleration(motion):
    points = motion.positions()
    return float((points[2:] - 2 * points[1:-1] + points[:-2]).norm(dim=-1).max() * motion.fps**2)


def millimetres(a, b):
    return 1000 * (a.positions() - b.positions()).norm(dim=-1)


@cache
def dreams():
    """Motion of the shipped network with contacts, refined: one from each start."""
    model, refiner = load("lstm-gmm-contacts"), load("refiner-contacts")
    chance = torch.Generator().manual_seed(3)
    with torch.no_grad():
        made = refiner(model.generate(300, model.starts, generator=chance, **model.sampling))
    return {
        name: model.encoding.to_motion(f) for name, f in zip(model.start_names, made, strict=True)
    }


# -- what slid holds still --------------------------------------------------------------------------


@pytest.mark.parametrize("speed", [0.8, 1.4, 2.8])
@pytest.mark.parametrize("turn_rate", [0.0, 0.6])
def test_what_slid_holds_still_and_nothing_pops(speed, turn_rate):
    motion, down = sliding(speed=speed, turn_rate=turn_rate)
    locked = streamed(motion, down)
    assert len(locked) == len(motion)
    held = down[1:] & down[:-1]
    steps = 1000 * toes_of(locked).diff(dim=0).norm(dim=-1)[held]
    assert steps.max() < 0.1
    assert peak_acceleration(locked) < 1.1 * peak_acceleration(motion)
    assert locked.positions()[..., 1].min() > -1e-3
    assert foot_skate(locked.positions(), down, locked.skeleton, locked.fps) < 0.5
    assert torch.equal(locked.root_positions[:, [0, 2]], motion.root_positions[:, [0, 2]])
    arms = [motion.skeleton.index(name) for name in ("left_upper_arm", "right_hand", "head")]
    assert torch.equal(locked.rotations[:, arms], motion.rotations[:, arms])


def test_it_is_the_offline_lock_but_for_where_places_are():
    """Places are where a slide begins, not in its middle, so feet differ by half of it at most."""
    motion, down = sliding(speed=1.4, slide=0.15)
    apart = millimetres(streamed(motion, down), lock_feet(motion, down))
    longest = max(len(run) for foot in down.T for run in "".join("01"[d] for d in foot).split("0"))
    assert apart.max() < 1000 * 0.15 * longest / motion.fps / 2 + 5
    assert apart.mean() < 10


def test_sampled_feet_slide_as_little_as_offline_and_nothing_jumps():
    walks = [name for name in dreams() if name.startswith("walk") and "run" not in name]
    for motion in (dreams()[name] for name in [*walks, "run 2.6 m/s", "turn right 90°", "stand"]):
        found, wanted = streamed(motion), lock_feet(motion)
        skates = [
            foot_skate(m.positions(), motion.contacts[:, TOES], m.skeleton, m.fps)
            for m in (found, wanted, motion)
        ]
        assert skates[0] < skates[1] + 0.05 * skates[2] + 0.2  # cm/s
        assert peak_acceleration(found) < 1.1 * peak_acceleration(motion)
        assert millimetres(found, wanted).mean() < 10


def test_a_foot_that_is_dragged_far_is_let_go_and_taken_up_again_without_a_hop():
    """What slides farther than a foot is moved goes in little steps."""
    for name in ("backwards 0.6 m/s", "sidestep left 0.5 m/s"):
        motion = dreams()[name]
        found = streamed(motion)
        moved = (toes_of(found) - toes_of(motion)).norm(dim=-1)
        assert moved.max() < 0.125
        assert peak_acceleration(found) < 1.1 * peak_acceleration(motion)
        before, after = (
            foot_skate(m.positions(), motion.contacts[:, TOES], m.skeleton, m.fps)
            for m in (motion, found)
        )
        assert after < 0.75 * before


def test_feet_keep_the_way_they_point_bones_their_length_and_knees_their_side():
    motion, down = sliding(speed=2.8)
    locked = streamed(motion, down)
    feet = [motion.skeleton.index(f"{side}_foot") for side in ("left", "right")]
    turned = locked.orientations()[:, feet].mT @ motion.orientations()[:, feet]
    assert torch.allclose(turned, torch.eye(3).expand_as(turned), atol=1e-5)
    eye = locked.rotations.mT @ locked.rotations
    assert torch.allclose(eye, torch.eye(3).expand_as(eye), atol=1e-5)
    for side in ("left", "right"):
        knee = locked.rotations[:, locked.skeleton.index(f"{side}_lower_leg")]
        pitch = torch.atan2(knee[:, 2, 1], knee[:, 1, 1])  # about x: above 0 is bent backwards up
        assert pitch.min() > -0.02


# -- what stands still stays ------------------------------------------------------------------------


@pytest.mark.parametrize("speed", [0.0, 1.4, 3.0])
def test_where_nothing_slides_nothing_moves(speed):
    still = gaits.make(seconds=4, speed=speed, noise=0.5, seed=3)
    assert millimetres(streamed(still), still).max() < 0.5


@pytest.mark.parametrize("name", ["run_3.0_stop", "walk_0.6", "go_and_halt"])
def test_where_nothing_slides_labels_by_speed_pull_no_foot_out_of_the_air(name):
    (motion,) = (clip for clip in gaits.load() if clip.name == name)
    found = contacts.label(motion)
    assert (found & ~motion.contacts)[:, TOES].any()
    locked = streamed(motion, found, floor=None)
    assert millimetres(locked, motion).max() < 20
    assert (toes_of(locked) - toes_of(motion)).norm(dim=-1).max() < 0.005
    assert peak_acceleration(locked) < 1.05 * peak_acceleration(motion)


def test_labels_that_say_nothing():
    motion, down = sliding()
    assert torch.equal(
        streamed(motion, torch.zeros_like(down), floor=None).rotations, motion.rotations
    )
    stuck = streamed(motion, torch.ones_like(down))
    moved = millimetres(stuck, motion)
    assert moved.isfinite().all() and moved.max() < 500


@settings(deadline=None, max_examples=10)
@given(seed=st.integers(0, 1000), wrong=st.sampled_from([0.05, 0.2, 0.5]))
def test_wrong_labels_give_a_worse_gait_that_stays_whole(seed, wrong):
    motion, down = sliding(seconds=2, seed=seed % 5)
    chance = torch.Generator().manual_seed(seed)
    flipped = down ^ (torch.rand(down.shape, generator=chance) < wrong)
    moved = millimetres(streamed(motion, flipped), motion)
    assert moved.isfinite().all() and moved.max() < 300


def test_gaps_are_filled_and_flickers_left_out():
    motion, down = sliding(slide=0.05)
    start = int((down[1:, 0] & ~down[:-1, 0]).nonzero()[1])
    gap, flicker = down.clone(), down.clone()
    gap[start + 9 : start + 11, 0] = False
    assert torch.equal(streamed(motion, gap).rotations, streamed(motion, down).rotations)
    aired = int((~down[1:, 0] & down[:-1, 0]).nonzero()[1]) + 5
    flicker[aired : aired + 2, 0] = True
    assert torch.equal(streamed(motion, flicker).rotations, streamed(motion, down).rotations)


# -- a stream ---------------------------------------------------------------------------------------


@settings(deadline=None, max_examples=15)
@given(pieces=st.lists(st.integers(0, 30), max_size=4), floor=st.sampled_from([0.0, None]))
def test_any_pieces_give_the_same_frames(pieces, floor):
    motion, down = sliding(seconds=4)
    whole, cut = streamed(motion, down, floor=floor), streamed(motion, down, pieces, floor=floor)
    assert torch.equal(whole.root_positions, cut.root_positions)
    assert torch.equal(whole.rotations, cut.rotations)


def test_single_frames_come_back_so_many_frames_later():
    motion, down = sliding(seconds=1)
    whole, stream = streamed(motion, down), LockStream(motion.skeleton, motion.fps)
    for t, frame in enumerate(zip(motion.root_positions, motion.rotations, down, strict=True)):
        place, turns = stream.push(*frame)
        assert len(place) == len(turns) == (t >= AHEAD)
        if t >= AHEAD:
            assert torch.equal(turns[0], whole.rotations[t - AHEAD])
    assert len(stream.finish()[0]) == AHEAD


def test_a_frame_may_be_written_over_once_it_is_pushed():
    motion, down = sliding(seconds=1)
    stream, done = LockStream(motion.skeleton, motion.fps), []
    place, turns = torch.empty(3), torch.empty_like(motion.rotations[0])
    for t in range(len(motion)):
        place.copy_(motion.root_positions[t])
        turns.copy_(motion.rotations[t])
        done.append(stream.push(place, turns, down[t])[1])
    assert torch.equal(torch.cat([*done, stream.finish()[1]]), streamed(motion, down).rotations)


def test_what_was_given_back_does_not_change_with_what_comes():
    """Frames are final: another future is another future."""
    motion, down = sliding(seconds=2)
    stream = LockStream(motion.skeleton, motion.fps)
    half = len(motion) // 2
    early = stream.push(motion.root_positions[:half], motion.rotations[:half], down[:half])
    assert torch.equal(early[1], streamed(motion, down).rotations[: half - AHEAD])


def test_a_session_goes_on_from_its_state():
    motion, down = sliding(seconds=3)
    frames = motion.root_positions, motion.rotations, down
    stream = LockStream(motion.skeleton, motion.fps)
    stream.push(*(x[:40] for x in frames))
    kept = copy.deepcopy(stream.state)
    one = stream.push(*(x[40:] for x in frames))
    other = LockStream(motion.skeleton, motion.fps, state=kept).push(*(x[40:] for x in frames))
    assert torch.equal(one[0], other[0]) and torch.equal(one[1], other[1])


@pytest.mark.parametrize("frames", [0, 1, 3, 5, 6])
def test_a_stream_that_is_shorter_than_what_is_known_ahead_gives_all_its_frames(frames):
    motion, down = sliding(seconds=1)
    short = streamed(motion[:frames], down[:frames])
    assert len(short) == frames and short.rotations.isfinite().all()


def test_a_stream_that_is_finished_begins_anew():
    motion, down = sliding(seconds=2)
    frames = motion.root_positions, motion.rotations, down
    stream = LockStream(motion.skeleton, motion.fps)
    twice = [(stream.push(*frames), stream.finish()) for _ in range(2)]
    assert torch.equal(twice[0][0][1], twice[1][0][1])
    assert torch.equal(twice[0][1][1], twice[1][1][1])


def test_more_frames_ahead_serve_a_higher_rate():
    motion, down = sliding(seconds=3, fps=60)
    locked = streamed(motion, down)
    assert LockStream(motion.skeleton, 60).ahead == 10
    held = (down[1:] & down[:-1])[:-6]  # a contact that has only begun may be a flicker
    assert toes_of(locked).diff(dim=0).norm(dim=-1)[:-6][held].max() < 1e-4


# -- other rigs -------------------------------------------------------------------------------------


@pytest.mark.parametrize("rig", ["bones along y", "any", "joints between"])
def test_rigs_are_locked_alike(rig):
    motion, down = sliding(seconds=3)
    if rig == "joints between":
        other = with_joints_between(motion, ("left_upper_leg", "right_lower_leg"))
    else:
        axes = along_bones(motion.skeleton, torch.eye(3)[1]) if rig != "any" else None
        axes = random_axes(motion.skeleton, 0) if axes is None else axes
        other = redrawn(motion, axes)
    found = streamed(other, down, example=other)
    for side in ("left", "right"):
        for part in ("lower_leg", "foot", "toes"):
            at = [
                m.positions()[:, m.skeleton.role(f"{side}_{part}")]
                for m in (found, streamed(motion, down))
            ]
            assert (at[0] - at[1]).norm(dim=-1).max() < 0.02


def test_a_rest_pose_that_does_not_stand_needs_an_example():
    motion, _ = sliding(seconds=1)
    rig = redrawn(motion, random_axes(motion.skeleton, 0)).skeleton
    with pytest.raises(SkeletonError, match="example=motion"):
        LockStream(rig, 30)
    with pytest.raises(SkeletonError, match="another skeleton"):
        LockStream(rig, 30, example=motion)


# -- bad input --------------------------------------------------------------------------------------


def test_a_frame_with_nan_is_refused_and_the_stream_goes_on_without_it():
    motion, down = sliding(seconds=2)
    frames = motion.root_positions, motion.rotations, down
    stream = LockStream(motion.skeleton, motion.fps)
    first = stream.push(*(x[:20] for x in frames))
    for broken in (0, 1):
        bad = [x[20:24].clone() for x in frames]
        bad[broken][2, 0] = torch.nan if broken else torch.inf
        with pytest.raises(ModelError, match="frame 22 of the stream"):
            stream.push(*bad)
    rest = [stream.push(*(x[20:] for x in frames)), stream.finish()]
    turns = torch.cat([first[1], *(part[1] for part in rest)])
    assert torch.equal(turns, streamed(motion, down).rotations)


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"contacts": torch.zeros(10, 3, dtype=torch.bool)}, r"shape \(10, 3\).*\(10, 2\)"),
        ({"contacts": torch.zeros(9, 2, dtype=torch.bool)}, r"shape \(9, 2\)"),
        ({"contacts": torch.zeros(10, 2)}, "float32.*must be bool"),
        ({"contacts": None}, "arrays of numbers, not object"),
        ({"rotations": torch.eye(3).expand(10, 22, 3, 3)}, r"\(10, 22, 3, 3\) are no frames"),
        ({"root_positions": torch.zeros(10, 2)}, "are no frames of this skeleton"),
        ({"root_positions": torch.zeros(8, 3)}, "are no frames of this skeleton"),
        ({"root_positions": 1.0}, "are no frames of this skeleton"),
        ({"root_positions": "here"}, "arrays of numbers, not"),
        ({"root_positions": np.full((10, 3), "x")}, "arrays of numbers, not"),
    ],
)
def test_frames_of_another_kind_are_refused(wrong, message):
    motion, down = sliding(seconds=1)
    frames = {
        "root_positions": motion.root_positions[:10],
        "rotations": motion.rotations[:10],
        "contacts": down[:10],
    }
    stream = LockStream(motion.skeleton, motion.fps)
    with pytest.raises(ModelError, match=message):
        stream.push(**frames | wrong)
    assert stream.state.frames == 0


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"fps": 0}, "fps is 0"),
        ({"fps": float("nan")}, "fps is nan"),
        ({"blend": -1}, "blend -1 s"),
        ({"floor": float("inf")}, "floor inf m"),
        ({"ahead": 1}, "ahead is 1"),
        ({"ahead": 5.5}, "ahead is 5.5"),
    ],
)
def test_settings_that_make_no_sense_are_refused(wrong, message):
    with pytest.raises(ModelError, match=message):
        LockStream(**{"skeleton": Skeleton.canonical(), "fps": 30} | wrong)


def test_own_contacts_of_both_parts_of_a_foot_are_understood():
    motion, down = sliding(seconds=2)
    four = torch.zeros(len(motion), 4, dtype=torch.bool)
    four[:, TOES] = down
    assert torch.equal(streamed(motion, four).rotations, streamed(motion, down).rotations)


def test_a_foot_without_a_toe_joint_is_held_by_its_end():
    motion, down = sliding(seconds=4)
    toes = [motion.skeleton.role(side) for side in ("left_toes", "right_toes")]
    cut = without_joints(replace(motion, contacts=None), toes)
    locked = streamed(cut, down)
    slid, slides = (1000 * toes_of(m).diff(dim=0).norm(dim=-1) for m in (cut, locked))
    held = down[1:] & down[:-1]
    assert slid[held].mean() > 3 and slides[held].max() < 0.1
    assert millimetres(locked, lock_feet(cut, down)).mean() < 10


def without_joints(motion, joints):
    """The motion on a skeleton where these joints, which carry no others, are end sites."""
    s = motion.skeleton
    keep = [joint for joint in range(s.joints) if joint not in joints]
    number = {joint: i for i, joint in enumerate(keep)} | {-1: -1}
    ends = [i for i, above in enumerate(s.end_parents) if above not in joints]
    above = [*(s.end_parents[i] for i in ends), *(s.parents[j] for j in joints)]
    skeleton = Skeleton(
        tuple(s.names[j] for j in keep),
        tuple(number[s.parents[j]] for j in keep),
        s.offsets[keep],
        tuple(number[joint] for joint in above),
        torch.cat([s.end_offsets[ends], s.offsets[joints]]),
    )
    return replace(motion, skeleton=skeleton, rotations=motion.rotations[:, keep])
