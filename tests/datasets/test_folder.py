"""A folder of a reader's own clips, of any rigs, brought to one body. How it is read: test_loader."""

from __future__ import annotations

import re
import warnings

import pytest
import torch
from other_axes import redrawn

from motionlab import Motion, Skeleton, datasets, read_bvh, write_bvh
from motionlab.datasets import gaits
from motionlab.datasets.splits import SPLITS
from motionlab.errors import BvhError, DataError, MotionLabError, RetargetError


@pytest.fixture
def rigs(tmp_path):
    """Clips of two rigs whose rest poses are no bodies; of each, one stands."""
    walk = gaits.make(seconds=2, speed=1.3)
    stands = gaits.make(seconds=1, speed=0.0)
    for rig in (1, 2):
        write_bvh(redrawn(walk, rig), tmp_path / f"{rig}_walk.bvh")
        write_bvh(redrawn(stands, rig), tmp_path / f"{rig}_stand.bvh")
    return tmp_path


def test_a_folder_of_two_rigs_on_one_body(rigs):
    with pytest.warns(UserWarning) as caught:
        motions = datasets.from_folder(rigs, skeleton=Skeleton.canonical())
    said = [str(w.message) for w in caught]
    assert len(said) == 2 and all("2 clips of one rig" in each for each in said)
    assert "1_stand, 0." in said[0] and "2_stand, 0." in said[1]
    assert all(w.filename == __file__ for w in caught)
    assert [m.name for m in motions] == ["1_stand", "1_walk", "2_stand", "2_walk"]
    wanted = gaits.make(seconds=2, speed=1.3).positions()
    for motion in (motions[1], motions[3]):
        assert (motion.positions() - wanted).norm(dim=-1).max() < 0.02


def test_axes_do_not_depend_on_the_split(rigs):
    canonical = Skeleton.canonical()
    with pytest.warns(UserWarning):
        whole = datasets.from_folder(rigs, skeleton=canonical)
        parts = [datasets.from_folder(rigs, split=s, skeleton=canonical) for s in SPLITS]
    found = {motion.name: motion for part in parts for motion in part}
    assert len(found) == 4
    for motion in whole:
        assert torch.equal(motion.rotations, found[motion.name].rotations)


def test_a_reference_is_a_motion_or_a_file(rigs, tmp_path):
    for file in ("1_stand", "2_stand", "2_walk"):
        (rigs / f"{file}.bvh").rename(tmp_path / f"{file}.txt")
    (rigs / "sub").mkdir()
    (rigs / "1_walk.bvh").rename(rigs / "sub" / "1_walk.bvh")
    file = tmp_path / "1_stand.txt"
    to = {"skeleton": Skeleton.canonical()}
    named = datasets.from_folder(rigs, reference=file, **to)[0]  # and nothing is to be told
    given = datasets.from_folder(rigs, reference=read_bvh(file), **to)[0]
    assert torch.equal(named.rotations, given.rotations)
    with pytest.raises(RetargetError, match="another rig than all 1 clips"):
        datasets.from_folder(rigs, reference=tmp_path / "2_stand.txt", **to)
    with pytest.raises(RetargetError, match="at no time does the body stand"):
        datasets.from_folder(rigs, reference=rigs / "sub" / "1_walk.bvh", **to)
    with pytest.raises(BvhError, match="absent.bvh: can't be opened"):
        datasets.from_folder(rigs, reference=rigs / "absent.bvh", **to)
    with pytest.raises(DataError, match="skeleton="):
        datasets.from_folder(rigs, reference=file)
    with pytest.raises(MotionLabError, match="5 is not a path"):
        datasets.from_folder(rigs, reference=5, **to)
    with pytest.raises(DataError, match="takes a Motion and a Skeleton"):
        datasets.from_folder(rigs, skeleton="canonical")


def test_what_retargeting_warns_of_is_said_once(rigs, monkeypatch):
    def doubtful(motion, *_, **__):
        warnings.warn(f"Motion {motion.name!r} is odd.", stacklevel=2)
        return motion

    monkeypatch.setattr(Motion, "retarget", doubtful)
    with pytest.warns(UserWarning) as caught:
        datasets.from_folder(rigs, skeleton=Skeleton.canonical())
    said = [str(w.message) for w in caught if "odd" in str(w.message)]
    assert len(said) == 1 and re.search(
        r"4 of 4 files, first .*1_stand\.bvh: Motion '1_stand' is", said[0]
    )


def test_a_folder_of_which_nothing_can_be_used(tmp_path):
    for name in "ab":
        (tmp_path / f"{name}.bvh").write_text("no BVH at all", encoding="utf-8")
    for skip_bad in (False, True):
        with pytest.raises(DataError, match=r"(?s)2 of 2 files.*a\.bvh.*b\.bvh.*None is left"):
            datasets.from_folder(tmp_path, skip_bad=skip_bad, skeleton=Skeleton.canonical())
