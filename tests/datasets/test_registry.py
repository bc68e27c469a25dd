"""The committed table of clips and what is said about it. None of this needs data."""

import re
from collections import defaultdict
from importlib.resources import files
from itertools import pairwise

import pytest

from motionlab import MotionLabError, datasets
from motionlab.datasets import registry, splits

# Changes only when clips or splits are changed on purpose; results name it.
DIGEST = "1249722f51c995c1d034a0f96c361d4a6b49fc032001d24e68732ac77bc5e438"
# Of the five sources that there were first.
FIRST = ("bandai-locomotion", "bandai-actions", "aclstm-cmu", "accad", "cmu")
FIRST_DIGEST = "dddebbbf3d4342451470c5f46e4c2587c4928f4870e323ce36b4e7ae54722340"
LATER = ("cmu-131", "cmu-amc", "o3de-motionmatching", "virvig-jl")

# What the sources say of themselves: clips, minutes.
SIZES = {
    "bandai-locomotion": (1067, 93.0),
    "bandai-actions": (69, 7.6),
    "aclstm-cmu": (43, 20.2),
    "accad": (69, 6.8),
    "cmu": (36, 4.5),
    "cmu-131": (2, 0.3),
    "cmu-amc": (94, 5.1),
    "o3de-motionmatching": (73, 22.2),
    "virvig-jl": (4, 1.3),
}


def performances():
    """Splits of each performance, by (source, performance)."""
    found = defaultdict(set)
    for clip in registry.clips():
        found[clip.source, clip.performance].add(clip.split)
    return found


def test_names():
    assert datasets.names() == ["gaits", "examples", "locomotion", "everything", *SIZES]


@pytest.mark.parametrize("name", SIZES)
def test_sizes(name):
    about = datasets.info(name)
    assert (about.clips, round(about.minutes, 1)) == SIZES[name]
    assert sum(about.splits.values()) == about.clips


def test_rows_are_sound():
    clips = registry.clips()
    assert len({(c.source, c.name) for c in clips}) == len(clips) == 1457
    assert [(c.source, c.path, c.skip) for c in clips] == sorted(
        (c.source, c.path, c.skip) for c in clips
    )
    for clip in clips:
        assert re.fullmatch(r"[0-9a-f]{64}", clip.sha256)
        assert re.fullmatch(r"[\w./-]+\.(bvh|amc|res)", clip.path) and ".." not in clip.path
        assert clip.url.startswith("https://raw.githubusercontent.com/")
        still = clip.name == "JL_mm_tpose"  # one frame
        assert still or clip.frames >= 20 and clip.bytes > 20_000
        assert clip.action and clip.style
        assert clip.fps == (60 if "salsa" in clip.path else clip.fps) and clip.fps in (30, 60, 120)


def test_files_lie_where_they_are_published():
    clips = {(clip.source, clip.name): clip for clip in registry.clips()}
    for source, name, end in (
        ("cmu-amc", "16_35", "/mocap/16/16_35.amc"),
        ("cmu-amc", "127_03", "/mocap/127/127_03.amc"),
        ("cmu-amc", "91_01", "/Motion%20Graphs%20Project/data/mocap/91_01.amc"),
        ("cmu-amc", "91_13", "/graphs/graph91/mocap/hide/91_13.amc"),
        ("virvig-jl", "JL_mm_tpose", "/BVH/JL_mm_tpose.txt"),
        ("accad", "Male1_B3_Walk", "/bvh/Male1_B3_Walk.bvh"),
    ):
        assert clips[source, name].url.endswith(end)
    (skeleton,) = clips["cmu-amc", "91_01"].besides
    assert skeleton.path == "91.asf" and skeleton.url.endswith("/data/mocap/91.asx")


def test_files_are_counted_once():
    """A take in parts is one file; a person's skeleton is beside each of his clips."""
    clips = [c for c in registry.clips() if c.source == "cmu-amc" or c.path == "Walk1.res"]
    files = registry.files_of(clips)
    assert len(files) == 94 + 8 + 1 and all(len(c.besides) == 1 for c in clips if not c.part)
    assert datasets.info("o3de-motionmatching").bytes == 45_143_967


def test_table_is_small():
    assert len(files("motionlab.datasets").joinpath("clips.tsv").read_bytes()) <= 300_000


def test_names_of_numbered_clips_say_their_folder():
    names = {clip.name for clip in registry.members("aclstm-cmu")}
    assert {"salsa_25", "indian_13", "martial_04"} <= names


def test_splits_are_those_of_the_rule():
    clips = [clip for clip in registry.clips() if not clip.part]
    expected = splits.assign([(c.source, c.performance, c.action, c.style) for c in clips])
    assert [clip.split for clip in clips] == expected
    assert splits.digest((c.source, c.where, c.split) for c in registry.clips()) == DIGEST
    first = [clip for clip in clips if clip.source in FIRST]
    assert splits.digest((c.source, c.path, c.split) for c in first) == FIRST_DIGEST


def test_parts_of_a_take_are_apart():
    takes = defaultdict(list)
    for clip in registry.clips():
        if clip.part:
            takes[clip.path].append(clip)
    assert len(takes) == 22
    for parts in takes.values():
        assert {part.split for part in parts} == set(splits.SPLITS)
        for before, after in pairwise(parts):
            assert after.skip - before.skip - before.frames >= splits.GAP * before.fps
    assert "Walk1_0001-0478" in {part.name for part in takes["Walk1.res"]}
    assert all(
        c.seconds <= splits.LONG for c in registry.clips() if c.source in LATER and not c.part
    )


def test_splits_do_not_depend_on_order():
    rows = [(c.source, c.performance, c.action, c.style) for c in registry.clips()]
    assert splits.assign(rows[::-1]) == splits.assign(rows)[::-1]


def test_shares():
    """Of whole clips by number, of parts of takes by time."""
    for split, low, high in (("train", 0.77, 0.83), ("val", 0.08, 0.13), ("test", 0.08, 0.13)):
        for part in (True, False):
            sizes = [
                (c.seconds if part else 1, c.split)
                for c in registry.clips()
                if bool(c.part) == part
            ]
            its = sum(size for size, of in sizes if of == split)
            assert low < its / sum(size for size, _ in sizes) < high


def test_every_source_action_and_style_has_clips_to_hold_out():
    for column in ("action", "style"):
        groups = defaultdict(lambda: defaultdict(set))
        for clip in registry.clips():
            if column == "action" or clip.source == "aclstm-cmu":
                groups[clip.source, getattr(clip, column)][clip.split].add(clip.performance)
        for group, by_split in groups.items():
            if len(set().union(*by_split.values())) >= 3:
                assert set(by_split) == set(splits.SPLITS), group
    for source in registry.sources().keys() - {"cmu-131"}:  # two clips
        assert {clip.split for clip in registry.members(source)} == set(splits.SPLITS)


def test_performances_are_not_torn():
    assert all(len(its) == 1 for its in performances().values())


def test_partners_of_a_dance_and_cuts_of_a_take_are_one_performance():
    clips = {(clip.source, clip.name): clip for clip in registry.clips()}
    for number in (*range(1, 8), *range(9, 16)):
        pair = [clips["aclstm-cmu", f"salsa_{n:02d}"] for n in (number, number + 15)]
        assert pair[0].performance == pair[1].performance and pair[0].frames == pair[1].frames
    cuts = [clips["bandai-locomotion", f"dataset-2_walk-turn-left_normal_{n}"]
            for n in ("027", "031")]  # fmt: skip
    assert cuts[0].performance == cuts[1].performance


def test_examples_are_small_and_of_every_source_that_there_was_first():
    clips = registry.members("examples")
    assert len(clips) == 14 and sum(clip.bytes for clip in clips) <= 10_000_000
    assert {clip.source for clip in clips} == set(FIRST)
    assert {clip.style for clip in clips if clip.source == "aclstm-cmu"} == {
        "indian", "martial", "salsa",
    }  # fmt: skip


def test_info_tells_licence_and_citation():
    for name in ("bandai-locomotion", "bandai-actions", "examples"):
        assert "non-commercial" in repr(datasets.info(name))
    assert "non-commercial" not in repr(datasets.info("accad"))
    assert "arXiv:2306.08861" in datasets.info("bandai-actions").citation
    assert "NSF EIA-0196217" in datasets.info("cmu").citation
    assert "1707.05363" in datasets.info("aclstm-cmu").citation
    assert "The Ohio State University" in datasets.info("accad").citation
    html = datasets.info("accad")._repr_html_()
    assert "CC BY 3.0" in html and "&quot;Male1&quot;" in html


def test_table():
    table = datasets.table()
    assert list(table.columns) == registry.COLUMNS and len(table) == 1457
    salsa = table[table["style"] == "salsa"]
    assert (salsa.fps == 60).all() and len(salsa) == 28
    assert (table.seconds == table.frames / table.fps).all()
    assert len(datasets.table("examples")) == 14
    runs = datasets.table("accad").query("action == 'run-turn'")
    assert len(runs) == 8


def test_gaits_are_a_data_set_like_the_others():
    table = datasets.table("gaits")
    assert list(table.columns) == registry.COLUMNS
    for split in splits.SPLITS:
        names = [motion.name for motion in datasets.load("gaits", split)]
        assert names == list(table.name[table.split == split]) != []
    first = table.name[0]
    assert [m.name for m in datasets.load("gaits", clips=[first])] == [first]
    assert "needs no file" in repr(datasets.info("gaits"))


@pytest.mark.parametrize(
    "call",
    [
        lambda: datasets.load("amass"),
        lambda: datasets.info("amass"),
        lambda: datasets.table("amass"),
        lambda: datasets.load("accad", "dev"),
        lambda: datasets.load("gaits", "dev"),
        lambda: datasets.load("gaits", clips=["nope"]),
        lambda: datasets.load("accad", clips=["Male1_B3_Wlak"]),
        lambda: datasets.load("accad", clips="Male1_B3_Walk"),
    ],
)
def test_unknown_names(call):
    with pytest.raises(MotionLabError, match=r"accad|train|gaits|Male1_B3_Walk"):
        call()
