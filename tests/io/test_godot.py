"""Godot's animations: every track comes back; what is no such file, or a broken one, is refused."""

import struct

import numpy as np
import pytest
from godot_file import animation
from hypothesis import given
from hypothesis import strategies as st

from motionlab.errors import GodotError
from motionlab.io.godot import parse_animation

TRACKS = {
    ("Root", "position_3d"): np.array([[0, 1, 2, 3], [0.5, 4, 5, 6]]),
    ("Root", "rotation_3d"): np.array([[0, 0, 0, 0, 1], [0.25, 0, 1, 0, 0], [1, 0, 0, 1, 0]]),
    ("Hips", "scale_3d"): np.array([[0, 1, 1, 1]]),
    ("Jaw", "rotation_3d"): np.zeros((0, 5)),
}
WHOLE = animation(TRACKS)


def test_tracks_come_back():
    found = parse_animation(WHOLE, "made.res")
    assert list(found) == list(TRACKS)[:3]  # one has no keys
    for track, keys in found.items():
        np.testing.assert_array_equal(keys, TRACKS[track])


@given(st.integers(0, len(WHOLE) - 5))
def test_a_file_that_is_cut_off(size):
    with pytest.raises(GodotError, match=r"cut\.res: "):
        parse_animation(WHOLE[:size], "cut.res")


@given(st.integers(4, len(WHOLE) - 1), st.binary(min_size=1, max_size=4))
def test_a_damaged_file_is_read_or_refused(at, rubbish):
    try:
        parse_animation(WHOLE[:at] + rubbish + WHOLE[at + len(rubbish) :], "damaged.res")
    except GodotError as error:
        assert str(error).startswith("damaged.res: ")


@pytest.mark.parametrize(
    ("data", "says"),
    [
        (b"", "does not begin with RSRC"),
        (b"HIERARCHY\nROOT Hips", "does not begin with RSRC"),
        (b"RSCC" + WHOLE[4:], "without compression"),
        (b"RSRC" + struct.pack("<I", 1) + WHOLE[8:], "big endian"),
        (animation(TRACKS, other_files=1), "other files"),
        (animation({("Hips", "position_3d"): np.array([[0, 1, 1, np.nan]])}), "tracks/0 are dam"),
        (animation({("Hips", "position_3d"): np.zeros((2, 4))}), "tracks/0 are damaged"),
        (animation({("Hips", "rotation_3d"): np.zeros((1, 5))}), "tracks/0 are damaged"),
        (animation({("Hips", "rotation_3d"): np.ones((1, 4))}), "tracks/0 are damaged"),
    ],
)
def test_what_is_no_animation_is_refused(data, says):
    with pytest.raises(GodotError, match=rf"bad\.res: .*{says}"):
        parse_animation(data, "bad.res")
