"""Noise taken away: nearer to the truth, where the network knows the motion; and what is refused."""

from dataclasses import replace

import pytest
import roma
import torch

import motionlab
from motionlab import corrupt, datasets
from motionlab.errors import MotionError, RetargetError, SolverError
from motionlab.motion import Motion
from motionlab.skeleton import Skeleton
from motionlab.solvers import NoiseLevels, clean_recording, denoise, denoise_rig
from motionlab.solvers.denoise import Done
from motionlab.solvers.denoise_rig import _at
from motionlab.solvers.denoise_seen import (
    YAW,
    Seen,
    cross_validated,
    levels_of,
    look,
    motion_of,
    outliers_of,
    rows_of,
    smooth,
)
from motionlab.solvers.denoise_windows import Job, Settings, _share, _windows

LEVELS = NoiseLevels(0.02, 0.08)
FEW = Settings(steps=3, rounds=1)


def noisy(motion: Motion, levels: NoiseLevels, seed: int = 0) -> Motion:
    """White noise on the root's place and on every angle."""
    chance = torch.Generator().manual_seed(seed)
    normal = lambda *shape: torch.randn(*shape, generator=chance)
    turns = levels.angle_rad * normal(*motion.rotations.shape[:2], 3)
    return replace(
        motion,
        root_positions=motion.root_positions + levels.root_m * normal(len(motion), 3),
        rotations=motion.rotations @ roma.rotvec_to_rotmat(turns),
        contacts=None,
    )


def error(motion: Motion, truth: Motion) -> float:
    """Centimetres, mean over joints and frames."""
    return 100 * float((motion.positions() - truth.positions()).norm(dim=-1).mean())


@pytest.fixture(scope="module")
def clips():
    return [clip[:90] for clip in datasets.load("gaits", "val")[:2]]


@pytest.fixture(scope="module")
def model():
    return motionlab.load("lstm-gmm-contacts")


def test_a_noisy_clip_comes_back_nearer_to_what_it_was(clips, model):
    """Side by side or alone, with the noise that was put there found."""
    seen = [noisy(clip, LEVELS, i) for i, clip in enumerate(clips)]
    found = denoise(seen, model)
    for its, truth, was in zip(found, clips, seen, strict=True):
        assert len(its.motion) == len(truth)
        assert error(its.motion, truth) < 0.5 * error(was, truth)
        said = its.record["noise"]
        assert said["estimated"]
        assert said["root_m"] == pytest.approx(LEVELS.root_m, rel=0.2)
        assert said["angle_rad"] == pytest.approx(LEVELS.angle_rad, rel=0.2)
    model.leave.bias.requires_grad_(True)
    alone = denoise(seen[1], model)
    # a batch of another size rounds otherwise, and steps downhill make more of it
    assert error(alone.motion, found[1].motion) < 1.5
    assert error(alone.motion, clips[1]) < 0.5 * error(seen[1], clips[1])
    assert model.leave.bias.requires_grad  # as it was
    model.requires_grad_(False)


def test_a_clean_clip_comes_back_as_it_is(clips, model):
    found = denoise(clips[0], model)
    assert found.motion is clips[0]
    assert found.record["way"] == "unchanged" and found.record["changed (cm)"] == 0


def test_frames_that_jump_are_not_believed(clips, model):
    seen = noisy(clips[0], LEVELS)
    rotations = seen.rotations.clone()
    turns = 0.8 * torch.randn(2, 21, 3, generator=torch.Generator().manual_seed(3))
    rotations[[30, 61]] = rotations[[30, 61]] @ roma.rotvec_to_rotmat(turns)
    found = denoise(replace(seen, rotations=rotations), model, noise=LEVELS, settings=FEW)
    assert found.record["outliers"] == [30, 61]
    assert not found.record["noise"]["estimated"]


def test_what_is_missing_is_not_looked_at(clips, model):
    """Neither the whole stretch nor the knee: whatever stands there, the same comes out."""
    seen = noisy(clips[0], LEVELS)
    knee = seen.skeleton.role("left_lower_leg")
    missing = torch.zeros(90, 21, dtype=torch.bool)
    missing[40:50] = True
    missing[60:, knee] = True
    root, rotations = seen.root_positions.clone(), seen.rotations.clone()
    root[40:50], rotations[40:50] = 7.0, torch.eye(3)
    rotations[60:, knee] = torch.eye(3)
    other = replace(seen, root_positions=root, rotations=rotations)
    one, two = (denoise(each, model, missing=missing, settings=FEW) for each in (seen, other))
    assert error(one.motion, two.motion) < 0.01
    assert one.record["missing"] == pytest.approx((10 * 21 + 30) / (90 * 21))
    assert error(one.motion[40:50], clips[0][40:50]) < 15


def test_the_first_memory_may_be_sought(clips, model):
    """With it the energy is no higher than without."""
    seen = noisy(clips[0][:40], LEVELS)
    total = lambda how: sum(
        denoise(seen, model, noise=LEVELS, settings=how).record["energy"].values()
    )
    how = Settings(steps=25, rounds=1)
    assert total(replace(how, first_state=True)) < total(how) + 0.1


def test_noise_is_measured(clips, model):
    encoding = model.encoding
    for levels in (NoiseLevels(0.01, 0.04), NoiseLevels(0.04, 0.16)):
        rows = rows_of(encoding, noisy(clips[0], levels))
        found = levels_of(Seen(rows, torch.ones_like(rows).bool(), torch.zeros(90).bool()))
        assert found == pytest.approx(levels, rel=0.2)


def test_rows_are_the_motion(clips, model):
    rows = rows_of(model.encoding, clips[0])
    assert error(motion_of(model.encoding, rows), clips[0]) < 0.01


@pytest.mark.parametrize("frames", [8, 63, 64, 65, 80, 81, 200, 1000])
def test_windows_share_every_frame_out(frames):
    how = Settings()
    total = torch.zeros(frames).double()
    for window in _windows(0, frames, how):
        total[window.first : window.first + window.real] += _share(window, frames, how)
    assert torch.allclose(total, torch.ones(frames).double())


def test_another_rig_keeps_what_is_its_own(clips, model):
    """Longer bones, a finger, twice the frames: nearer to the truth, and the finger as it was."""
    body = clips[0].skeleton
    hand = body.role("left_hand")
    rig = Skeleton(
        (*body.names, "LeftIndex"), (*body.parents, hand),
        torch.cat([1.1 * body.offsets, torch.tensor([[0.08, 0.0, 0.0]])]),
    )  # fmt: skip
    turns = torch.eye(3).repeat(90, 1, 1, 1)
    truth = replace(
        clips[0], skeleton=rig, root_positions=1.1 * clips[0].root_positions,
        rotations=torch.cat([clips[0].rotations, turns], 1), contacts=None,
    ).resample(60)  # fmt: skip
    seen = noisy(truth, LEVELS)
    found = clean_recording(seen, model, settings=replace(FEW, steps=8))
    assert found.motion.fps == 60 and len(found.motion) == len(truth)
    assert found.motion.skeleton is rig
    assert torch.equal(found.motion.rotations[:, 21], seen.rotations[:, 21])
    assert error(found.motion, truth) < 0.6 * error(seen, truth)


def test_what_makes_no_sense_is_refused(clips, model):
    clip = clips[0]
    for given, words in (
        ((clip[:3],), "3 frames, too few"),
        ((clip.resample(20),), "30 frames a second"),
        ((replace(clip, root_positions=1000 * clip.root_positions),), "in metres"),
        (("walk",), "takes a Motion"),
    ):
        with pytest.raises(SolverError, match=words):
            denoise(list(given), model)
    for options, words in (
        ({"missing": torch.ones(90, 21, dtype=torch.bool)}, "all joints are missing"),
        ({"missing": torch.zeros(90, 20, dtype=torch.bool)}, "of shape"),
        ({"missing": torch.full((90,), torch.nan)}, "must be bool"),
        ({"noise": (0.02, -1)}, "two numbers above 0"),
        ({"noise": 0.1}, "two numbers above 0"),
        ({"start": clip[:20]}, "same body, rate and length"),
        ({"settings": Settings(window=20, overlap=16)}, "share half"),
        ({"settings": Settings(method="magic")}, "method is 'magic'"),
        ({"model": motionlab.load("aclstm-walking")}, "no likelihood"),
    ):
        with pytest.raises(SolverError, match=words):
            denoise(clip, **{"model": model, **options})
    with pytest.raises(SolverError, match="a list of 2"):
        denoise(clips, model, missing=[None])


def test_recordings_that_cannot_be_cleaned_are_refused(clips, model):
    clip = clips[0]
    huge = replace(clip.skeleton, offsets=1000 * clip.skeleton.offsets)
    with pytest.raises(SolverError, match="units='mm'"):
        clean_recording(replace(clip, skeleton=huge), model)
    with pytest.raises(SolverError, match="Clip 'walk_1.3' has 3 frames, too few"):
        clean_recording(clip[:3], model)
    arm = Skeleton(
        ("Hips", "Spine", "Head"), (-1, 0, 1), torch.tensor([[0, 0, 0], [0, 0.5, 0], [0, 0.4, 0]])
    )
    with pytest.raises(RetargetError, match="no joint for"):
        clean_recording(Motion(arm, clip.root_positions, clip.rotations[:, :3], 30), model)
    with pytest.raises(MotionError, match="NaN"):
        replace(clip, root_positions=clip.root_positions * torch.nan)


@pytest.mark.parametrize("clean", [denoise, clean_recording])
def test_of_a_calm_clip_only_wild_frames_are_changed(clean, clips, model):
    """A recording without noise, but for two frames in which the root is elsewhere."""
    places = clips[0].root_positions.clone()
    places[[30, 60]] += torch.tensor([0.5, 0.0, 0.3])
    wild = replace(clips[0], root_positions=places, contacts=None)
    found = clean(wild, model)
    assert found.record["outliers"] == [30, 60] and found.record["elsewhere as it was"]
    moved = (found.motion.positions() - wild.positions()).norm(dim=-1).amax(1)
    assert moved.nonzero()[:, 0].tolist() == [30, 60]
    for frame in (30, 60):
        its = slice(frame, frame + 1)
        assert error(found.motion[its], clips[0][its]) < 3 < error(wild[its], clips[0][its])


def lively(frames: int = 120) -> Motion:
    """Somebody who kicks and waves at 3 Hz, runs, and turns round and round."""
    time = torch.arange(frames) / 30
    running = datasets.gaits.make(seconds=frames / 30, speed=3.5, seed=1)[:frames]
    turns = torch.zeros(frames, 21, 3)
    names = running.skeleton.names
    swing = torch.sin(2 * torch.pi * 3 * time) * torch.exp(-(((time - 2) / 0.5) ** 2))
    turns[:, names.index("RightUpperLeg"), 0] = -0.9 * swing
    turns[:, names.index("LeftUpperArm"), 2] = 0.9 * torch.sin(2 * torch.pi * 3 * time)
    turns[:, 0, 1] = 4 * time
    rotations = running.rotations @ roma.rotvec_to_rotmat(turns)
    return replace(running, rotations=rotations, contacts=None)


@pytest.mark.parametrize("level", [(0.0, 0.0), (0.005, 0.02), (0.02, 0.08)])
def test_outliers_are_the_frames_that_were_made_wrong(level, clips, model):
    """Of every hundred all but ten at most are found, and of fast motion one at most is taken for one."""
    planted = found = innocent = doubted = 0
    for seed, clip in enumerate([*clips, lively(), datasets.gaits.make(seconds=4, speed=4.0)]):
        chance = torch.Generator().manual_seed(seed)
        seen = corrupt.tremble(clip, *level, generator=chance)
        for share in (0.0, 0.01, 0.05):
            wrong = torch.zeros(len(clip), dtype=torch.bool)
            wild = seen
            if share:
                wild, wrong = corrupt.outliers(seen, share, generator=chance)
            joints = torch.ones(len(clip), 21, dtype=torch.bool)
            outliers = look(rows_of(model.encoding, wild), joints)[0].outliers
            planted, found = planted + int(wrong.sum()), found + int((outliers & wrong).sum())
            innocent += int((~wrong).sum())
            doubted += int((outliers & ~wrong).sum())
    assert found >= 0.9 * planted > 0
    assert doubted <= 0.01 * innocent


def test_wild_frames_side_by_side_are_found_and_are_no_noise(clips, model):
    """Two on end, and an arm alone; how much the others tremble is told rightly all the same."""
    seen = noisy(clips[0], LEVELS)
    arm = [seen.skeleton.role(f"left_{part}") for part in ("upper_arm", "lower_arm", "hand")]
    turns = torch.zeros(90, 21, 3)
    turns[[40, 41]] = torch.randn(2, 21, 3, generator=torch.Generator().manual_seed(0))
    turns[70, arm] = torch.tensor([1.5, 0.5, -1.0])
    wild = replace(seen, rotations=seen.rotations @ roma.rotvec_to_rotmat(turns))
    joints = torch.ones(90, 21, dtype=torch.bool)
    its, levels = look(rows_of(model.encoding, wild), joints)
    assert its.outliers.nonzero()[:, 0].tolist() == [40, 41, 70]
    assert levels == pytest.approx(LEVELS, rel=0.2)
    assert not outliers_of(look(rows_of(model.encoding, seen), joints)[0], LEVELS).any()


@pytest.mark.parametrize("hertz", [0.5, 4.0])
def test_a_line_by_cross_validation_is_as_free_as_the_clip(hertz):
    """Who is slow is smoothed as by the line that is set for walks; who is fast, much less."""
    time = torch.arange(120).double() / 30
    truth = torch.sin(2 * torch.pi * hertz * time)[:, None] * torch.linspace(0.2, 1, 12).double()
    generator = torch.Generator().manual_seed(0)
    level = NoiseLevels(0.02, 0.08)
    scale = torch.tensor([level.root_m] * 3 + [level.angle_rad] * 9).double()
    rows = truth + scale * torch.randn(truth.shape, generator=generator).double()
    mask = torch.ones_like(rows).bool()
    mask[40:43] = False
    seen = Seen(torch.where(mask, rows, 1e6), mask, torch.zeros(120).bool())
    free, set_for_walks = (way(seen, level) for way in (cross_validated, smooth))
    off = lambda line: float((line - truth).square().mean().sqrt())
    assert off(free) < (1.1 if hertz < 1 else 0.7) * off(set_for_walks)


def test_motion_that_the_network_does_not_know_is_only_smoothed(clips, model):
    """A walk on hands: nobody learned that, and what comes back is the filter's answer."""
    upside = roma.rotvec_to_rotmat(torch.tensor([3.0, 0.0, 0.0]))
    rotations = clips[0].rotations.clone()
    rotations[:, 0] = rotations[:, 0] @ upside
    seen = noisy(replace(clips[0], rotations=rotations, contacts=None), LEVELS)
    found = denoise(seen, model)
    assert found.record["way"] == "filter"
    assert found.record["likelihood"] < found.record["least"]
    rows = rows_of(model.encoding, seen)
    whole = Seen(rows, torch.ones_like(rows).bool(), torch.zeros(90).bool())
    noise = NoiseLevels(*list(found.record["noise"].values())[:2])
    if not found.record["outliers"]:
        line = motion_of(model.encoding, cross_validated(whole, noise))
        assert error(found.motion, line) < 0.01
    known = denoise(noisy(clips[0], LEVELS), model)
    assert known.record["way"] == "map"


@pytest.mark.parametrize("times", [1, 2, 3, 4])
def test_means_of_frames_lag_nowhere_and_their_noise_is_told(times):
    """Who walks on straight is where he was, at every rate; white noise is left as is said."""
    frames = 4000
    own = torch.arange(frames).double() / (30 * times)
    known = torch.arange(int(own[-1] * 30 + 1e-6) + 1).double() / 30
    rows = own[:, None] * torch.ones(9).double()
    mask = torch.ones(frames, 9, dtype=torch.bool)
    seen = Seen(rows, mask, torch.zeros(frames, dtype=torch.bool))
    few, levels = _at(own, known, seen, NoiseLevels(1.0, 1.0), times)
    assert torch.allclose(few.rows[2:-2], known[2:-2, None].expand(-1, 9), atol=1e-9)
    chance = torch.Generator().manual_seed(0)
    noise = torch.randn(frames, 9, generator=chance).double()
    few, _ = _at(own, known, replace(seen, rows=noise), NoiseLevels(1.0, 1.0), times)
    assert float(few.rows.std()) == pytest.approx(levels.root_m, rel=0.05)


def test_drift_of_what_the_network_found_is_taken_away_and_its_motion_left(
    clips, model, monkeypatch
):
    """A few rounds of descent leave slow errors of place and heading, and habits; both are in plain sight."""
    truth = rows_of(model.encoding, clips[0])
    time = torch.arange(len(truth)).double() / 30
    drift = torch.zeros_like(truth)
    drift[:, :3], drift[:, YAW], drift[:, 6:] = 0.03 * time[:, None], 0.05 * time, 0.1
    quick = 0.02 * (2 * torch.pi * 5 * time).sin()[:, None]
    found = Done(truth + drift + quick, "map", 60.0, 50.0, None)
    monkeypatch.setattr(denoise_rig, "clean_jobs", lambda *_, **__: [found])
    there = torch.ones(truth.shape, dtype=torch.bool)
    seen = Seen(truth, there, torch.zeros(len(truth), dtype=torch.bool))
    job = Job(seen, LEVELS, truth, truth)
    left = denoise_rig._solved(model, job, Settings(), True, False).rows - truth
    assert (left - quick).abs().max() < 0.1 * drift.abs().max()
    # where nothing was seen, nothing says that it drifts
    seen.mask[:, 6:] = False
    left = denoise_rig._solved(model, job, Settings(), True, False).rows - truth
    assert torch.allclose(left[:, 6:], (drift + quick)[:, 6:])
