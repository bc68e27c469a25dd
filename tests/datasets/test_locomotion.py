"""The data set "locomotion": its list, licences, splits, mirrored copies and cache."""

from __future__ import annotations

import hashlib
import json
import threading
from dataclasses import replace
from importlib.resources import files
from pathlib import Path

import pytest
import roma
import torch

from motionlab import Skeleton, datasets
from motionlab.datasets import cache, loader, locomotion, registry, splits
from motionlab.errors import DataError
from motionlab.retargeting.stance import stances

needs_data = pytest.mark.usefixtures("recorded_clips")
SOURCES = {
    "accad": 38,
    "bandai-locomotion": 1067,
    "cmu": 3,
    "cmu-amc": 89,
    "o3de-motionmatching": 61,
    "virvig-jl": 3,
}
FIRST = 38 + 1067 + 3  # clips, in this order before those of later sources
FIRST_DIGEST = "aa1f54aac3930d11cb6fe3213845dd81f2e26e3beacb26446cb66e6ff324eaef"
CANONICAL, PARTS = Skeleton.canonical(), ("hand", "foot", "toes")
RESULTS = Path(__file__).parents[2] / "results"
# Metres, of frames 20, 60, 100, by part.
GOLDEN = [
    [[0.0864, 0.8198, 0.5945], [-0.6823, 0.8312, 1.5389], [-1.8663, 0.8427, 1.7721]],
    [[-0.0708, 0.1, 0.5765], [-0.7061, 0.1, 1.3694], [-1.68, 0.1, 1.6504]],
    [[-0.0972, 0.0251, 0.6632], [-0.7785, 0.0251, 1.424], [-1.7706, 0.0251, 1.6516]],
]
# Of two small sources, which the cache keeps for themselves.
SMALL = [c.name for c in registry.members("locomotion") if c.source in ("accad", "cmu")]
SOME = [
    *("Male1_B3_Walk", "Male1_C16_RunTurnRight135", "dataset-1_run_angry_001", "06_01", "09_01"),
    *("OutofRange1_1417-1579", "JL_mm_run_0090-0561"),
]


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
    words = ("walk", "run", "dash", "side-step", "turn", "mixed")
    assert all(action.startswith(words) for action in table["action"])
    unwanted = "box|crouch|hop|leap|jump|skip|lie|dance"
    assert not table["name"].str.contains(unwanted, case=False).any()
    assert {"Male1_B1_StandToWalk", "Male1_C02_RunToStand", "02_01", "05_01"} <= set(table["name"])
    assert {"127_03", "Walk1_0001-0478", "JL_mm_run_0090-0561"} <= set(table["name"])
    assert table["name"].is_unique


def test_clips_of_later_sources_come_after_those_that_there_were():
    clips = registry.members("locomotion")[:FIRST]
    rows = [(clip.source, clip.path, clip.split) for clip in clips]
    assert splits.digest(rows) == FIRST_DIGEST


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
    whole = {(clip.source, clip.where): clip.split for clip in registry.clips()}
    members = registry.members("locomotion")
    assert all(whole[clip.source, clip.where] == clip.split for clip in members)
    assert {clip.split for clip in registry.choose("locomotion", permissive=True)} == {
        "train", "val", "test",
    }  # fmt: skip


def test_permissive_leaves_the_non_commercial_part_out():
    clips = registry.choose("locomotion", permissive=True)
    assert {clip.source for clip in clips} == SOURCES.keys() - {"bandai-locomotion"}
    assert len(clips) == sum(SOURCES.values()) - SOURCES["bandai-locomotion"]
    assert datasets.load("bandai-locomotion", permissive=True) == []  # needs no file to say so


def test_without_data_it_says_what_to_do(own_cache, monkeypatch):
    monkeypatch.delenv("MOTIONLAB_DATA", raising=False)
    with pytest.raises(DataError, match=r"data fetch locomotion"):
        datasets.load("locomotion", download=False)


def test_unknown_clip():
    with pytest.raises(DataError, match="Male1_B3_Walk"):
        datasets.load("locomotion", clips=["Male1_B3_Wlak"])


def test_stances_are_of_the_list():
    """Or fetched with it."""
    fetched = {file.path for file in registry.files_of(registry.members("locomotion"))}
    for source, (name, frames) in locomotion.STANCES.items():
        (clip,) = registry.choose(source, wanted=[name])
        assert clip.path in fetched and frames <= clip.frames
    names = {clip.name for clip in registry.members("locomotion")}
    for source, clips in locomotion.LEARNED.items():
        assert set(clips) <= {c.name for c in registry.choose(source)} & names


def test_mirrored_gaits_follow_their_clips():
    for split in ("train", "val", "test"):
        plain = [motion.name for motion in datasets.load("gaits", split)]
        both = [motion.name for motion in datasets.load("gaits", split, mirrored=True)]
        assert both == plain + [f"{name}_mirrored" for name in plain]


def test_no_copy_is_in_two_splits():
    of = {
        split: {
            motion.name.removesuffix("_mirrored")
            for motion in datasets.load("gaits", split, mirrored=True)
        }
        for split in ("train", "val", "test")
    }
    assert sum(map(len, of.values())) == len(set.union(*of.values())) == len(datasets.load("gaits"))
    performances = datasets.table("locomotion").groupby(["source", "performance"])["split"]
    assert (performances.nunique() == 1).all()


def test_measured_numbers_keep_what_was_promised():
    """results/locomotion.json: of this very list of clips, and within the limits."""
    result = json.loads((RESULTS / "locomotion.json").read_text("utf-8"))
    clips = registry.members("locomotion")
    facts = "\n".join(f"{clip.source} {clip.where} {clip.sha256} {clip.split}" for clip in clips)
    assert result["data_hash"] == hashlib.sha256(facts.encode()).hexdigest()
    assert result["sources"].keys() == SOURCES.keys()
    for source in result["sources"].values():
        assert source["error_cm"]["median"] <= 2
        assert source["least_knee_bend_deg"] > 0
        assert source["clips_that_slide_more"] == 0
        for skate in source["skate_cm_s"].values():
            assert skate["after"] < skate["before"]
    timed = json.loads((RESULTS / "bench_retarget.json").read_text("utf-8"))
    assert timed["of_limit"] < 1 and sum(timed["seconds"].values()) < 15 * 60


def test_the_cache_format_is_that_of_this_retargeting():
    """Cached clips know of a change only by FORMAT. If this fails because retargeting was meant to
    change: raise FORMAT, run the experiments again, and put the new numbers here."""
    gait = datasets.load("gaits", clips=["walk_0.8_turn_right_0.5"])[0]
    small = replace(
        gait,
        skeleton=replace(gait.skeleton, offsets=0.8 * gait.skeleton.offsets),
        root_positions=0.8 * gait.root_positions,
        contacts=None,
    )
    points = locomotion.bring(replace(small, source="made")).positions()
    hand, ankle, toes = (points[[20, 60, 100], CANONICAL.index(f"left_{part}")] for part in PARTS)
    assert locomotion.FORMAT == 9
    expected = torch.tensor(GOLDEN)
    torch.testing.assert_close(torch.stack([hand, ankle, toes]), expected, rtol=0, atol=1e-3)


@pytest.mark.parametrize("clips", [5, ["stand", 5], [["stand"]]])
def test_clips_are_names(clips):
    for name in ("gaits", "locomotion"):
        with pytest.raises(DataError, match="must be a list of names"):
            datasets.load(name, clips=clips)


def test_loads_that_overlap_give_the_threads_back():
    before = torch.get_num_threads()
    torch.set_num_threads(3)
    first_is_in, second_is_in, first_is_out = (threading.Event() for _ in range(3))

    def first():
        with loader._one_thread():
            first_is_in.set()
            second_is_in.wait(5)
        first_is_out.set()

    def second():
        first_is_in.wait(5)
        with loader._one_thread():
            second_is_in.set()
            first_is_out.wait(5)
            assert torch.get_num_threads() == 1

    try:
        loads = [threading.Thread(target=load) for load in (first, second)]
        for load in loads:
            load.start()
        for load in loads:
            load.join()
        assert torch.get_num_threads() == 3
    finally:
        torch.set_num_threads(before)


def test_contacts_survive_packing():
    motions = datasets.load("gaits", clips=["walk_1.3", "stand"])
    names = [(motion.source, motion.name) for motion in motions]
    for kept, motion in zip(cache.unpack(cache.pack(motions), names), motions, strict=True):
        assert torch.equal(kept.contacts, motion.contacts)


# -- with data ------------------------------------------------------------------------------------


@needs_data
def test_load_some(own_cache):
    motions = datasets.load("locomotion", clips=SOME, download=False)
    assert [m.source for m in motions] == ["accad", *SOURCES]
    frames = datasets.table("locomotion").set_index("name").frames
    for motion in motions:
        assert motion.skeleton.matches(Skeleton.canonical())
        assert motion.fps == 30 and len(motion) == frames[motion.name]
        assert motion.contacts is not None and 0.02 < motion.contacts.float().mean() < 0.9


@needs_data
def test_any_clips_of_a_rig_tell_the_same_axes_together():
    for source, names in locomotion.LEARNED.items():
        clips = datasets.load(source, clips=names, download=False)
        wanted = loader.stance(source).motion.orientations()
        for some in (clips[::2], clips[1::2]):
            found = stances(some, CANONICAL).references[0].motion.orientations()
            assert torch.rad2deg(roma.rotmat_geodesic_distance(found, wanted)).max() < 1


@needs_data
def test_mirrored_copies_stay_in_their_split_and_the_cache_gives_the_same_bits(own_cache):
    splits = datasets.table("locomotion").set_index("name")["split"]
    options = {"mirrored": True, "clips": SMALL, "download": False}
    first = datasets.load("locomotion", "test", **options)
    labels = {path.stem for path in own_cache.glob("*.npz")}
    assert labels == {"locomotion-test-accad", "locomotion-test-cmu"}
    second = datasets.load("locomotion", "test", **options)
    assert len(first) == len(second) == 2 * sum(splits[SMALL] == "test")
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
    load = lambda: datasets.load("locomotion", "test", clips=SMALL, download=False)
    load()
    monkeypatch.setattr(locomotion, "FORMAT", locomotion.FORMAT + 1)
    calls = []
    bring = locomotion.bring
    monkeypatch.setattr(locomotion, "bring", lambda *a: calls.append(a) or bring(*a))
    assert len(load()) == len(calls)
