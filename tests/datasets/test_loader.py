"""Loading from files on this machine, and the cache of parsed clips."""

import os
import re

import bvh_corpus as corpus
import numpy as np
import pytest
import torch
from tiny_bvh import tiny_bvh

from motionlab import datasets, write_bvh
from motionlab.datasets import gaits, registry
from motionlab.errors import BvhError, DataError

# toy clips begin at rest
pytestmark = pytest.mark.filterwarnings("ignore:.*from frame 0 to frame 1")


def same(a, b) -> bool:
    return (
        a.name == b.name
        and a.fps == b.fps
        and torch.equal(a.root_positions, b.root_positions)
        and torch.equal(a.rotations, b.rotations)
        and torch.equal(a.skeleton.offsets, b.skeleton.offsets)
    )


def parsed(toy):
    return sorted((toy.cache / "parsed").glob("*.npz"))


@pytest.mark.parametrize("place", ["zip", "tree", "bare tree"])
def test_load(toy, place):
    {"zip": toy.zip, "tree": toy.tree, "bare tree": lambda: toy.tree("")}[place]()
    motions = datasets.load("toy")
    assert [m.name for m in motions] == ["toy_01", "toy_02", "walk"]
    for motion in motions:
        assert (len(motion), motion.fps, motion.source) == (59, 60.0, "toy")
    # frame 0 is left out, centimetres are metres
    assert motions[0].root_positions[0].tolist() == pytest.approx([0.015, 0.9, 0.0])
    assert motions[2].skeleton.offsets[2].tolist() == pytest.approx([0, 0.305, 0.02])
    assert toy.server.requests == []


def test_the_data_folder_is_left_alone(toy):
    toy.zip()
    before = {p: p.stat().st_mtime_ns for p in toy.folder.rglob("*")}
    toy.folder.chmod(0o500)
    try:
        datasets.load("toy")
    finally:
        toy.folder.chmod(0o700)
    assert before == {p: p.stat().st_mtime_ns for p in toy.folder.rglob("*")}


def test_splits_and_clips(toy):
    toy.zip()
    assert [m.name for m in datasets.load("toy", "train")] == ["toy_01", "walk"]
    assert [m.name for m in datasets.load("toy", "test")] == ["toy_02"]
    assert datasets.load("toy", "val") == []
    assert [m.name for m in datasets.load("toy", clips=["walk", "toy_02"])] == ["toy_02", "walk"]
    assert [m.name for m in datasets.load("examples")] == ["walk", "toy_01"]  # as listed
    assert [m.name for m in datasets.load("toy", "test", clips=["walk"])] == []


def test_a_second_load_needs_no_files_and_gives_the_same_bits(toy):
    toy.zip()
    one_by_one = datasets.load("toy", clips=["toy_01"]) + datasets.load("toy", clips=["walk"])
    assert parsed(toy) == []  # part of a split is not cached
    first = datasets.load("toy")
    (toy.folder / "toy.zip").unlink()
    second = datasets.load("toy")
    assert all(map(same, first, second))
    assert all(map(same, one_by_one, [first[0], first[2]]))
    assert first[0].skeleton is not first[1].skeleton  # they differ
    assert same(datasets.load("toy", clips=["walk"])[0], first[2])
    assert toy.server.requests == []


def test_packing_loses_less_than_a_hundredth_of_a_millimetre(toy):
    from motionlab.io.bvh import parse_bvh

    toy.zip()
    for motion, data in zip(datasets.load("toy"), toy.contents.values(), strict=True):
        exact = parse_bvh(data, "clip", tpose_first=True).positions()
        assert (exact - motion.positions()).norm(dim=-1).max() < 1e-5


@pytest.mark.parametrize(
    "damage",
    [
        lambda data: b"",
        lambda data: b"rubbish" * 100,
        lambda data: data[: len(data) // 2],
        lambda data: data[:900] + bytes([data[900] ^ 255]) + data[901:],
        lambda data: data[:-900] + bytes([data[-900] ^ 255]) + data[-899:],
    ],
)
def test_a_damaged_cache_is_made_anew(toy, damage):
    toy.zip()
    first = datasets.load("toy")
    for path in parsed(toy):
        path.write_bytes(damage(path.read_bytes()))
    assert all(map(same, first, datasets.load("toy")))
    (toy.folder / "toy.zip").unlink()
    assert all(map(same, first, datasets.load("toy")))


def test_a_cache_of_objects_is_not_unpickled(toy):
    toy.zip()
    first = datasets.load("toy")

    class Bomb:
        def __reduce__(self):
            return os.mkdir, (str(toy.cache / "exploded"),)

    for path in parsed(toy):
        with np.load(path) as file:
            arrays = {**file, "roots": np.array([Bomb()], dtype=object)}
        np.savez(path, **arrays)
    assert all(map(same, first, datasets.load("toy")))
    assert not (toy.cache / "exploded").exists()


def test_the_cache_follows_the_table(toy, monkeypatch):
    toy.zip()
    datasets.load("toy")
    text = registry._text("clips.tsv").replace("\t60\t1\t", "\t30\t2\t")
    texts = {"clips.tsv": text, "sources.toml": registry._text("sources.toml")}
    monkeypatch.setattr(registry, "_text", texts.__getitem__)
    registry.clips.cache_clear()
    assert [(m.fps, len(m)) for m in datasets.load("toy")] == [(30.0, 58)] * 3


def test_a_cache_that_cannot_be_written_warns(toy, monkeypatch, tmp_path):
    toy.zip()
    (tmp_path / "file").write_text("in the way", encoding="utf-8")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "file"))
    with pytest.warns(UserWarning, match="XDG_CACHE_HOME"):
        assert len(datasets.load("toy", "test")) == 1


def test_no_such_data_folder(toy, monkeypatch, tmp_path):
    monkeypatch.setenv("MOTIONLAB_DATA", str(tmp_path / "nowhere"))
    with pytest.raises(DataError, match=r"MOTIONLAB_DATA is .*nowhere"):
        datasets.load("toy")


def test_wrong_hash(toy):
    wrong = dict(toy.contents)
    wrong["toy/02.bvh"] += b"\n"
    toy.zip(wrong)
    with pytest.raises(DataError, match=r"toy.zip:toy/02.bvh: .*SHA-256.*data fetch toy"):
        datasets.load("toy")
    assert [m.name for m in datasets.load("toy", "train")] == ["toy_01", "walk"]


def test_wrong_hash_in_a_tree(toy):
    toy.tree()
    (toy.folder / "toy/toy/02.bvh").write_bytes(b"something else")
    with pytest.raises(DataError, match=r"02\.bvh: .*SHA-256"):
        datasets.load("toy", "test")


@pytest.mark.parametrize("name", ["../x.bvh", "/etc/x.bvh", "a/../../x.bvh", "C:\\x.bvh", "..\\x"])
def test_a_zip_that_points_outside_is_refused(toy, tmp_path, name):
    toy.zip({**toy.contents, name: b"bad"})
    with pytest.raises(DataError, match=r"toy\.zip: member .* outside"):
        datasets.load("toy")
    assert not list(tmp_path.rglob("x*"))


def test_other_members_are_ignored(toy):
    toy.zip({**toy.contents, "toy/99.bvh": b"no clip", "README": b"hello"})
    assert len(datasets.load("toy")) == 3


@pytest.mark.parametrize("damage", [lambda d: b"", lambda d: b"PK", lambda d: d[:-40]])
def test_a_broken_zip(toy, damage):
    toy.zip()
    path = toy.folder / "toy.zip"
    path.write_bytes(damage(path.read_bytes()))
    with pytest.raises(DataError, match=r"toy\.zip: can't be opened"):
        datasets.load("toy")


def test_a_zip_with_a_broken_member(toy):
    toy.zip()
    path = toy.folder / "toy.zip"
    data = bytearray(path.read_bytes())
    data[200:260] = bytes(60)
    path.write_bytes(data)
    with pytest.raises(DataError, match=r"toy/01\.bvh: (can't be read|is not the file)"):
        datasets.load("toy")


def test_what_the_folder_lacks_comes_from_the_downloads(toy):
    toy.serve()
    datasets.load("toy", clips=["toy_01"])
    toy.zip({path: data for path, data in toy.contents.items() if path != "toy/01.bvh"})
    assert len(datasets.load("toy")) == 3
    assert toy.server.requests == ["/toy/01.bvh"]


# -- a reader's own clips -------------------------------------------------------------------------


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "mine/sub").mkdir(parents=True)
    (tmp_path / "mine/b.bvh").write_bytes(tiny_bvh(30, 1))
    (tmp_path / "mine/A.BVH").write_bytes(tiny_bvh(20, 2))
    (tmp_path / "mine/sub/c.bvh").write_bytes(tiny_bvh(10, 3))
    (tmp_path / "mine/notes.txt").write_text("not a clip", encoding="utf-8")
    return tmp_path / "mine"


def test_from_folder(folder):
    motions = datasets.from_folder(folder, fps=60)
    assert [(m.name, len(m)) for m in motions] == [("A", 20), ("b", 30), ("sub/c", 10)]
    assert all(m.fps == 60 and m.source == "mine" for m in motions)


def test_from_folder_options(folder):
    assert len(datasets.from_folder(folder, drop_zeros=True)[0]) == 19
    assert len(datasets.from_folder(folder, tpose_first=True)[0]) == 19
    assert [m.name for m in datasets.from_folder(folder, pattern="*.bvh")] == ["b"]
    metres = datasets.from_folder(folder, units=0.02)[0].skeleton.offsets[1, 1]
    assert float(metres) == pytest.approx(0.4)


def test_from_folder_splits(folder):
    parts = [datasets.from_folder(folder, split=split) for split in ("train", "val", "test")]
    assert sorted(m.name for part in parts for m in part) == ["A", "b", "sub/c"]
    assert all(len(part) == 1 for part in parts)


def test_from_folder_names_every_bad_file(folder):
    (folder / "bad1.bvh").write_bytes(b"no BVH at all")
    (folder / "bad2.bvh").write_bytes(tiny_bvh(30)[:-200])
    with pytest.raises(DataError, match=r"(?s)2 of 5 files.*bad1\.bvh, line 1.*bad2\.bvh, line"):
        datasets.from_folder(folder)
    with pytest.warns(UserWarning, match=r"bad1\.bvh"):
        assert len(datasets.from_folder(folder, skip_bad=True)) == 3


def test_what_is_doubtful_about_files_is_said_once(tmp_path):
    walk = gaits.make(seconds=1, speed=1.4)
    for name in "abcd":
        write_bvh(walk, tmp_path / f"{name}.bvh", units="in")
    (tmp_path / "d.bvh").write_bytes(tiny_bvh(9))
    text = (tmp_path / "c.bvh").read_text(encoding="utf-8")
    text = text.replace("Frames: 30", "Frames: 29")
    (tmp_path / "c.bvh").write_text(text, encoding="utf-8")
    with pytest.warns(UserWarning) as caught:
        assert len(datasets.from_folder(tmp_path)) == 4
    units, count = sorted((str(w.message) for w in caught), key=lambda said: "declares" in said)
    assert re.search(r"3 of 4 files, first .*a\.bvh: .*units='in'", units)
    assert re.match(r".*c\.bvh: the header declares 29", count)
    assert all(w.filename == __file__ for w in caught)


def test_from_folder_of_another_axis_of_several_bodies_of_joints_that_slide(folder):
    for file in folder.rglob("*.[bB][vV][hH]"):
        lies = file.read_text(encoding="utf-8").replace("20 0", "0 20").replace("10 0\n", "0 10\n")
        file.write_text(re.sub(r"30.5 (\d)", r"\1 30.5", lies), encoding="utf-8")
    with pytest.warns(UserWarning, match="3 of 3 files.*up='z'"):
        raw = datasets.from_folder(folder)
    for motion, turned in zip(raw, datasets.from_folder(folder, up="z"), strict=True):
        x, y, z = motion.positions().unbind(-1)
        torch.testing.assert_close(turned.positions(), torch.stack([x, z, -y], -1))
    slides = corpus.six_channels([(9, 0, 0), (9, 0, 5), (9, 0, 0)], "LeftArm")
    (folder / "b.bvh").write_text(slides, encoding="utf-8")
    with pytest.raises(DataError, match=r"(?s)1 of 3 files.*b\.bvh.*rigid='mean'"):
        datasets.from_folder(folder, up="z")
    with pytest.raises(DataError, match=r"(?s)3 of 3 files.*root= must be one of: Hips"):
        datasets.from_folder(folder, up="z", root="World")
    with pytest.warns(UserWarning) as caught:
        assert len(datasets.from_folder(folder, up="z", rigid="mean")) == 3
    said = sorted(str(warning.message) for warning in caught)
    about = ("from frame 0", "'LeftArm' the most", "up='y'")
    assert len(said) == 3 and all(any(what in each for each in said) for what in about)
    for wrong in ({"up": "w"}, {"units": "furlong"}, {"rigid": "yes"}):
        with pytest.raises(BvhError):  # once, not for each file
            datasets.from_folder(folder, **wrong)


def test_from_folder_that_is_empty_or_absent(tmp_path):
    (tmp_path / "empty").mkdir()
    with pytest.raises(DataError, match=r"no file ends in \.bvh, \.amc, \.glb or \.gltf; "):
        datasets.from_folder(tmp_path / "empty")
    with pytest.raises(DataError, match="is not a folder"):
        datasets.from_folder(tmp_path / "absent")
    with pytest.raises(DataError, match="None is not a path"):
        datasets.from_folder(None)


# -- the real clips -------------------------------------------------------------------------------


@pytest.mark.usefixtures("recorded_clips")
def test_real_examples(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    motions = datasets.load("examples", download=False)
    clips = {(clip.source, clip.name): clip for clip in registry.members("examples")}
    assert len(motions) == 14
    for motion in motions:
        clip = clips[motion.source, motion.name]
        assert (len(motion), motion.fps) == (clip.frames, clip.fps)
        points = motion.positions()
        assert 1.0 < points[..., 1].amax() < 2.6  # metres
        # no frame jumps: T-poses and what surrounds them are gone
        speed = (points[1:] - points[:-1]).norm(dim=-1).amax(-1) * motion.fps
        assert speed[:5].amax() < 15, motion


def test_wanted_clips_may_come_from_a_generator():
    assert [m.name for m in datasets.load("gaits", clips=(n for n in ["stand"]))] == ["stand"]
