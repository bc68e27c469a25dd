"""Who makes a clip ready, this Python or a second one, is not to be seen in what comes out."""

import pytest
import torch

from motionlab import datasets
from motionlab.datasets import beside, loader
from motionlab.datasets.registry import members

CLIPS = [c.name for c in members("locomotion") if (c.source, c.split) == ("accad", "train")][:3]


@pytest.fixture
def alone_and_by_two(recorded_clips, tmp_path, monkeypatch):
    """Loads without a cache, by one Python and by two, and how many a second one was asked for."""
    asked, before = [], torch.get_num_threads()

    class Watched(beside.Second):
        def __init__(self, name, clips):
            asked.append(len(clips))
            super().__init__(name, clips)

    monkeypatch.setattr(beside, "Second", Watched)
    monkeypatch.setattr(loader, "_MANY", 0)

    def load():
        found = []
        for threads in (1, 2):
            torch.set_num_threads(threads)
            monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / str(threads)))
            found.append(datasets.load("locomotion", clips=CLIPS))
        return found, asked

    yield load
    torch.set_num_threads(before)


def same(ones, others):
    assert [one.name for one in ones] == [other.name for other in others] == CLIPS
    for one, other in zip(ones, others, strict=True):
        for what in ("root_positions", "rotations", "contacts"):
            assert torch.equal(getattr(one, what), getattr(other, what))


def test_two_make_what_one_makes(alone_and_by_two, monkeypatch):
    done = []
    ready = beside.Second.motions
    monkeypatch.setattr(beside.Second, "motions", lambda self: done.append(ready(self)) or done[-1])
    (alone, by_two), asked = alone_and_by_two()
    same(alone, by_two)
    assert [*map(len, done)] == asked == [1]


@pytest.mark.parametrize("where, what", [(beside, "_DO"), (beside.sys, "executable")])
def test_what_a_second_one_fails_at_is_done_here(alone_and_by_two, monkeypatch, where, what):
    monkeypatch.setattr(where, what, "raise SystemExit(1)")  # which is no program, either
    (alone, by_two), asked = alone_and_by_two()
    same(alone, by_two)
    assert asked == [1]
