"""The data set "everything": all clips on one body, in the splits that they had."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
import torch

from motionlab import Skeleton, datasets
from motionlab.datasets import loader, locomotion, registry, splits
from motionlab.errors import DataError
from motionlab.retargeting.stance import stances

needs_data = pytest.mark.usefixtures("recorded_clips")
RESULTS = Path(__file__).parents[2] / "results"
# One clip of each source that `locomotion` takes none of, and of its dances and fights.
SOME = ["dataset-1_bow_active_001", "martial_04", "salsa_25", "05_02", "131_01", "Male1_A1_Stand"]


@pytest.fixture
def own_cache(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    return tmp_path / "motionlab/parsed"


# -- without data ---------------------------------------------------------------------------------


def test_it_is_all_clips_but_a_still_frame_and_a_namesake():
    every, members = set(registry.clips()), registry.members("everything")
    left = {(clip.source, clip.name) for clip in every.difference(members)}
    assert len(set(members)) == len(members) and left == registry.LEFT_OUT
    assert datasets.table("everything")["name"].is_unique
    assert set(datasets.table("everything").source) == set(registry.sources())


def test_what_is_held_out_of_locomotion_is_held_out_here():
    split = {(clip.source, clip.where): clip.split for clip in registry.members("everything")}
    for clip in registry.members("locomotion"):
        assert split[clip.source, clip.where] == clip.split
    performances = datasets.table("everything").groupby(["source", "performance"])["split"]
    assert (performances.nunique() == 1).all()


def test_splits_are_eighty_ten_ten_and_hold_every_kind():
    table = datasets.table("everything")
    minutes = table.groupby("split").seconds.sum() / table.seconds.sum()
    assert 0.75 < minutes["train"] < 0.85 and min(minutes["val"], minutes["test"]) > 0.08
    for action in ("walk", "run", "dance", "martial-arts", "bow", "crouch", "jump", "basketball"):
        assert set(table[table.action == action]["split"]) == set(splits.SPLITS)


def test_table_is_at_its_rate_and_each_clip_keeps_its_licence():
    table = datasets.table("everything").set_index("name")
    assert (table.fps == 30).all()
    assert table.frames["salsa_25"] == -(-datasets.table("aclstm-cmu").set_index("name").frames["salsa_25"] // 2)  # fmt: skip
    raw = datasets.table().set_index(["source", "name"]).licence
    assert all(raw[row.source, name] == row.licence for name, row in table.iterrows())
    free = {clip.source for clip in registry.choose("everything", permissive=True)}
    assert free == {name for name, source in registry.sources().items() if source.commercial}


def test_info_tells_all_licences():
    about = datasets.info("everything")
    assert about.clips == len(registry.members("everything")) == sum(about.splits.values())
    assert not about.commercial
    assert all(name in about.licence for name in registry.sources())


def test_without_data_it_says_what_to_do(own_cache, monkeypatch):
    monkeypatch.delenv("MOTIONLAB_DATA", raising=False)
    with pytest.raises(DataError, match=r"data fetch everything"):
        datasets.load("everything", download=False)


def test_measured_minutes_are_of_this_very_list():
    result = json.loads((RESULTS / "everything.json").read_text("utf-8"))
    clips = registry.members("everything")
    assert result["data_hash"] == splits.digest([(c.source, c.where, c.split) for c in clips])
    minutes = sum(clip.seconds for clip in clips) / 60
    assert result["all"]["minutes"] == pytest.approx(minutes, rel=0.01)
    by_kind = [row["minutes"] for row in result["kinds"].values()]
    assert sum(by_kind) == pytest.approx(result["all"]["minutes"], rel=0.01)


# -- with data ------------------------------------------------------------------------------------


@needs_data
def test_load_some(own_cache):
    motions = datasets.load("everything", clips=SOME, download=False)
    frames = datasets.table("everything").set_index("name").frames
    assert {motion.name for motion in motions} == set(SOME)
    for motion in motions:
        assert motion.skeleton.matches(Skeleton.canonical())
        assert motion.fps == 30 and len(motion) == frames[motion.name]
        # whoever is upright is so here, too: no rig was taken for one that lies or is twisted
        hips, head = (motion.positions()[:, motion.skeleton.roles[r]] for r in ("hips", "head"))
        assert (head - hips)[:, 1].median() > 0.4


@needs_data
def test_clips_of_locomotion_are_cached_once_for_both(own_cache):
    names = [c.name for c in registry.members("locomotion") if c.source == "cmu"]
    more = [c.name for c in registry.members("everything")
            if c.source == "cmu" and c.split == "test"]  # fmt: skip
    mine = datasets.load("locomotion", "test", clips=names, download=False)
    kept = {path.stem for path in own_cache.glob("locomotion*.npz")}
    first = datasets.load("everything", "test", clips=more, download=False)
    labels = {path.stem for path in own_cache.glob("*.npz")}
    assert kept == {"locomotion-test-cmu"} and labels >= kept | {"everything-test-cmu"}
    again = {m.name: m for m in datasets.load("everything", "test", clips=more, download=False)}
    for motion in (*first, *mine):
        assert torch.equal(motion.rotations, again[motion.name].rotations)


@needs_data
def test_the_rig_of_another_source_tells_how_these_clips_stand():
    """Clips of gestures say so themselves, all together, as far as they can."""
    for source in locomotion.SAME_RIG:
        names = [clip.name for clip in registry.members(source)][::6]
        clips = datasets.load(source, clips=names, download=False)
        wanted = loader.stance(source).motion.orientations()
        found = stances(clips, Skeleton.canonical()).references[0].motion.orientations()
        turn = (wanted.mT @ found).diagonal(dim1=-2, dim2=-1).sum(-1)
        assert torch.rad2deg(((turn - 1) / 2).clamp(-1, 1).acos()).max() < 1
