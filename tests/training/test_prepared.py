"""Prepared data: what is in them, and that files are whole or refused."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch
from other_axes import redrawn

from motionlab import Skeleton, datasets, roles, write_bvh
from motionlab.__main__ import main
from motionlab.datasets import gaits as made
from motionlab.datasets import registry
from motionlab.encodings import JointAngles, Normalizer
from motionlab.errors import DataError, TrainingError
from motionlab.training import Prepared, prepare
from motionlab.training.prepared import file_of


def test_rows_are_the_encoded_clips(gaits):
    encoding = JointAngles(Skeleton.canonical(), contacts=True)
    for split in ("val", "test"):
        motions = datasets.load("gaits", split)
        for motion, clip in zip(motions, gaits.clips(split), strict=True):
            assert torch.equal(encoding.encode(motion), clip)
    training = datasets.load("gaits", "train", mirrored=True)
    assert [f"{m.source}/{m.name}" for m in training] == list(gaits.names[: len(training)])
    for motion, clip in zip(training, gaits.clips("train"), strict=True):
        assert torch.equal(encoding.encode(motion), clip)
    its = Normalizer.fit(gaits.clips("train")).state_dict()
    assert all(torch.equal(v, its[k]) for k, v in gaits.normalizer.state_dict().items())


def test_no_mirrored_copy_leaves_its_split(gaits):
    where = {}
    for name, split in zip(gaits.names, gaits.splits, strict=True):
        assert where.setdefault(name.removesuffix("_mirrored"), split) == split
    assert {s for n, s in zip(gaits.names, gaits.splits, strict=True) if "mirrored" in n} == {
        "train"
    }


def test_saved_and_loaded(gaits, tmp_path):
    gaits.save(tmp_path / "new" / "gaits.npz")
    back = Prepared.load(tmp_path / "new" / "gaits.npz")
    assert torch.equal(back.features, gaits.features) and torch.equal(back.lengths, gaits.lengths)
    assert (back.names, back.splits, back.hash) == (gaits.names, gaits.splits, gaits.hash)
    assert back.encoding.config() == gaits.encoding.config()
    its = back.normalizer.state_dict()
    assert all(torch.equal(v, its[k]) for k, v in gaits.normalizer.state_dict().items())


def test_without_contacts_is_the_encoding_without(gaits):
    plain = gaits.without_contacts()
    motion = datasets.load("gaits", "val")[0]
    assert torch.equal(plain.encoding.encode(motion), plain.clips("val")[0])
    its = Normalizer.fit(plain.clips("train")).state_dict()
    for name, value in plain.normalizer.state_dict().items():
        torch.testing.assert_close(value, its[name])


def test_data_match_an_encoding_that_has_no_contacts(gaits):
    plain = gaits.without_contacts()
    assert gaits.matching(gaits.encoding) is gaits and plain.matching(plain.encoding) is plain
    found = gaits.matching(plain.encoding)
    assert torch.equal(found.features, plain.features) and found.hash == gaits.hash
    assert found.encoding.config() == plain.encoding.config()
    fast = JointAngles(Skeleton.canonical(), fps=60.0)
    for data, encoding in ((plain, gaits.encoding), (gaits, fast), (plain, fast)):
        with pytest.raises(TrainingError, match="features of another kind than the model's"):
            data.matching(encoding)


def test_the_hash_tells_data_apart(gaits, tmp_path):
    gaits.save(tmp_path / "gaits.npz")
    with np.load(tmp_path / "gaits.npz") as file:
        arrays = dict(file)
    arrays["features"][1000, 5] += 1e-3
    np.savez(tmp_path / "other.npz", **arrays)
    with pytest.raises(DataError, match="hash does not fit"):
        Prepared.load(tmp_path / "other.npz")


def test_files_that_are_not_prepared_data(gaits, tmp_path):
    with pytest.raises(DataError, match="no such file.*motionlab prepare"):
        Prepared.load(tmp_path / "none.npz")
    gaits.save(tmp_path / "half.npz")
    half = (tmp_path / "half.npz").read_bytes()
    for content in (b"", b"no archive", half[: len(half) // 2]):
        (tmp_path / "half.npz").write_bytes(content)
        with pytest.raises(DataError, match="not a whole file"):
            Prepared.load(tmp_path / "half.npz")
    np.savez(tmp_path / "else.npz", a=np.zeros(3))
    with (tmp_path / "array.npz").open("wb") as stream:
        np.save(stream, np.zeros(3))
    for name in ("else", "array"):
        with pytest.raises(DataError, match="not a whole file"):
            Prepared.load(tmp_path / f"{name}.npz")


def test_a_save_that_fails_leaves_the_old_file(gaits, tmp_path, monkeypatch):
    path = tmp_path / "gaits.npz"
    gaits.save(path)
    old = path.read_bytes()

    def full(stream, **arrays):
        stream.write(b"some of it")
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(np, "savez", full)
    with pytest.raises(DataError, match="No space left"):
        replace(gaits, hash="new").save(path)
    assert path.read_bytes() == old and list(tmp_path.iterdir()) == [path]


def test_unknown_names(tmp_path):
    with pytest.raises(DataError, match="is not a folder"):
        prepare(tmp_path / "nothing")


def test_a_folder_is_not_taken_for_the_data_set_of_its_name(tmp_path, monkeypatch):
    folder = tmp_path / "mine" / "gaits"
    folder.mkdir(parents=True)
    monkeypatch.chdir(tmp_path)
    assert file_of("gaits") == Path("runs/gaits.npz")
    assert file_of(folder) == Path("runs/gaits-folder.npz") == file_of("mine/gaits")
    assert file_of(tmp_path / "mine") == Path("runs/mine.npz")


def test_a_prepared_file_may_have_any_name(gaits, tmp_path):
    gaits.save(tmp_path / "data")
    assert Prepared.find(tmp_path / "data").hash == gaits.hash


def test_a_folder_of_bvh_files(tmp_path, monkeypatch):
    folder = tmp_path / "mine"
    folder.mkdir()
    for i, motion in enumerate(datasets.load("gaits", "val") + datasets.load("gaits", "test")):
        write_bvh(motion[:40], folder / f"{i}.bvh")
    monkeypatch.chdir(tmp_path)
    assert main(["prepare", "mine"]) == 0
    mine = Prepared.load("runs/mine.npz")
    assert mine.splits.count("train") == 2 * 6 and mine.splits.count("val") == 1
    assert mine.lengths.tolist() == [40] * len(mine.names)


def test_permissive_data_may_be_used_commercially(real_clips, monkeypatch, tmp_path, capsys):
    every = registry.members("locomotion")
    few = [c for c in every if c.source in ("accad", "cmu") or c.name.startswith("dataset-1_run_a")]
    monkeypatch.setattr(registry, "members", lambda name: few)  # the others take a minute
    monkeypatch.chdir(tmp_path)
    assert main(["prepare", "locomotion", "--permissive"]) == 0
    data = Prepared.load(tmp_path / "runs" / "locomotion-permissive.npz")
    sources = {name.split("/")[0] for name in data.names}
    assert sources and all(datasets.info(source).commercial for source in sources)
    assert len(data.clips("train")) > len(data.clips("val")) > 0


def test_of_a_folder_nobody_knows_the_licences(tmp_path):
    with pytest.raises(DataError, match="licences"):
        prepare(tmp_path, permissive=True)


@pytest.mark.parametrize("units", ["m", "1"])
def test_a_folder_in_other_units_with_a_bad_file(tmp_path, monkeypatch, capsys, units):
    for name, unit in (("centimetres", "cm"), ("metres", "m")):
        for i, motion in enumerate(datasets.load("gaits", "val") + datasets.load("gaits", "test")):
            (tmp_path / name).mkdir(exist_ok=True)
            write_bvh(motion[:40], tmp_path / name / f"{i}.bvh", units=unit)
    (tmp_path / "metres" / "bad.bvh").write_text("no motion")
    monkeypatch.chdir(tmp_path)
    assert main(["prepare", "metres", "--units", units]) == 1
    assert "bad.bvh" in capsys.readouterr().err and not Path("runs").exists()
    with pytest.warns(UserWarning, match=r"bad\.bvh"):
        assert main(["prepare", "metres", "--units", units, "--skip-bad"]) == 0
    assert main(["prepare", "centimetres"]) == 0
    metres, centimetres = (Prepared.load(f"runs/{name}.npz") for name in ("metres", "centimetres"))
    torch.testing.assert_close(metres.features, centimetres.features, atol=1e-5, rtol=0)


def test_a_file_of_a_rig_that_nobody_knows_is_named_or_left_out(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    motions = datasets.load("gaits", "val") + datasets.load("gaits", "test")
    for i, motion in enumerate(motions):
        write_bvh(motion[:40], _folder("clips") / f"{i}.bvh")
    other = Skeleton(("a", "b"), (-1, 0), torch.zeros(2, 3))
    names = {tuple(prepare("clips").names)}
    odd = replace(motions[0], skeleton=other, rotations=motions[0].rotations[:, :2], contacts=None)
    for i in (3, 4):
        write_bvh(odd, f"clips/x{i}.bvh")
    assert main(["prepare", "clips"]) == 1
    said = capsys.readouterr().err
    assert all(f"x{i}.bvh: The motion's skeleton has no joint" in said for i in (3, 4))
    with pytest.warns(UserWarning, match=r"(?s)2 of \d+ files.*x3\.bvh.*x4\.bvh") as caught:
        assert main(["prepare", "clips", "--skip-bad"]) == 0
    assert len(caught) == 1
    names.add(Prepared.load("runs/clips.npz").names)
    assert len(names) == 1


def test_a_folder_whose_z_is_up(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    turn = torch.tensor([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])  # to z-up
    for i, motion in enumerate(datasets.load("gaits", "val") + datasets.load("gaits", "test")):
        write_bvh(motion[:40], _folder("y") / f"{i}.bvh")
        its = motion.skeleton
        skeleton = Skeleton(its.names, its.parents, its.offsets @ turn.T, its.end_parents,
                            its.end_offsets @ turn.T)  # fmt: skip
        turned = replace(
            motion, skeleton=skeleton, root_positions=motion.root_positions @ turn.T,
            rotations=turn @ motion.rotations @ turn.T,
        )  # fmt: skip
        write_bvh(turned[:40], _folder("z") / f"{i}.bvh")
    assert main(["prepare", "y"]) == main(["prepare", "z", "--up", "z"]) == 0
    y, z = (Prepared.load(f"runs/{name}.npz") for name in "yz")
    torch.testing.assert_close(y.features, z.features, atol=1e-4, rtol=0)
    assert main(["prepare", "z", "--up", "w"]) == 1


def _folder(name: str) -> Path:
    Path(name).mkdir(exist_ok=True)
    return Path(name)


def test_how_named_data_are_read_is_no_question():
    with pytest.raises(DataError, match="leave out units"):
        prepare("gaits", units="m")


def test_a_folder_of_a_rig_with_names_of_its_own_is_read_by_a_table_of_roles(tmp_path, capsys):
    folder = tmp_path / "clips"
    folder.mkdir()
    plain = made.make(seconds=2, speed=1.2)
    odd = tuple(f"bone{joint}" for joint in range(plain.skeleton.joints))
    for clip in range(12):
        motion = made.make(seconds=2, speed=1.2 + clip / 20)
        skeleton = replace(motion.skeleton, names=odd)
        write_bvh(replace(motion, skeleton=skeleton), folder / f"walk_{clip}.bvh")
    assert main(["prepare", str(folder), "--out", str(tmp_path / "made.npz")]) == 1
    assert "walk_0.bvh" in capsys.readouterr().err
    table = "".join(f'{role} = "bone{joint}"\n' for role, joint in plain.skeleton.roles.items())
    (tmp_path / "rig.toml").write_text(table)
    given = ["--roles", str(tmp_path / "rig.toml"), "--out", str(tmp_path / "made.npz")]
    assert main(["prepare", str(folder), *given]) == 0
    clip = datasets.from_folder(folder, roles=roles.read(tmp_path / "rig.toml"))[0].retarget()
    expected = made.make(seconds=2, speed=1.2)
    assert (clip.positions() - expected.positions()).norm(dim=-1).max() < 0.02
    (tmp_path / "rig.toml").write_text('hips = "Becken"\n')
    assert main(["prepare", str(folder), *given]) == 1
    said = capsys.readouterr().err
    assert "walk_0.bvh" in said and "no such joint" in said


# -- few clips, of any rig ------------------------------------------------------------------------


@pytest.mark.parametrize("seconds", [(70,), (40, 45), (35, 4)])
def test_one_or_two_long_recordings_are_split_by_time(tmp_path, monkeypatch, seconds):
    monkeypatch.chdir(tmp_path)
    whole = [made.make(seconds=s, speed=1.3, seed=s) for s in seconds]
    for motion, s in zip(whole, seconds, strict=True):
        write_bvh(motion, _folder("mine") / f"take{s}.bvh")
    with pytest.warns(
        UserWarning, match=r"mine: \d clips are too few .* split by time: train \d+ s"
    ):
        assert main(["prepare", "mine"]) == 0
    data = Prepared.load("runs/mine.npz")
    assert all(data.clips(split) for split in ("train", "val", "test"))
    assert any(re.fullmatch(r"mine/take\d+, \d+ to \d+ s_mirrored", name) for name in data.names)
    assert sum(map(len, data.clips("val"))) > 64  # a window of training
    assert sum(map(len, data.clips("train"))) / 60 > 0.6 * sum(seconds)
    if len(seconds) == 1:  # its parts are what was recorded then
        encoding = JointAngles(Skeleton.canonical(), contacts=True)
        name = data.names[data.splits.index("val")]
        first, last = (30 * int(word) for word in re.findall(r"(\d+) to (\d+) s", name)[0])
        wanted, found = whole[0].positions()[first:last], encoding.positions(data.clips("val")[0])
        frames = range(-15, 16)  # seconds in names are rounded
        gaps = [
            (found[60, 4] - found[60, 0] - wanted[60 + i, 4] + wanted[60 + i, 0]).norm()
            for i in frames
        ]
        assert min(gaps) < 0.02


def test_too_little_says_how_much_is_needed(tmp_path):
    for name in ("a", "b"):
        write_bvh(made.make(seconds=5), tmp_path / f"{name}.bvh")
    with pytest.raises(DataError, match=r"has 2 clips, the longest of 5\.0 s.*3 clips.*than 30 s"):
        prepare(tmp_path)


def test_three_clips_are_enough_unless_one_is_bad(tmp_path):
    for name in ("a", "b", "c"):
        write_bvh(made.make(seconds=32), tmp_path / f"{name}.bvh")
    data = prepare(tmp_path)
    (held_out,) = [n[-1] for n, s in zip(data.names, data.splits, strict=True) if s == "val"]
    (tmp_path / f"{held_out}.bvh").write_text("no motion")
    with pytest.warns(UserWarning) as caught:
        data = prepare(tmp_path, skip_bad=True)
    assert "1 of 3 files" in str(caught[0].message) and "split by time" in str(caught[1].message)
    assert data.clips("val")


def test_the_command_line_reads_a_folder_as_the_library_does(tmp_path, monkeypatch, capsys):
    """A rig whose rest pose is no body, a T-pose in front, zeros before it, half the true rate."""
    monkeypatch.chdir(tmp_path)
    names = "abc"
    for i, name in enumerate(names):
        clip = redrawn(made.make(seconds=2, speed=1 + i / 4), 1)
        zeros = replace(clip[:1], rotations=torch.eye(3).expand(1, 21, 3, 3))
        write_bvh(replace(clip[:1] + zeros + clip, fps=15.0), _folder("mine") / f"{name}.bvh")
    write_bvh(redrawn(made.make(seconds=1, speed=0.0), 1), "stands.bvh")
    given = ["--fps", "30", "--tpose-first", "--drop-zeros", "--reference", "stands.bvh"]
    assert main(["prepare", "mine", *given]) == 0
    data = Prepared.load("runs/mine.npz")
    assert data.lengths.tolist() == [60] * len(data.names)
    encoding = JointAngles(Skeleton.canonical(), contacts=True)
    for i, name in enumerate(names):
        clip = data.features.split(60)[data.names.index(f"mine/{name}")]
        wanted = made.make(seconds=2, speed=1 + i / 4).positions()
        reach = [(p - p[:, :1]).norm(dim=-1) for p in (encoding.positions(clip), wanted)]
        assert (reach[0] - reach[1]).abs().max() < 0.03  # of each point from the hips
    assert main(["prepare", "mine", *given[:-1], "mine/a.bvh"]) == 1
    assert "at no time does the body stand" in capsys.readouterr().err
    assert main(["prepare", "gaits", *given]) == 1
    assert "leave out fps, tpose_first, drop_zeros, reference" in capsys.readouterr().err
    assert main(["prepare", "mine", "--fps", "0"]) == 1
    assert "fps=0" in capsys.readouterr().err


def test_a_prepared_file_has_been_read(gaits, tmp_path):
    gaits.save(tmp_path / "gaits.npz")
    with pytest.raises(DataError, match="leave out units"):
        Prepared.find(tmp_path / "gaits.npz", units="m")


def test_an_axis_that_was_said_and_is_wrong_is_told_with_all_clips(tmp_path):
    """That y is up is how to say that people lie, so reading says nothing; a network would learn it."""
    for i in range(10):
        up = "z" if i in (3, 4) else "y"
        write_bvh(made.make(seconds=1, speed=1 + i / 10, seed=i), tmp_path / f"{i}.bvh", up=up)
    with pytest.warns(UserWarning) as caught:
        prepare(tmp_path, up="y")
    (said,) = [str(w.message) for w in caught if "learn to lie" in str(w.message)]
    assert "in 2 of 10 clips, read with the up that was said" in said and "frame: 3, 4." in said
