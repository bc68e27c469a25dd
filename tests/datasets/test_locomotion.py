"""The data set "locomotion": its list, licences, splits, mirrored copies and cache."""

from __future__ import annotations

import os
from importlib.resources import files

import pytest
import torch

from motionlab import Skeleton, datasets
from motionlab.datasets import cache, locomotion, registry
from motionlab.errors import DataError

needs_data = pytest.mark.skipif(
    not os.environ.get("MOTIONLAB_DATA"), reason="MOTIONLAB_DATA is not set"
)
SOURCES = {"accad": 38, "bandai-locomotion": 1067, "cmu": 3}
SOME = ["Male1_B3_Walk", "Male1_C16_RunTurnRight135", "06_01", "dataset-1_run_angry_001"]


@pytest.fixture
def own_cache(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    return tmp_path / "motionlab/parsed"


# -- without data ---------------------------------------------------------------------------------


def test_every_row_of_the_list_is_a_clip():
    rows = files("motionlab.datasets").joinpath("locomotion.tsv").read_text("utf-8").splitlines()
    assert rows[0] == "source\tpath" and len(set(rows)) == len(rows)
    assert len(registry.members("locomotion")) == len(rows) - 1 == sum(SOURCES.values())


def test_it_is_locomotion():
    table = datasets.table("locomotion")
    assert table.groupby("source").size().to_dict() == SOURCES
    words = ("walk", "run", "dash", "side-step")
    assert all(action.startswith(words) for action in table["action"])
    unwanted = "box|crouch|hop|leap|jump|skip|lie|dance"
    assert not table["name"].str.contains(unwanted, case=False).any()
    assert {"Male1_B1_StandToWalk", "Male1_C02_RunToStand", "02_01", "05_01"} <= set(table["name"])
    assert table["name"].is_unique


def test_table_is_at_its_rate_and_tells_each_licence():
    table = datasets.table("locomotion").set_index("name")
    assert (table.fps == 30).all()
    assert table.frames["05_01"] == 150  # of 598 at 120
    assert (table.seconds == table.frames / 30).all()
    for name, licence in (
        ("05_01", "CMU"),
        ("Male1_B3_Walk", "CC BY 3.0"),
        ("dataset-2_walk_normal_001", "CC BY-NC 4.0 (non-commercial)"),
    ):
        assert licence in table.licence[name]


def test_info():
    about = datasets.info("locomotion")
    assert about.clips == sum(SOURCES.values()) == sum(about.splits.values())
    assert not about.commercial and "non-commercial" in about.licence
    assert "accad" in about.citation and "cmu" in about.citation


def test_splits_are_those_of_the_sources():
    whole = {(clip.source, clip.path): clip.split for clip in registry.clips()}
    members = registry.members("locomotion")
    assert all(whole[clip.source, clip.path] == clip.split for clip in members)
    assert {clip.split for clip in registry.choose("locomotion", permissive=True)} == {
        "train", "val", "test",
    }  # fmt: skip


def test_permissive_leaves_the_non_commercial_part_out():
    clips = registry.choose("locomotion", permissive=True)
    assert {clip.source for clip in clips} == {"accad", "cmu"}
    assert len(clips) == SOURCES["accad"] + SOURCES["cmu"]
    assert datasets.load("bandai-locomotion", permissive=True) == []  # needs no file to say so


def test_without_data_it_says_what_to_do(own_cache, monkeypatch):
    monkeypatch.delenv("MOTIONLAB_DATA", raising=False)
    with pytest.raises(DataError, match=r"data fetch locomotion"):
        datasets.load("locomotion", download=False)


def test_unknown_clip():
    with pytest.raises(DataError, match="Male1_B3_Walk"):
        datasets.load("locomotion", clips=["Male1_B3_Wlak"])


def test_stances_are_of_the_list():
    names = {clip.name for clip in registry.members("locomotion")}
    assert {name for name, _ in locomotion.STANCES.values()} <= names


def test_mirrored_gaits_follow_their_clips():
    for split in ("train", "val", "test"):
        plain = [motion.name for motion in datasets.load("gaits", split)]
        both = [motion.name for motion in datasets.load("gaits", split, mirrored=True)]
        assert both == plain + [f"{name}_mirrored" for name in plain]


def test_contacts_survive_packing():
    motions = datasets.load("gaits", clips=["walk_1.3", "stand"])
    names = [(motion.source, motion.name) for motion in motions]
    for kept, motion in zip(cache.unpack(cache.pack(motions), names), motions, strict=True):
        assert torch.equal(kept.contacts, motion.contacts)


# -- with data ------------------------------------------------------------------------------------


@needs_data
def test_load_some(own_cache):
    motions = datasets.load("locomotion", clips=SOME, download=False)
    assert [m.source for m in motions] == ["accad", "accad", "bandai-locomotion", "cmu"]
    frames = datasets.table("locomotion").set_index("name").frames
    for motion in motions:
        assert motion.skeleton.matches(Skeleton.canonical())
        assert motion.fps == 30 and len(motion) == frames[motion.name]
        assert motion.contacts is not None and 0.02 < motion.contacts.float().mean() < 0.9


@needs_data
def test_mirrored_copies_stay_in_their_split_and_the_cache_gives_the_same_bits(own_cache):
    splits = datasets.table("locomotion").set_index("name")["split"]
    options = {"mirrored": True, "permissive": True, "download": False}
    first = datasets.load("locomotion", "test", **options)
    labels = {path.stem for path in own_cache.glob("*.npz")}
    assert labels == {"locomotion-test-accad", "locomotion-test-cmu"}
    second = datasets.load("locomotion", "test", **options)
    assert (
        len(first)
        == len(second)
        == 2 * sum(clip.split == "test" for clip in registry.choose("locomotion", permissive=True))
    )
    for motion, again in zip(first, second, strict=True):
        assert splits[motion.name.removesuffix("_mirrored")] == "test"
        assert torch.equal(motion.rotations, again.rotations)
        assert torch.equal(motion.contacts, again.contacts)
    half = len(first) // 2
    for motion, copy in zip(first[:half], first[half:], strict=True):
        assert copy.name == f"{motion.name}_mirrored" and copy.source == motion.source
        flip = torch.tensor([-1.0, 1.0, 1.0])
        assert torch.allclose(copy.root_positions, motion.root_positions * flip)


@needs_data
def test_the_cache_is_made_anew_when_retargeting_changes(own_cache, monkeypatch):
    load = lambda: datasets.load("locomotion", "test", permissive=True, download=False)
    load()
    monkeypatch.setattr(locomotion, "FORMAT", locomotion.FORMAT + 1)
    calls = []
    bring = locomotion.bring
    monkeypatch.setattr(locomotion, "bring", lambda *a: calls.append(a) or bring(*a))
    assert len(load()) == len(calls)
