"""Channels that are missing, several bodies, frame times that are none, counts that are wrong."""

from __future__ import annotations

import re
from collections import defaultdict
from decimal import ROUND_DOWN, ROUND_HALF_EVEN, ROUND_HALF_UP, Decimal
from types import SimpleNamespace

import bvh_corpus as corpus
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from motionlab import Motion, read_bvh, write_bvh
from motionlab.errors import BvhError
from motionlab.io.bvh import parse_bvh
from motionlab.io.bvh_rate import rate_of


def parse(text: str, **reading) -> Motion:
    return parse_bvh(text.encode(), "clip.bvh", **reading)


# -- channels -------------------------------------------------------------------------------------


@settings(max_examples=60, deadline=None)
@given(dropped=st.sets(st.integers(0, 14), max_size=14))
def test_a_missing_channel_is_zero_and_a_missing_position_the_offset(dropped):
    less, zero = corpus.without(dropped)
    torch.testing.assert_close(parse(less).positions(), parse(zero).positions())
    assert parse(less).skeleton.names == parse(zero).skeleton.names


def test_a_joint_without_channels_can_be_written(tmp_path):
    less, _ = corpus.without(set(range(6, 9)))
    motion = parse(less)
    assert "CHANNELS 0" in less and torch.equal(
        motion.rotations[:, 1], torch.eye(3).expand(3, 3, 3)
    )
    write_bvh(motion, tmp_path / "clip.bvh")
    again = read_bvh(tmp_path / "clip.bvh")
    torch.testing.assert_close(again.positions(), motion.positions(), rtol=0, atol=1e-5)


STILL = """HIERARCHY
ROOT Hips
{
  OFFSET 1.0 90.0 2.0
  JOINT Chest
  {
    OFFSET 0.0 20.0 1.0
    JOINT Head
    {
      OFFSET 0.0 30.0 0.0
      End Site
      {
        OFFSET 0.0 15.0 0.0
      }
    }
  }
}
MOTION
Frames: 3
Frame Time: 0.0333333
"""


@pytest.mark.parametrize("said", ["", "CHANNELS 0\n"])
@pytest.mark.parametrize("moving", ["", "Hips", "Chest", "Head"])
def test_a_joint_without_channels_stands_still_at_its_offset(said, moving):
    """bvhio writes channels for what moves alone; others leave the line out."""
    text = re.sub(r"( OFFSET.*\n)(?! *})", rf"\1{said}", STILL)
    if moving:
        text = re.sub(
            rf"({moving}\n *{{\n *OFFSET.*\n)(CHANNELS 0\n)?", r"\1CHANNELS 1 Zrotation\n", text
        )
    motion = parse(text + ("90\n" * 3 if moving else "\n" * 3), up="y")
    assert motion.skeleton.names == ("Hips", "Chest", "Head") and len(motion) == 3
    offsets = torch.tensor([[1, 90, 2], [0, 20, 1], [0, 30, 0]]) / 100
    torch.testing.assert_close(motion.skeleton.offsets, offsets)
    assert motion.root_positions[2].tolist() == pytest.approx([0.01, 0.9, 0.02])
    turned = [not torch.equal(turn, torch.eye(3)) for turn in motion.rotations[1]]
    assert turned == [name == moving for name in motion.skeleton.names]


def test_a_root_of_positions_alone_does_not_turn():
    """As bvhio writes one that walks straight ahead."""
    text = STILL.replace("90.0 2.0\n", "90.0 2.0\n  CHANNELS 3 Xposition Yposition Zposition\n")
    motion = parse(text + "0 90 0\n0 90 1\n0 91 0\n", up="y")
    assert torch.equal(motion.rotations, torch.eye(3).expand(3, 3, 3, 3))
    expected = torch.tensor([[0, 90, 0], [0, 90, 1], [0, 91, 0]]) / 100
    torch.testing.assert_close(motion.root_positions, expected)


def test_of_a_body_that_stands_still_no_more_frames_are_made_than_the_file_has_lines():
    with pytest.raises(BvhError, match="no joint has a channel"):
        parse(STILL.replace("Frames: 3", "Frames: 999999999") + "\n" * 3)


def test_a_missing_position_of_an_inner_joint_is_its_offset():
    text = corpus.six_channels([(7, 20, 8)] * 3).replace(
        "CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation\n    JOINT LeftArm",
        "CHANNELS 4 Yposition Zrotation Xrotation Yrotation\n    JOINT LeftArm",
    )
    text = text.replace(" 7.000000 20.000000 8.000000", " 20.000000")
    torch.testing.assert_close(parse(text).positions(), parse(corpus.PLAIN).positions())


def test_scale_is_left_out_and_told():
    text = corpus.spellings()["scale"].replace(" 1.0 1.0004", " 1.25 1.0004", 1)
    with pytest.warns(UserWarning, match=r"clip\.bvh: joint 'Hips' is scaled, by 1\.25") as caught:
        motion = parse(text)
    assert len(caught) == 1
    torch.testing.assert_close(motion.positions(), parse(corpus.PLAIN).positions())


# -- several bodies -------------------------------------------------------------------------------


def two_bodies() -> str:
    """PLAIN beside a copy that is called B, with the same joints below, a metre to the left."""
    head, rows = corpus.PLAIN[: corpus.ROWS], corpus.PLAIN[corpus.ROWS :].splitlines()
    body, rest = head.removeprefix("HIERARCHY\n").split("MOTION")
    both = [f"{row} {float(row.split()[0]) + 100} {row.split(maxsplit=1)[1]}" for row in rows]
    return f"HIERARCHY\n{body}{body.replace('Hips', 'B')}MOTION{rest}" + "\n".join(both)


def test_of_two_bodies_one_is_chosen():
    text, plain = two_bodies(), parse(corpus.PLAIN)
    with pytest.raises(BvhError, match=r"line 30: .*2 bodies.*: Hips, B; .*root='Hips'"):
        parse(text)
    with pytest.raises(BvhError, match="no ROOT 'Chest'; root= must be one of: Hips, B"):
        parse(text, root="Chest")
    assert torch.equal(parse(text, root="Hips").positions(), plain.positions())
    other = parse(text, root="B")
    assert other.skeleton.names == ("B", "Chest", "LeftArm", "RightArm")
    shift = other.positions() - plain.positions()
    torch.testing.assert_close(shift, torch.tensor([1.0, 0, 0]).expand_as(shift))


def test_root_of_a_file_with_one_body():
    assert parse(corpus.PLAIN, root="Hips").skeleton.names[0] == "Hips"
    with pytest.raises(BvhError, match="no ROOT 'pelvis'; root= must be one of: Hips"):
        parse(corpus.PLAIN, root="pelvis")


# -- frame time -----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "written, remedy",
    [
        ("30", "a rate; .*fps=30."),
        ("60.0", "a rate; .*fps=60."),
        ("29.97", "a rate; .*fps=29.97."),
        ("120", "a rate; .*fps=120."),
        ("33.333", "milliseconds; .*fps=30."),
        ("16.6667", "milliseconds; .*fps=60."),
        ("41.7 ", "milliseconds; .*fps=24."),
        ("8.33333", "milliseconds; .*fps=120."),
        ("20", "a rate or milliseconds; .*fps=20 or fps=50."),
        ("33333", "microseconds; .*fps=30."),
        ("1000000", "fps=."),
        ("0", "fps=."),
        ("-0.0333", "fps=."),
    ],
)
def test_what_is_no_time_between_two_frames_is_told(written, remedy):
    text = corpus.PLAIN.replace("0.0333333", written)
    with pytest.raises(BvhError, match=rf"line 32: the frame time is .*{remedy}$"):
        parse(text)
    assert parse(text, fps=30).fps == 30  # without a warning


def written(rate: int, decimals: int, rounding: str) -> str:
    return str((Decimal(1) / rate).quantize(Decimal(1).scaleb(-decimals), rounding))


def test_every_whole_rate_that_a_rounded_time_can_mean_is_read_and_no_other():
    """Of all headers with four to seven decimals, rounded or cut off."""
    times = defaultdict(set)
    for rate in range(20, 481):
        for decimals in range(4, 8):
            for rounding in (ROUND_DOWN, ROUND_HALF_EVEN, ROUND_HALF_UP):
                times[written(rate, decimals, rounding)].add(rate)
    unclear = {time for time, rates in times.items() if len(rates) > 1}
    for time, rates in times.items():
        fps, doubt = rate_of(SimpleNamespace(time=(7, time), fail=pytest.fail))
        exact = 1 / float(time)
        if time not in unclear:
            assert ({fps}, doubt) == (rates, None), time
        elif exact in rates:  # the file may mean what it says
            assert (fps, doubt) == (exact, None), time
        else:
            assert fps == pytest.approx(exact, abs=1e-6), time
            assert f"a frame time of {time} s is that of {min(rates)} to {max(rates)} " in doubt
    assert {len(time) for time in unclear} == {6, 7}  # with six decimals all is clear


@pytest.mark.parametrize(
    "time, fps",
    [
        ("0.004166", 240),
        ("0.016666", 60),
        ("0.008333", 120),
        ("4.1667e-3", 240),
        ("16.66 ms", 60),
        ("0.0333", 30),
        ("0.0334", 29.97003),
        ("0.0333667", 29.97003),
        ("0.041708", 23.976024),
        ("0.033334", 30),
        ("0.0333333351", 30),
        ("0.016", 62.5),
    ],
)
def test_rates_that_are_meant(time, fps):
    assert parse(corpus.PLAIN.replace("0.0333333", time)).fps == fps


def test_of_two_rates_neither_is_taken():
    with pytest.warns(
        UserWarning, match=r"line 32: .* 120 to 121 frames .*read as 120\.482:.* fps=120\."
    ):
        assert parse(corpus.PLAIN.replace("0.0333333", "0.0083")).fps == pytest.approx(
            120.482, abs=1e-3
        )


@pytest.mark.parametrize("written, fps", [("1", 1), ("0.5", 2), ("0.2", 5), ("0.001", 1000)])
def test_slow_and_fast_rates_are_read(written, fps):
    assert parse(corpus.PLAIN.replace("0.0333333", written)).fps == fps


@pytest.mark.parametrize("written, fps", [("4 s", 0.25), ("0.0005", 2000)])
def test_very_slow_and_fast_rates_are_told(written, fps):
    with pytest.warns(UserWarning, match=rf"line 32: .* is {fps:g} frames per second.*fps="):
        assert parse(corpus.PLAIN.replace("0.0333333", written)).fps == fps


def test_milliseconds_below_five_are_told_by_their_rate():
    with pytest.warns(UserWarning, match="milliseconds; .*fps=240"):
        parse(corpus.PLAIN.replace("0.0333333", "4.16667"))


# -- frame count ----------------------------------------------------------------------------------


@pytest.mark.parametrize("declared", [0, 1, 2, 4, 3000, 999999999])
def test_the_rows_that_are_there_are_read(declared):
    text = corpus.PLAIN.replace("Frames: 3", f"Frames: {declared}")
    with pytest.warns(UserWarning, match=rf"declares {declared} .* holds 3,") as caught:
        motion = parse(text)
    assert len(caught) == 1
    assert torch.equal(motion.positions(), parse(corpus.PLAIN).positions())


def test_a_row_that_is_cut_off_is_refused_however_many_are_declared():
    for declared in (2, 3):
        text = corpus.PLAIN.replace("Frames: 3", f"Frames: {declared}").rstrip()[:-12]
        with pytest.raises(BvhError, match=r"line 35: \d+ values for 15"):
            parse(text)


def test_wrapped_rows_must_be_as_many_as_declared():
    """Or fifteen channels in three rows of five would be taken for one row."""
    text = corpus.spellings()["rows wrapped by joint"]
    with pytest.raises(BvhError, match="6 values for 15"):
        parse(text.replace("Frames: 3", "Frames: 4"))
    assert len(parse(re.sub("\n\n", "\n# next\n", text))) == 3
