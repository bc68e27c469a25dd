"""Bodies in files: their size, joints that carry them, joints that slide."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import bvh_corpus as corpus
import numpy as np
import pytest
import torch
from scipy.spatial.transform import Rotation

from motionlab import Motion, Skeleton, read_bvh, write_bvh
from motionlab.datasets import gaits
from motionlab.errors import BvhError
from motionlab.io.bvh import parse_bvh
from motionlab.io.bvh_units import UNITS

SIX = "Xposition Yposition Zposition Zrotation Xrotation Yrotation"


def walk() -> Motion:
    return gaits.make(seconds=1.0, speed=1.4, turn_rate=0.4, seed=3)


def scaled(by: float) -> Motion:
    """A walk by a body of another size."""
    motion, its = walk(), Skeleton.canonical()
    skeleton = Skeleton(
        its.names, its.parents, its.offsets * by, its.end_parents, its.end_offsets * by
    )
    return replace(motion, skeleton=skeleton, root_positions=motion.root_positions * by)


# -- units ----------------------------------------------------------------------------------------


@pytest.mark.parametrize("written", UNITS)
@pytest.mark.parametrize("read", UNITS)
def test_the_unit_that_fits_is_named(written, read, tmp_path):
    write_bvh(walk(), tmp_path / "clip.bvh", units=written)
    if read == written:
        read_bvh(tmp_path / "clip.bvh", units=read)
        return
    with pytest.warns(UserWarning, match=rf"clip\.bvh: .* units='{read}', .* units='{written}'"):
        read_bvh(tmp_path / "clip.bvh", units=read)


@pytest.mark.parametrize("height", [0.72, 0.9, 1.2, 1.5, 1.8, 2.15])
def test_children_and_giants_are_people(height, tmp_path):
    write_bvh(scaled(height / 1.3446), tmp_path / "clip.bvh")
    read_bvh(tmp_path / "clip.bvh")


def test_a_unit_of_its_own_is_told_as_a_number(tmp_path):
    write_bvh(walk(), tmp_path / "clip.bvh", units=0.005)
    with pytest.warns(UserWarning, match=r"none fits.* about units=0\.0056"):
        read_bvh(tmp_path / "clip.bvh")


@pytest.mark.parametrize("height", [1.15, 1.34, 1.5, 1.8, 2.1])
def test_cmu_s_unit_is_named(height, tmp_path):
    """Inches / 0.45; of the tall ones inches would make children."""
    write_bvh(scaled(height / 1.3446), tmp_path / "clip.bvh", units=0.0254 / 0.45)
    with pytest.warns(
        UserWarning, match=r": units=0\.056444, CMU's unit .* makes it " + f"{height:.2f} m"
    ):
        read_bvh(tmp_path / "clip.bvh")
    assert len(
        read_bvh(tmp_path / "clip.bvh", units=0.056444)
    )  # without a warning, which fails tests


def test_bones_without_length_are_told(tmp_path):
    write_bvh(scaled(0.0), tmp_path / "clip.bvh")
    with pytest.warns(UserWarning, match="no length"):
        read_bvh(tmp_path / "clip.bvh", up="y")


def carried(motion: Motion, folder: Path, extra: str = "") -> tuple[str, list[str]]:
    """Header and rows of a file in which a root at (0, 0, 0) carries the body, and `extra`."""
    write_bvh(motion, folder / "body.bvh")
    lines = (folder / "body.bvh").read_text(encoding="utf-8").splitlines()
    start = lines.index("MOTION")
    body = [line.replace("ROOT Hips", "JOINT pelvis") for line in lines[1:start]]
    header = ["HIERARCHY", "ROOT root", "{", "OFFSET 0 0 0", f"CHANNELS 6 {SIX}", *body,
              extra, "}", *lines[start : start + 3]]  # fmt: skip
    return "\n".join(header), lines[start + 3 :]


def test_what_is_above_the_hips_does_not_count(tmp_path):
    """A root on the floor, from which the hips hang rigidly, 3 m away."""
    header, rows = carried(walk(), tmp_path)
    header = header.replace("OFFSET 0.000000 0.000000 0.000000", "OFFSET 0 300 0", 1)
    rows = ["0 0 0 0 0 0 0 300 0 " + " ".join(row.split()[3:]) for row in rows]
    motion = parse_bvh("\n".join([header, *rows]).encode(), "clip.bvh")
    assert motion.skeleton.names[:2] == ("root", "pelvis")
    assert motion.skeleton.offsets[1].tolist() == [0, 3, 0]


# -- roots that carry a body ------------------------------------------------------------------------

IK = f"""JOINT ik_foot_root
{{
OFFSET 0 0 0
CHANNELS 6 {SIX}
JOINT ik_foot_l
{{
OFFSET 10 0 0
CHANNELS 6 {SIX}
}}
}}
JOINT prop
{{
OFFSET 0 0 0
CHANNELS 0
End Site
{{
OFFSET 0 10 0
}}
}}"""


@pytest.mark.parametrize("first", [False, True])
def test_targets_beside_the_body_are_left_out(first, tmp_path):
    """An engine's root: still here, with the pelvis that walks and targets that slide."""
    motion = walk()
    header, rows = carried(motion, tmp_path, IK)
    more = [f"0 0 0 0 0 0 {i} {2 * i} 3 40 50 60" for i in range(len(rows))]
    if first:
        header = header.replace(IK, "").replace("JOINT pelvis", f"{IK}\nJOINT pelvis")
    parts = zip(more, rows, strict=True) if first else zip(rows, more, strict=True)
    rows = ["0 0 0 0 0 0 " + " ".join(part) for part in parts]
    with pytest.warns(UserWarning, match="'pelvis'.*: ik_foot_root, ik_foot_l, prop") as caught:
        read = parse_bvh("\n".join([header, *rows]).encode(), "clip.bvh")
    assert len(caught) == 1
    assert read.skeleton.names == ("pelvis", *motion.skeleton.names[1:])
    torch.testing.assert_close(read.positions(), motion.positions(), rtol=0, atol=1e-5)


def test_a_root_that_moves_and_turns_takes_the_pelvis_along(tmp_path):
    motion = walk()
    header, rows = carried(motion, tmp_path, IK)
    rows = [f"{i} 5 {-2 * i} 20 10 {3 * i} {row} " + "0 " * 12 for i, row in enumerate(rows)]
    with pytest.warns(UserWarning, match="left out"):
        read = parse_bvh("\n".join([header, *rows]).encode(), "clip.bvh")
    for i in range(len(motion)):
        turn = Rotation.from_euler("ZXY", [20, 10, 3 * i], degrees=True)
        at = np.array([i, 5, -2 * i]) * 0.01
        expected = turn.apply(motion.positions()[i].double().numpy()) + at
        np.testing.assert_allclose(read.positions()[i].numpy(), expected, atol=2e-5)


def test_hips_do_not_fold_into_a_spine_that_slides():
    text = corpus.six_channels([(0, 20, 1), (0, 23, 1), (0, 20, 1)])
    text = text.replace("    JOINT RightArm", "  }\n  JOINT RightArm", 1)
    end = text.index("MOTION")
    text = text[: end - 4] + text[end - 2 :]  # the brace that is now too many
    with pytest.raises(BvhError, match=r"'Chest' moves against.*rigid='mean'"):
        parse_bvh(text.encode(), "clip.bvh")
    with pytest.warns(UserWarning, match="'Chest' the most"):
        motion = parse_bvh(text.encode(), "clip.bvh", rigid="mean")
    assert motion.skeleton.names == ("Hips", "Chest", "LeftArm", "RightArm")


# -- joints that slide ----------------------------------------------------------------------------


def test_joints_that_slide_are_put_at_their_mean_offset():
    text = corpus.six_channels([(15, 10, 0), (15, 13, 0), (15, 10, 0)], "LeftArm")
    with pytest.raises(BvhError, match=r"line 10: joint 'LeftArm' moves .*rigid='mean'"):
        parse_bvh(text.encode(), "clip.bvh")
    with pytest.warns(UserWarning, match=r"clip\.bvh: .*'LeftArm' .* up to 20\.0 mm") as caught:
        motion = parse_bvh(text.encode(), "clip.bvh", rigid="mean")
    assert len(caught) == 1
    assert motion.skeleton.offsets[2].tolist() == pytest.approx([0.15, 0.11, 0])
    plain = parse_bvh(corpus.PLAIN.encode(), "plain.bvh")
    assert torch.equal(motion.rotations, plain.rotations)


def test_rigid_joints_are_read_without_a_word_either_way():
    text = corpus.six_channels([(15.04, 10, 0), (14.96, 10, 0), (15, 10, 0)], "LeftArm").encode()
    asked = parse_bvh(text, "clip.bvh", rigid="mean")
    assert torch.equal(asked.positions(), parse_bvh(text, "clip.bvh").positions())


@pytest.mark.parametrize("rigid", ["median", True, 3])
def test_what_rigid_may_be(rigid):
    with pytest.raises(BvhError, match="use 'mean'"):
        parse_bvh(corpus.PLAIN.encode(), "clip.bvh", rigid=rigid)
