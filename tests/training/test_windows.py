"""Windows against a plain search for them."""

import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st

from motionlab.errors import TrainingError
from motionlab.training.windows import Windows


def numbered(lengths):
    """Clips whose rows tell clip and frame."""
    return [
        torch.stack([torch.full((n,), float(i)), torch.arange(float(n))], dim=1)
        for i, n in enumerate(lengths)
    ]


@given(st.lists(st.integers(1, 30), min_size=1, max_size=6), st.integers(1, 12))
def test_windows_are_those_within_clips(lengths, frames):
    clips = numbered(lengths)
    if max(lengths) < frames:
        with pytest.raises(TrainingError, match=f"window of {frames} frames"):
            Windows(clips, frames)
        return
    windows = Windows(clips, frames)
    drawn = windows.draw(500, torch.Generator().manual_seed(0))
    found = {(int(w[0, 0]), int(w[0, 1])) for w in drawn}
    expected = {(i, s) for i, n in enumerate(lengths) for s in range(n - frames + 1)}
    assert found <= expected and len(found) > 0.5 * min(len(expected), 20)
    steps = drawn.diff(dim=1)
    assert (steps[..., 0] == 0).all() and (steps[..., 1] == 1).all()
    # tiles: every frame of every clip that is long enough, with no window more than needed
    tiles = torch.cat(windows.tiles(3))
    covered = {(int(c), int(t)) for c, t in tiles.reshape(-1, 2)}
    assert covered == {(i, t) for i, n in enumerate(lengths) if n >= frames for t in range(n)}
    assert len(tiles) == sum(-(-n // frames) for n in lengths if n >= frames)


def test_draws_are_even():
    windows = Windows(numbered([5, 9]), 4)  # 2 and 6 windows
    drawn = windows.draw(8000, torch.Generator().manual_seed(0))
    counts = torch.bincount((10 * drawn[:, 0, 0] + drawn[:, 0, 1]).long(), minlength=20)
    assert counts[counts > 0].tolist() == pytest.approx([1000] * 8, abs=150)


def test_some_frames_are_drawn_more_often():
    clips = numbered([5, 9, 30])
    often = [torch.arange(len(clip)) >= 20 for clip in clips]  # windows of 4 from 19 on: 8 of 35
    windows = Windows(clips, 4, often, share=0.25)
    generator = torch.Generator().manual_seed(0)
    for _ in range(20):
        assert int((windows.draw(8, generator)[:, 0, 1] >= 19).sum()) == 2
    drawn = windows.draw(8000, generator)
    counts = torch.bincount((40 * drawn[:, 0, 0] + drawn[:, 0, 1]).long())
    assert counts[80 + 19 :].tolist() == pytest.approx([2000 / 8] * 8, abs=75)
    assert counts[: 80 + 19][counts[: 80 + 19] > 0].tolist() == pytest.approx(
        [6000 / 27] * 27, abs=75
    )
    for none in (None, [torch.zeros(len(clip)) > 0 for clip in clips]):
        plain = Windows(clips, 4, none, share=0.25).draw(8, torch.Generator().manual_seed(1))
        assert plain.equal(Windows(clips, 4).draw(8, torch.Generator().manual_seed(1)))
    alone = Windows(clips, 4, [torch.ones(len(clip)) > 0 for clip in clips], share=0.25)
    assert len(alone.draw(8, generator)) == 8


def test_no_clips():
    with pytest.raises(TrainingError, match="All 0 clips"):
        Windows([], 8)
