"""`motionlab convert`, `retarget`, `clean`, `look`: what is written, told and left; what is refused stands in test_refused.py."""

from __future__ import annotations

import warnings
from dataclasses import replace
from pathlib import Path

import any_rig
import pytest
import tiny_acclaim
import torch
from glb_reader import Glb

from motionlab import Motion, Skeleton, read_bvh, write_bvh
from motionlab.__main__ import main
from motionlab.contacts import label
from motionlab.datasets import gaits

WALK = gaits.make(seconds=1, speed=1.2, name="walk")
COMMANDS = ("convert", "retarget", "clean")


@pytest.fixture
def bad(here):
    """The folder with a file that can't be read, which comes first."""
    (here / "clips" / "0.bvh").write_text("HIERARCHY\n")
    return here


def same(found: Motion, wanted: Motion, metres: float = 1e-4) -> bool:
    return bool((found.positions() - wanted.positions()).abs().max() < metres)


# -- what is written ------------------------------------------------------------------------------


def test_convert_a_file(here, capsys):
    assert main(["convert", "walk.bvh", "--out", "x.bvh"]) == 0
    assert capsys.readouterr().out == "x.bvh: 30 frames at 30 fps, 21 joints\n"
    assert same(read_bvh("x.bvh"), WALK)
    assert main(["convert", "walk.bvh", "--out", "x.glb", "--fps", "15"]) == 0
    assert "x.glb: 15 frames at 15 fps, 21 joints (read: 30 at 30)" in capsys.readouterr().out
    points = torch.from_numpy(Glb("x.glb").worlds(15)[:, :26, :3, 3]).float()
    torch.testing.assert_close(points, WALK[::2].positions(), rtol=0, atol=1e-4)


@pytest.mark.parametrize("root_motion", [[], ["--root-motion", "ground"]])
def test_there_and_back(here, root_motion):
    """A root joint on the floor is folded into the body again."""
    assert main(["convert", "walk.bvh", "--out", "x.glb", *root_motion]) == 0
    assert main(["convert", "x.glb", "--out", "y.bvh"]) == 0
    assert same(read_bvh("y.bvh"), WALK)
    assert main(["look", "x.glb"]) == 0


def test_convert_reads_as_it_is_told(here):
    axes = torch.tensor([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]]).repeat(21, 1, 1)
    odd = any_rig.drawn(WALK, axes)  # z up, also in the rest pose
    turned = torch.cat([axes[:1] .mT @ odd.rotations[:, :1], odd.rotations[:, 1:]], 1)  # fmt: skip
    odd = replace(odd, root_positions=WALK.root_positions @ axes[0], rotations=turned)
    names = [name.replace("LeftHand", "Paw") for name in odd.skeleton.names]
    write_bvh(replace(odd, skeleton=replace(odd.skeleton, names=names)), "odd.bvh", units="in")
    (here / "rig.toml").write_text('left_hand = "Paw"\n')
    command = ["convert", "odd.bvh", "--out", "x.bvh", "--up", "z", "--units", "in"]
    assert main([*command, "--roles", "rig.toml"]) == 0
    assert same(read_bvh("x.bvh", roles={"left_hand": "Paw"}), WALK)


def test_root_motion(here, capsys):
    assert main(["convert", "walk.bvh", "--out", "x.bvh", "--root-motion", "ground"]) == 0
    said = "21 joints; below a root joint on the floor, called Root, for way and heading\n"
    assert said in capsys.readouterr().out
    assert same(read_bvh("x.bvh"), WALK) and "ROOT Root" in (here / "x.bvh").read_text()
    assert main(["convert", "x.bvh", "--out", "z.bvh", "--root-motion", "ground"]) == 0
    assert said in capsys.readouterr().out  # no second root is added
    count = lambda file: sum(word in ("ROOT", "JOINT") for word in Path(file).read_text().split())
    assert count("x.bvh") == count("z.bvh") == 22
    assert main(["convert", "walk.bvh", "--out", "y.bvh", "--root-motion", "in-place"]) == 0
    assert read_bvh("y.bvh").positions()[:, 0, [0, 2]].abs().max() < 1e-4


def test_onto_the_canonical_body(here):
    larger = replace(WALK.skeleton, offsets=1.2 * WALK.skeleton.offsets)
    write_bvh(WALK.retarget(larger), "large.bvh")
    assert main(["retarget", "large.bvh", "--out", "x.bvh"]) == 0
    assert read_bvh("x.bvh").skeleton.matches(Skeleton.canonical())


def test_clips_of_one_rig_get_one_set_of_axes(here, capsys):
    """Told by one in which a person stands, named or not; none of the others does."""
    axes = any_rig.random_axes(21, 4)
    stance = Motion(WALK.skeleton, torch.zeros(9, 3), torch.eye(3).repeat(9, 21, 1, 1), 30)
    for name, motion in {"rig/walk": WALK, "rig/run": gaits.make(seconds=1, speed=3.0)}.items():
        (here / "rig").mkdir(exist_ok=True)
        write_bvh(any_rig.drawn(motion, axes), f"{name}.bvh")
    write_bvh(any_rig.drawn(stance, axes), "stands.bvh")
    command = ["retarget", "rig", "--out", "done", "--force"]
    assert main([*command, "--reference", "stands.bvh"]) == 0
    named = read_bvh("done/walk.bvh")
    (here / "stands.bvh").rename("rig/stands.bvh")
    capsys.readouterr()
    assert main(command) == 0
    assert "rest pose of 3 clips of one rig is no standing body" in capsys.readouterr().out
    assert same(read_bvh("done/walk.bvh"), named)
    assert same(named, WALK, 0.03)  # whose contacts are guessed
    assert main([*command[:-2], "x", "--reference", "none.bvh"]) == 1
    assert "none.bvh: can't be opened" in capsys.readouterr().err


def test_clean_holds_feet(here, capsys):
    sliding = WALK.root_positions + torch.tensor([0.0, 0.0, 0.3]) * torch.arange(30)[:, None] / 30
    write_bvh(replace(WALK, root_positions=sliding), "slides.bvh")
    assert main(["clean", "slides.bvh", "--out", "x.bvh"]) == 0
    said = capsys.readouterr().out
    assert "toes down " in said and "sliding 30.0 cm/s and now 0.0" in said
    found = read_bvh("x.bvh")
    toes = found.positions()[
        :, [found.skeleton.role("left_toes"), found.skeleton.role("right_toes")]
    ]
    down = label(found, "speed-height")[:, [1, 3]] & WALK.contacts[:, [1, 3]]
    assert (torch.diff(toes, dim=0).norm(dim=-1)[down[1:] & down[:-1]]).median() < 1e-3


def test_clean_leaves_what_needs_none(here):
    assert main(["clean", "walk.bvh", "--out", "x.bvh"]) == 0
    assert same(read_bvh("x.bvh"), WALK, 0.02)


def test_clean_of_a_flight(here, capsys):
    """Nobody touches a floor that is rushing by."""
    flying = WALK.root_positions + torch.tensor([0.0, 0.0, 9.0]) * torch.arange(30)[:, None] / 30
    write_bvh(replace(WALK, root_positions=flying), "flies.bvh")
    assert main(["clean", "flies.bvh", "--out", "x.bvh"]) == 0
    assert "no toe rests, so that nothing was changed" in capsys.readouterr().out
    assert same(read_bvh("x.bvh"), read_bvh("flies.bvh"))


def test_look_makes_a_page_that_needs_nothing_else(here, capsys, monkeypatch):
    assert main(["look", "walk.bvh"]) == 0
    assert capsys.readouterr().out.startswith("walk.html: 21 joints, 30 frames, 1.00 s, 30 fps")
    page = (here / "walk.html").read_text(encoding="utf-8")
    assert "motionlab-player" in page and "<title>walk</title>" in page
    assert page.count("</script>") == 2  # of the data and of the player
    assert 'src="' not in page.split("<noscript>")[0] and '<link rel="stylesheet' not in page
    opened = []
    monkeypatch.setattr("webbrowser.open", opened.append)
    assert main(["look", "walk.bvh", "--out", "y.html", "--open"]) == 0
    assert opened == [(here / "y.html").as_uri()]
    assert main(["look", "clips"]) == 0
    assert (here / "clips_pages" / "more" / "b.html").exists()


def test_what_is_doubtful_stands_on_the_page(here):
    """Who gets the page never sees what the command said."""
    write_bvh(WALK, "lies.bvh", units="m", up="z")
    (here / "two").mkdir()
    Path("lies.bvh").rename("two/lies.bvh")
    write_bvh(WALK, "two/walk.bvh")
    assert main(["look", "two"]) == 0
    lies, fine = (Path(f"two_pages/{name}.html").read_text("utf-8") for name in ("lies", "walk"))
    before = lies.split("<figure")[0]
    assert before.count('<p class="note">') == 2
    assert "read it with --up=z" in before and "pass another unit: --units=m" in before
    assert 'class="note"' not in fine


# -- folders --------------------------------------------------------------------------------------


@pytest.mark.parametrize("command", COMMANDS)
def test_a_folder(here, capsys, command):
    assert main([command, "clips", "--out", "done", "--to", "glb"]) == 0
    assert written(here / "done") == {"a.glb", "more/b.glb"}
    out = capsys.readouterr().out.splitlines()
    assert [line.split(":")[0] for line in out] == ["done/a.glb", "done/more/b.glb"]


def test_one_bad_file_stops_no_other(bad, capsys):
    assert main(["convert", "clips", "--out", "done"]) == 1
    said = capsys.readouterr().err
    assert "clips: 1 of 3 files failed:\n  clips/0.bvh" in said and "--skip-bad" in said
    assert written(bad / "done") == {"a.bvh", "more/b.bvh"}
    assert main(["convert", "clips", "--out", "done", "--skip-bad", "--force"]) == 0
    assert "clips/0.bvh" in capsys.readouterr().out


@pytest.mark.parametrize("skip", [[], ["--skip-bad"]])
def test_files_that_are_there_did_not_fail(bad, capsys, skip):
    """A first run wrote all but the bad one; whoever then does as it says gets on."""
    command = ["convert", "clips", "--out", "done"]
    assert main(command) == 1
    said = capsys.readouterr().err
    assert "pass --skip-bad" in said and "done again, pass --force" in said
    assert main([*command, *skip]) == 1
    said = capsys.readouterr().err
    assert "clips: 2 of 3 files are not written anew:\n  done/a.bvh: is there already" in said
    assert said.count("--force overwrites it, another --out leaves it") == 2
    assert "clips: 1 of 3 files failed:\n  clips/0.bvh" in said and "None was done" not in said
    write_bvh(WALK, "clips/new.bvh")
    assert main([*command, *skip]) == 1  # what is new is done all the same
    assert "done/new.bvh: 30 frames" in capsys.readouterr().out
    assert main([*command, "--skip-bad", "--force"]) == 0


@pytest.mark.parametrize("command", COMMANDS)
def test_a_line_says_that_a_body_was_perhaps_read_wrongly(here, capsys, command):
    """Lying, or of no person's size, it is written like the others, and hangs in the air."""
    for name, its in {"clips/lies": {"up": "z"}, "clips/small": {"units": "in"}}.items():
        write_bvh(WALK, f"{name}.bvh", **its)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # that axes are a guess
        assert main([command, "clips", "--out", "done"]) == 0
    out = [each for each in capsys.readouterr().out.splitlines() if not each.startswith("note: ")]
    fine, lies, _, small, last = out
    assert fine.startswith("done/a.bvh: 30 frames")
    assert lies.startswith("done/lies.bvh: lies throughout: read with --up=z? 30 frames")
    assert small.startswith("done/small.bvh: of no person's size: read with --units=in? 30 frames")
    assert last == ("clips: 4 of 4 files are written; perhaps read wrongly: "
                    "1 lies throughout, 1 of no person's size")  # fmt: skip
    assert main([command, "clips/lies.bvh", "--up", "z", "--out", "x.bvh"]) == 0
    assert "x.bvh: 30 frames" in capsys.readouterr().out
    write_bvh(WALK, "down.bvh", up="-y")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        assert main([command, "down.bvh", "--out", "y.bvh"]) == 0
    said = capsys.readouterr().out
    assert "y.bvh: head down throughout: read with --up=-y?" in said
    assert said.splitlines()[-1] == (
        "y.bvh: is written, and perhaps wrong: head down throughout. Unless it is meant so, write it "
        "again with --up=-y --force"
    )


def test_a_folder_into_itself_is_not_read_twice(here):
    for _ in range(2):
        assert main(["convert", "clips", "--out", "clips/done", "--to", "bvh", "--force"]) == 0
    assert written(here / "clips") == {
        "a.bvh", "more/b.bvh", "notes.txt", "done/a.bvh", "done/more/b.bvh",
    }  # fmt: skip


def test_a_doubt_is_told_once(here, capsys):
    assert main(["convert", "clips", "--out", "done", "--units", "m"]) == 0
    (note,) = [line for line in capsys.readouterr().out.splitlines() if line.startswith("note")]
    assert "clips, 2 of 2 files, first clips/a.bvh: from foot to head the body measures" in note
    assert "pass another unit: --units=cm" in note


def written(folder) -> set[str]:
    return {p.relative_to(folder).as_posix() for p in folder.rglob("*") if p.is_file()}


# -- what goes wrong on the way -------------------------------------------------------------------


def test_a_wrong_frame_time_is_mended_as_it_is_said(here, capsys):
    text = (here / "walk.bvh").read_text().replace("Frame Time: 0.03333333333", "Frame Time: 30")
    (here / "rate.bvh").write_text(text)
    assert main(["convert", "rate.bvh", "--out", "x.bvh"]) == 1
    assert "read the file with --file-fps=30" in capsys.readouterr().err
    assert main(["convert", "rate.bvh", "--out", "x.bvh", "--file-fps=30"]) == 0
    assert same(read_bvh("x.bvh"), WALK)


def test_a_rig_without_legs(here, capsys):
    s = WALK.skeleton
    kept = [
        i for i, name in enumerate(s.names) if not any(w in name for w in ("Leg", "Foot", "Toe"))
    ]
    bust = Skeleton([s.names[i] for i in kept], [kept.index(s.parents[i]) if i else -1 for i in kept],
                    s.offsets[kept])  # fmt: skip
    write_bvh(replace(WALK, skeleton=bust, rotations=WALK.rotations[:, kept]), "bust.bvh")
    assert main(["convert", "bust.bvh", "--out", "x.glb", "--root-motion", "ground"]) == 0
    assert main(["look", "bust.bvh"]) == 0
    for command in ("retarget bust.bvh", "clean bust.bvh", "retarget walk.bvh --onto bust.bvh"):
        assert main([*command.split(), "--out", "y.bvh"]) == 1
        err = capsys.readouterr().err
        assert "bust.bvh: " in err and "left_foot" in err, command
    assert "--rig-roles" in err
    assert not (here / "y.bvh").exists()


def test_acclaim_s_skeleton_is_named_where_it_lies_elsewhere(here, capsys):
    (here / "body.asf").write_text(tiny_acclaim.asf())
    (here / "deep").mkdir()
    (here / "deep" / "walk.amc").write_text(tiny_acclaim.amc(tiny_acclaim.sway(5)))
    command = ["convert", "deep", "--out", "done"]
    assert main(command) == 1
    assert "--skeleton" in capsys.readouterr().err
    assert main([*command, "--skeleton", "body.asf"]) == 0
    assert written(here / "done") == {"walk.bvh"}


def test_two_files_that_would_be_one(here, capsys):
    write_bvh(WALK, here / "clips" / "a.BVH")
    assert main(["convert", "clips", "--out", "done", "--force"]) == 1
    assert capsys.readouterr().err.count("would become done/a.bvh, as another file would") == 2
    assert written(here / "done") == {"more/b.bvh"}


def test_a_file_into_a_folder_that_is_not_there_yet(here):
    assert main(["convert", "walk.bvh", "--out", "new/deep/x.glb"]) == 0
    assert written(here / "new") == {"deep/x.glb"}


def test_a_file_into_a_folder_that_is_there(here):
    (here / "done").mkdir()
    assert main(["convert", "walk.bvh", "--out", "done", "--to", "glb"]) == 0
    assert written(here / "done") == {"walk.glb"}


def test_what_fails_half_way_leaves_nothing(here, capsys, monkeypatch):
    monkeypatch.setattr("os.replace", lambda *_: (_ for _ in ()).throw(OSError(28, "disk full")))
    for target in ("x.bvh", "x.glb"):
        assert main(["convert", "walk.bvh", "--out", target]) == 1
        assert "disk full" in capsys.readouterr().err
    assert main(["look", "walk.bvh"]) == 1
    assert not [p for p in written(here) if p.startswith(("x.", "walk.html", "."))]


def test_a_warning_is_a_line_of_its_own_without_code(here, monkeypatch):
    from motionlab.commands.info import Info

    monkeypatch.setattr(Info, "run", lambda self: said.append(warnings.formatwarning(*about)))
    said, about = [], ("clips: half of them lie; pass up='z'", UserWarning, "loader.py", 12)
    before = warnings.formatwarning
    assert main(["info", "walk.bvh"]) == 0
    assert said == ["note: clips: half of them lie; pass --up=z\n"]
    assert warnings.formatwarning is before


@pytest.mark.parametrize("way", [["--up", "-z"], ["--up=-z"]])
def test_an_axis_that_points_down_is_no_option(here, way, capsys):
    assert main(["convert", "walk.bvh", *way, "--out", "x.bvh"]) == 0
    assert " 30 frames at 30 fps" in capsys.readouterr().out
