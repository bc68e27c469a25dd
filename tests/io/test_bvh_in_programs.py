"""What other programs need of the BVH files that we write: names of joints."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from three_in_node import in_three, three_plays

from motionlab import Motion, read_bvh, write_bvh
from motionlab.datasets import gaits
from motionlab.errors import BvhError

WALK = gaits.make(seconds=0.5, speed=1.2, name="walk")


def called(start: str) -> Motion:
    """A walk of a body whose joints' names begin so."""
    names = [start + name for name in WALK.skeleton.names]
    return replace(WALK, skeleton=replace(WALK.skeleton, names=names, roles=None))


@pytest.mark.parametrize("start", ["mixamorig:", "a|b:", "rig/", "x[1].", "Bip01 ", "Knöchel:"])
def test_safe_names_are_of_letters_and_digits_and_understood(start, tmp_path):
    motion = called(start)
    write_bvh(motion, tmp_path / "kept.bvh")
    assert read_bvh(tmp_path / "kept.bvh").skeleton.names[1] == start.replace(" ", "_") + "Spine"
    write_bvh(motion, tmp_path / "safe.bvh", names="safe", root_motion="ground")
    safe = read_bvh(tmp_path / "safe.bvh").skeleton
    assert all(name.replace("_", "").isalnum() for name in safe.names)
    assert safe.roles == WALK.skeleton.roles


def test_names_that_become_alike_are_told_apart(tmp_path):
    names = ["a:b", "a/b", "a_b", "a b", *WALK.skeleton.names[4:]]
    motion = replace(WALK, skeleton=replace(WALK.skeleton, names=names, roles=None))
    with pytest.raises(BvhError, match="same name; .* names='safe'"):
        write_bvh(motion, tmp_path / "walk.bvh")
    write_bvh(motion, tmp_path / "walk.bvh", names="safe")
    assert read_bvh(tmp_path / "walk.bvh").skeleton.names[:4] == ("a_b", "a_b_2", "a_b_3", "a_b_4")


def test_bad_names(tmp_path):
    with pytest.raises(BvhError, match="use 'kept' or 'safe'"):
        write_bvh(WALK, tmp_path / "walk.bvh", names="short")
    write_bvh(WALK, tmp_path / "rig.bvh")
    with pytest.raises(BvhError, match="leave names= or like= out"):
        write_bvh(WALK, tmp_path / "walk.bvh", names="safe", like=tmp_path / "rig.bvh")


@in_three
def test_three_moves_joints_whose_names_are_safe(tmp_path):
    """A name with a colon is one it can't move: known, and said in the docs of `write_bvh`."""
    motion, last = called("mixamorig:"), (len(WALK) - 1) / WALK.fps
    for names, moves in (("kept", False), ("safe", True)):
        write_bvh(motion, tmp_path / "walk.bvh", names=names, units="m")
        (start, end) = three_plays(tmp_path / "walk.bvh", 0, last)["stop"]
        found = [list(each.values())[0] for each in (start, end)]
        assert (np.abs(np.subtract(*found)).max() > 0.3) == moves
        if moves:
            places = [end[name] for name in end if name.endswith("LeftToes")]
            toes = WALK.positions()[-1, WALK.skeleton.index("LeftToes")].numpy()
            np.testing.assert_allclose(places[0], toes, atol=1e-4)
