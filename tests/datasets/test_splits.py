"""Parts of long takes. What `assign` makes of the table of clips is tested with the table."""

from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from motionlab.datasets import splits
from motionlab.errors import DataError

takes = st.tuples(
    st.floats(30.1, 1000), st.sampled_from([24, 29.97, 30, 60, 120]), st.text(max_size=5)
)


@given(takes)
def test_parts_cover_a_take_but_for_the_gaps(take):
    seconds, fps, name = take
    frames = round(seconds * fps)
    parts = splits.by_time(frames, fps, name)
    assert parts[0][0] == 0 and parts[-1][1] == frames
    gaps = [after[0] - before[1] for before, after in pairwise(parts)]
    assert all(2 * fps <= gap < 2 * fps + 1 for gap in gaps)
    assert all(before[2] != after[2] for before, after in pairwise(parts))
    assert all(stop - start > 2 * fps for start, stop, _ in parts)


@given(takes)
def test_shares(take):
    seconds, fps, name = take
    parts = splits.by_time(round(seconds * fps), fps, name)
    used = sum(stop - start for start, stop, _ in parts)
    assert used > 0.86 * seconds * fps - 10
    for split, share in zip(splits.SPLITS, (0.8, 0.1, 0.1), strict=True):
        its = sum(stop - start for start, stop, of in parts if of == split)
        assert its / used == pytest.approx(share, abs=0.02)


def test_splits_meet_every_part_of_a_recording():
    """Of ten minutes each two have something of each split."""
    parts = splits.by_time(600 * 30, 30, "long")
    for begin in range(0, 600 * 30, 120 * 30):
        inside = {of for start, stop, of in parts if start < begin + 3600 and stop > begin}
        assert inside == set(splits.SPLITS)


def test_the_order_differs_from_take_to_take():
    orders = {
        tuple(split for *_, split in splits.by_time(2000, 60, f"take {i}")) for i in range(40)
    }
    assert len(orders) == 6


def test_the_order_is_the_same_on_every_machine():
    assert splits.by_time(2400, 60, "walk") == [
        (0, 1728, "train"), (1848, 2064, "test"), (2184, 2400, "val"),
    ]  # fmt: skip


@pytest.mark.parametrize("frames", [0, 1, 899, 900])
def test_a_short_take_is_refused(frames):
    with pytest.raises(DataError, match=r"mine\.bvh: .* s are too short .*30 s"):
        splits.by_time(frames, 30, "mine.bvh")
