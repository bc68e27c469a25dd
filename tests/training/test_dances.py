"""Windows of dances, and what acLSTM's presets ask of a loss."""

import math
from dataclasses import replace

import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st

from motionlab import datasets
from motionlab.encodings import Normalizer, RootRelative
from motionlab.errors import ModelError, TrainingError
from motionlab.models import AcLstm
from motionlab.models.erd import noise_schedule
from motionlab.training import PRESETS, Prepared, build, dances, loop, prepare
from motionlab.training.checkpoints import load_weights
from motionlab.training.dances import DanceWindows, teacher_share, turned, without_rest

SMOKE = PRESETS["aclstm-indian"]["smoke"]


@pytest.fixture(scope="module")
def motions():
    return [m.resample(60) for m in datasets.load("gaits")[:6]]


@pytest.fixture(scope="module")
def encoding(motions):
    return RootRelative(motions[0].skeleton, 60.0)


@pytest.fixture(scope="module")
def data(motions, encoding):
    clips = [encoding.encode(m) for m in motions]
    splits = ("train",) * 4 + ("val", "test")
    lengths = torch.tensor([len(c) for c in clips])
    return Prepared(torch.cat(clips), lengths, tuple(m.name for m in motions), splits, encoding,
                    Normalizer.fit(clips[:4]), "gaits at 60")  # fmt: skip


def test_a_window_at_half_the_rate_is_the_motion_at_half_the_rate(motions, encoding):
    slow = RootRelative(encoding.skeleton, 30.0)
    odd = motions[0][1:].resample(30)
    clip, wanted = encoding.encode(motions[0]), slow.encode(odd)
    windows = DanceWindows([clip], 20, stride=2, tempo=0.0, turn=False)
    place = 11 / (len(clip) - 1 - 40)  # from frame 11 on, which the odd one knows as its fifth
    window = windows._cut(windows.clips[0], place, 1.0)
    torch.testing.assert_close(window, wanted[6:26], atol=1e-5, rtol=0)


def test_faster_windows_cover_more_ground(motions, encoding):
    walk = next(m for m in motions if "stand" not in m.name)
    windows = DanceWindows([encoding.encode(walk)], 30, stride=2, tempo=0.2, turn=False)
    slow = RootRelative(encoding.skeleton, 30.0)
    gone = lambda tempo: (
        slow.positions(windows._cut(windows.clips[0], 0.3, tempo))[[0, -1], 0].diff(dim=0).norm()
    )
    assert gone(1.2) / gone(0.8) == pytest.approx(1.5, rel=0.05)


@given(yaw=st.floats(-7, 7))
def test_turned_features_are_those_of_the_turned_motion(motions, encoding, yaw):
    motion = motions[1][:10]
    features = turned(encoding.encode(motion), torch.tensor(yaw))
    points = encoding.positions(features)
    rotated = encoding.positions(encoding.encode(motion), (0.0, 0.0, yaw))
    torch.testing.assert_close(points, rotated, atol=1e-4, rtol=0)


def test_drawn_windows_depend_on_the_generator_alone(data):
    windows = SMOKE.windows(data, "train")
    first, again, other = (
        windows.draw(5, torch.Generator().manual_seed(seed)) for seed in (1, 1, 2)
    )
    assert first.shape == (5, SMOKE.frames, data.encoding.dim)
    assert torch.equal(first, again) and not torch.equal(first, other)


def test_every_clip_is_as_likely_however_long(encoding):
    clips = [torch.full((length, encoding.dim), float(i)) for i, length in enumerate([50, 500])]
    drawn = DanceWindows(clips, 10, 2, 0.0, False).draw(400, torch.Generator().manual_seed(0))
    assert 150 < drawn[:, 0, 5].sum() < 250


def test_tiles_cover_clips_and_are_neither_turned_nor_hurried(data):
    windows = SMOKE.windows(data, "val")
    assert not windows.turn and windows.tempo == 0
    tiles = torch.cat(windows.tiles(4))
    clip = data.clips("val")[0]
    assert len(tiles) == len(clip) // 40
    torch.testing.assert_close(tiles[-1, -1, 3:], clip[-1, 3:], atol=1e-4, rtol=0)


def test_x_and_z_are_normalised_alike(data):
    normalizer = build(data, SMOKE).normalizer
    x, _, z = normalizer.std.unflatten(0, (-1, 3)).unbind(1)
    torch.testing.assert_close(x, z)
    assert not build(data, replace(SMOKE, metres=True)).normalizer.mean.any()
    assert build(data, SMOKE).fps == 30 and build(data, replace(SMOKE, fps=60.0)).fps == 60


def test_masks_of_the_three_ways_to_train():
    shape, chance = torch.Size([40, 50, 3]), lambda: torch.Generator().manual_seed(0)
    assert replace(SMOKE, feeding="teacher").extras(shape, 0, chance()) == {}
    auto = replace(SMOKE, real=2, fed=3).extras(shape, 7, chance())["real"]
    assert auto[0].tolist() == [i % 5 < 2 for i in range(50)] and (auto == auto[0]).all()
    scheduled = replace(SMOKE, feeding="scheduled", schedule=40)
    for update in (0, 20, 40, 60):
        share = teacher_share(min(1, update / 40))
        real = scheduled.extras(shape, update, chance())["real"]
        wanted = torch.rand(40, 50, generator=chance()) < share
        assert real[:, 0].all() and torch.equal(real[:, 1:], wanted[:, 1:])
        assert real.float().mean().item() == pytest.approx(share, abs=0.05)
    assert scheduled.judged(shape) == {}


def test_an_encoder_and_decoder_get_ever_more_noise_on_half_their_frames():
    erd, shape = replace(SMOKE, method="erd", feeding="teacher", schedule=100), (40, 50, 3)
    for update, std in [(0, 0.0), (100, noise_schedule(1.0)), (500, 0.7)]:
        noise = erd.extras(torch.Size(shape), update, torch.Generator().manual_seed(0))["noise"]
        hit = (noise != 0).any(-1)
        if std:
            assert hit.float().mean().item() == pytest.approx(0.5, abs=0.05)
            assert noise[hit].std().item() == pytest.approx(std, rel=0.05)
        else:
            assert not hit.any()
    assert erd.judged(torch.Size(shape)) == {}


def test_networks_to_be_compared_have_about_as_many_parameters(data):
    counts = [
        sum(p.numel() for p in build(data, its["table"]).parameters())
        for its in dances.METHODS.values()
    ]
    assert max(counts) < 1.2 * min(counts)


def test_the_share_of_recorded_frames_falls_from_all_to_none():
    shares = [teacher_share(i / 10) for i in range(11)]
    assert shares == sorted(shares, reverse=True)
    assert shares[0] > 0.99 and shares[5] == pytest.approx(0.5) and shares[10] < 0.01


def test_rest_at_both_ends_is_cut_off(encoding):
    pose = torch.randn(1, encoding.dim, generator=torch.Generator().manual_seed(0))
    moving = pose + 0.3 * torch.arange(120)[:, None].mul(0.4).sin()
    clip = torch.cat([pose.expand(90, -1), moving, moving[-1:].expand(60, -1)])
    kept = without_rest(clip, 60.0)
    assert 120 <= len(kept) <= 180
    assert torch.equal(kept.amax(0), clip.amax(0)) and torch.equal(kept.amin(0), clip.amin(0))
    assert without_rest(pose.expand(90, -1), 60.0).shape == (90, encoding.dim)  # nothing moves
    assert len(without_rest(clip[:5], 60.0)) == 5


@pytest.mark.parametrize("method", dances.METHODS)
def test_every_method_trains_and_goes_on(data, method, tmp_path):
    preset = replace(PRESETS[f"{method}-indian"]["smoke"], updates=6, validate_every=2, snapshots=4)
    run = lambda folder, updates: loop.train(
        build(data, preset), data, replace(preset, updates=updates), folder,
        name=f"{method}-indian", accelerator="cpu",
    )  # fmt: skip
    curve = run(tmp_path / "whole", 6)
    run(tmp_path / "broken", 2)
    again = run(tmp_path / "broken", 6)
    assert [point["val"] for point in again] == [point["val"] for point in curve]
    assert (tmp_path / "whole" / "at-4.safetensors").exists()
    assert load_weights(tmp_path / "whole" / "last.safetensors")[1]["update"] == 6
    assert not (tmp_path / "whole" / "best.safetensors").exists()
    assert not (tmp_path / "whole" / "at-6.safetensors").exists()


def test_ordinary_names_and_presets():
    assert {name.rpartition("-")[2] for name in dances.PRESETS} == {
        "martial", "indian", "hybrid", "walking"
    }  # fmt: skip
    paper = PRESETS["aclstm-martial"]["paper"]
    assert (paper.updates, paper.frames, paper.width, paper.learning_rate) == (
        500_000, 100, 1024, 1e-4
    )  # fmt: skip
    assert isinstance(paper.model, type(SMOKE.model)) and paper.real == paper.fed == 5


def test_what_can_not_be_trained(data, encoding):
    with pytest.raises(TrainingError, match="never upsampled"):
        replace(SMOKE, fps=120.0).windows(data, "train")
    with pytest.raises(TrainingError, match="shorter than a window"):
        replace(SMOKE, frames=10_000).windows(data, "train")
    with pytest.raises(TrainingError, match="RootRelative"):
        other = replace(data, encoding=RootRelative(encoding.skeleton, 60.0, height="difference"))
        SMOKE.windows(other, "train")
    for wrong in (
        {"feeding": "none"},
        {"method": "gru"},
        {"schedule": 0},
        {"fps": 0.0},
        {"tempo": 1.0},
        {"fps": math.nan},
    ):
        with pytest.raises(TrainingError, match=next(iter(wrong))):
            replace(SMOKE, **wrong)
    with pytest.raises(ModelError, match="u must"):
        replace(SMOKE, real=0)
    with pytest.raises(TrainingError, match="validate_every"):
        replace(SMOKE, snapshots=7)


def test_the_dances_are_there(real_clips):
    for style, count in {"martial": 8, "indian": 7, "hybrid": 35}.items():
        data = prepare(style)
        halves = [name for name in data.names if name.endswith("/2")]
        names = {name.rpartition("_")[0] if name in halves else name for name in data.names}
        assert len(names) == count
        assert data.encoding.dim == 171 and data.encoding.fps == 60
        assert {"train", "val", "test"} == set(data.splits)
        # halves of a clip are never on two sides
        sides = {(n.rpartition("_")[0] if n in halves else n, s)
                 for n, s in zip(data.names, data.splits, strict=True)}  # fmt: skip
        assert len(sides) == count
        model = build(data, SMOKE)
        assert isinstance(model, AcLstm) and model.kept > 150
