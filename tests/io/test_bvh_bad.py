"""Bad BVH files: the right motion or an error that names file, line and remedy."""

from __future__ import annotations

import os
import re
import warnings

import bvh_corpus as corpus
import pytest
import torch
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from motionlab import MotionLabError, read_bvh
from motionlab.errors import BvhError
from motionlab.io.bvh import parse_bvh


@pytest.mark.parametrize("name", corpus.bad())
def test_bad_files_are_refused_with_file_line_and_remedy(name, tmp_path):
    data, line, words = corpus.bad()[name]
    path = tmp_path / "bad.bvh"
    path.write_bytes(data)
    with pytest.raises(BvhError) as caught:
        read_bvh(path)
    message = str(caught.value)
    assert message.startswith(f"{path}, line {line}: "), message
    assert words in message and len(message) - len(str(path)) < 400
    assert re.search(r"[;:,] \S.*\.$", message), "no remedy"


def test_a_file_cut_anywhere_is_refused_or_told():
    """Between two rows it may be as well a wrong count; within a row it has lost its end."""
    data = corpus.PLAIN.encode()
    last_number = len(data.rstrip()) - len(b"5.0")
    told = 0
    for length in range(last_number + 1):  # a shorter last number can't be told
        rows = [line.split() for line in data[corpus.ROWS : length].splitlines()]
        if rows and all(len(row) == 15 for row in rows):
            with pytest.warns(UserWarning, match=rf"declares 3 .* holds {len(rows)}, all of which"):
                assert len(parse_bvh(data[:length], "cut.bvh")) == len(rows)
            told += 1
        else:
            with pytest.raises(BvhError, match=r"^cut\.bvh, line \d+: "):
                parse_bvh(data[:length], "cut.bvh")
    assert told == 8  # "3", "3.", "3.0", and after the line's end, of two rows


def test_paths_that_are_no_files(tmp_path):
    for path in (tmp_path, tmp_path / "absent.bvh", tmp_path / "zero\0byte.bvh"):
        with pytest.raises(BvhError, match="can't be opened"):
            read_bvh(path)


@pytest.mark.parametrize("path", [None, 3, ["a.bvh"]])
def test_what_is_no_path(path):
    with pytest.raises(BvhError, match="is not a path"):
        read_bvh(path)


@pytest.mark.skipif(
    not hasattr(os, "geteuid") or os.geteuid() == 0,
    reason="root reads all files: run the tests as another user",
)
def test_file_without_read_permission(tmp_path):
    path = tmp_path / "clip.bvh"
    path.write_text(corpus.PLAIN, encoding="utf-8")
    path.chmod(0)
    with pytest.raises(BvhError, match="can't be opened"):
        read_bvh(path)


TOKENS = st.sampled_from(
    ["{", "}", "JOINT", "ROOT A", "End Site", "OFFSET", "OFFSET 1 2 3", "CHANNELS 3", "MOTION",
     "Frames: 3", "Frame Time: 1", "nan", "1e400", "-", "1,5", "\t", "\n", "\r", "\0", "\x0b",
     "\x85", "\u2028", "True", "#", "//", "\x1a", "Xscale", "ms", "CHANNELS 0", '"', "٣", "0", "9" * 400, "Xposition", "Zrotation", "é", ""]
)  # fmt: skip
PLACE = st.integers(0, len(corpus.PLAIN))
EDITS = st.lists(st.tuples(PLACE, st.integers(0, 40), TOKENS | st.text(max_size=4)), max_size=4)
LINE_EDITS = st.lists(st.tuples(st.integers(0, 36), st.integers(0, 36)), max_size=3)


def read_or_refuse(data: bytes) -> None:
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)  # of counts, rates, scale
            motion = parse_bvh(data, "fuzz.bvh")
    except MotionLabError as error:
        assert isinstance(error, BvhError) and re.match(r"fuzz\.bvh, line \d+: ", str(error))
    else:
        assert len(motion) > 0 and torch.isfinite(motion.positions()).all()


@settings(max_examples=400, deadline=10_000, suppress_health_check=[HealthCheck.too_slow])
@given(edits=EDITS, moved=LINE_EDITS, base=st.sampled_from(list(corpus.same_motion())))
def test_mutated_files_are_read_or_refused(edits, moved, base):
    data = corpus.same_motion()[base]
    text = data.decode("utf-16" if "UTF-16" in base else "utf-8")
    lines = text.split("\n")
    for source, target in moved:
        if source < len(lines):
            lines.insert(target, lines.pop(source))
    text = "\n".join(lines)
    for place, length, token in edits:
        text = text[:place] + token + text[place + length :]
    read_or_refuse(text.encode("utf-8", errors="surrogatepass"))


@settings(max_examples=200, deadline=10_000)
@given(
    edits=st.lists(st.tuples(PLACE, st.integers(0, 20), st.binary(max_size=6)), max_size=4),
    base=st.sampled_from(["plain", "CRLF", "UTF-16", "byte order mark"]),
)
def test_mutated_bytes_are_read_or_refused(edits, base):
    data = corpus.same_motion()[base]
    for place, length, new in edits:
        data = data[:place] + new + data[place + length :]
    read_or_refuse(data)
