"""Moments to start from: what they are called, and that there are some whatever the clips."""

from dataclasses import replace

import pytest
import torch

from motionlab.datasets import gaits as procedural
from motionlab.errors import TrainingError
from motionlab.training.starts import Start, before_starts, candidates, changes, choose


def only(data, wanted):
    """Data with the clips of which `wanted` is true as their validation clips; others train."""
    splits = tuple("val" if wanted(name) else "train" for name in data.names)
    return replace(data, splits=splits)


def test_starts_are_named_after_what_follows(gaits):
    names = [name for name, split in zip(gaits.names, gaits.splits, strict=True)
             if split == "val"]  # fmt: skip
    found = candidates(gaits)
    assert {start.clip for start in found} == set(range(len(names)))
    for start in found:
        gait = names[start.clip].split("/")[1].split("_")[0]
        # who goes and halts walks or stands
        assert start.gait == gait or (gait == "go" and start.gait in ("walk", "stand")), start


def test_each_is_of_another_clip_if_there_is_one(gaits):
    found = choose(candidates(gaits))
    assert len({start.clip for start in found}) == min(len(found), len(gaits.clips("val")))
    assert len({start.name for start in found}) == len(found)


def test_a_single_clip_gives_several():
    found = [Start(0, 10 * i, "walk", 0, 1.0 + i / 10) for i in range(9)]
    assert {start.name for start in choose(found)} == {
        "walk 1.4 m/s",
        "walk 1.1 m/s",
        "walk 1.7 m/s",
    }


def test_frames_before_a_start_are_those_of_its_clip(gaits):
    before, names = before_starts(gaits, 30.0)
    assert before.shape == (len(names), 30, gaits.encoding.dim)
    chosen = choose(candidates(gaits)) + changes(gaits)
    assert [start.name for start in chosen] == names
    for start, seen in zip(chosen, before, strict=True):
        assert torch.equal(seen, gaits.clips("val")[start.clip][start.frame - 30 : start.frame])


def test_changes_come_last_each_once_and_where_there_are_none_none_is_missed(gaits):
    speed = lambda time: 1.2 * (time > 3) + 1.8 * (time > 7)
    clip = procedural.make(seconds=12, speed=speed, seed=1)
    clips = [clip, clip.mirror(), procedural.make(seconds=4, speed=1.2, seed=1)]
    rows = [gaits.encoding.encode(one) for one in clips]
    data = replace(
        gaits, features=torch.cat(rows), lengths=torch.tensor([len(row) for row in rows]),
        names=("x/a", "x/b", "x/c"), splits=("val",) * 3,
    )  # fmt: skip
    _, names = before_starts(data, 30.0)
    assert names[-2:] == ["stand to walk", "walk to run"] and len(set(names)) == len(names)
    assert not changes(only(data, lambda name: name == "x/c"))
    assert len(before_starts(only(data, lambda name: name == "x/c"), 30.0)[1]) > 0


@pytest.mark.parametrize(("frames", "seen"), [(12, 12), (45, 30)])
def test_clips_that_are_too_short_to_go_on_lend_their_names(gaits, frames, seen):
    clips = [clip[:frames] for clip in gaits.features.split(gaits.lengths.tolist())]
    short = replace(gaits, features=torch.cat(clips), lengths=torch.full((len(clips),), frames))
    before, names = before_starts(short, 30.0)
    wanted = [n.split("/")[1] for n, s in zip(gaits.names, gaits.splits, strict=True) if s == "val"]
    assert set(names) <= set(wanted) and len(names) == min(12, len(wanted))
    assert before.shape == (len(names), seen, gaits.encoding.dim)


def test_nothing_to_start_from(gaits):
    with pytest.raises(TrainingError, match="no validation clips"):
        before_starts(only(gaits, lambda name: False), 30.0)
