"""`motionlab info`: what is in a file, and a table of roles that can be given back."""

from __future__ import annotations

import tomllib
from dataclasses import replace

import pytest
import rig_names

from motionlab import read_bvh, roles, write_bvh
from motionlab.__main__ import main
from motionlab.commands.info import describe
from motionlab.datasets import gaits
from motionlab.errors import BvhError


@pytest.fixture
def walk(tmp_path):
    """A clip whose left shin, ankle and hand are called as nobody calls them; forearms are so short
    that bones do not tell either."""
    motion = gaits.make(seconds=1, name="walk")
    odd = {"LeftLowerLeg": "Rod", "LeftFoot": 'Paw "1"', "LeftHand": "Claw"}
    names = [odd.get(name, name) for name in motion.skeleton.names]
    offsets = motion.skeleton.offsets.clone()
    offsets[[motion.skeleton.role(f"{side}_hand") for side in roles.SIDES]] /= 2
    motion = replace(motion, skeleton=replace(motion.skeleton, offsets=offsets))
    path = tmp_path / "walk.bvh"
    write_bvh(rig_names.renamed(motion, names), path)
    return path


def test_what_it_says_of_a_file(walk):
    text = describe(walk)
    assert text.startswith(
        "# walk: 21 joints, 30 frames, 1.00 s, 30 fps, 1.34 m from foot to head\n"
    )
    assert '# ROLE = "Rod"\n# ROLE = "Paw_\\"1\\""\nleft_toes = ' in text
    needs = text[text.index("needs also") :]
    wanted = [f'# left_{part} = "NAME"\n' for part in ("hand", "lower_leg", "foot")]
    assert "".join(wanted) in needs and "right_hand" not in needs
    # the hands keep their side in the mirror, which makes a body of it that is none
    assert 'without a partner on the other: "Claw", "RightHand", "Rod", "Paw_' in text


def test_what_bones_tell_is_said(tmp_path):
    names = rig_names.names_of(rig_names.FOREIGN["numbers"])
    write_bvh(rig_names.renamed(gaits.make(seconds=1), names), tmp_path / "walk.bvh")
    text = describe(tmp_path / "walk.bvh")
    assert 'left_foot = "leg_L_03"' in text and "Retargeting has all the roles" in text
    assert "# Told by the lengths of bones, not by names: neck, head, left_shoulder, left_" in text


def test_it_can_be_mended_and_given_back(walk, tmp_path, capsys):
    table = tmp_path / "rig.toml"
    text = describe(walk).replace('# left_hand = "NAME"', 'left_hand = "Claw"')
    text = text.replace('# ROLE = "Rod', 'left_lower_leg = "Rod')
    text = text.replace('# ROLE = "Paw', 'left_foot = "Paw').replace("left_toes", "# left_toes")
    table.write_text(text + '\nleft_toes = ""\n', encoding="utf-8")
    given = roles.read(table)
    assert given["left_foot"] == 'Paw_"1"'
    assert main(["info", str(walk), "--roles", str(table)]) == 0
    printed = capsys.readouterr().out
    assert "Retargeting has all the roles" in printed and "without a partner" not in printed
    assert tomllib.loads(printed) == given
    motion = read_bvh(walk, roles=given)
    assert motion.skeleton.roles.given == given and "left_toes" not in motion.skeleton.roles
    assert len(motion.retarget()) == 30


def test_a_body_that_is_not_understood_has_a_size_all_the_same(tmp_path):
    motion = gaits.make(seconds=0.2)
    odd = rig_names.renamed(motion, [f"bone {joint}" for joint in range(21)])
    write_bvh(odd, tmp_path / "odd.bvh")
    text = describe(tmp_path / "odd.bvh")
    height = float(text.split(" fps, ")[1].split(" m high in its first frame")[0])
    assert 1.5 < height < 1.8
    assert tomllib.loads(text) == {}


def test_a_folder_has_a_line_for_each_file(walk, tmp_path, capsys):
    deep = tmp_path / "more"
    deep.mkdir()
    whole = gaits.make(seconds=1)
    write_bvh(whole, deep / "whole.bvh")
    write_bvh(whole, deep / "giant.bvh", units=0.001)
    (tmp_path / "bad.BVH").write_text("HIERARCHY\n")
    (tmp_path / "notes.txt").write_text("no clip")
    assert main(["info", str(tmp_path)]) == 0
    bad, giant, right, lacking, *last = capsys.readouterr().out.splitlines()
    assert last == [
        f"{tmp_path}: 1 of 4 files can't be read (FAULT): bad.BVH",
        f"{tmp_path}: 1 of 4 files lack roles that retargeting needs: walk.bvh",
        f"{tmp_path}: 1 of 4 files look like --units=mm: more/giant.bvh",
    ]
    assert bad.startswith("bad.BVH: FAULT ") and "bad.BVH" in bad[15:]
    units, roles_ = giant.index("pass another unit"), giant.index("; has all roles")
    assert units < roles_  # what a wrong unit spoils is not worth a look before
    assert right.endswith(
        ": 21 joints, 30 frames, 1.00 s, 30 fps, 1.34 m from foot to head; has all roles that retargeting needs"
    )
    assert lacking.startswith("walk.bvh: ") and lacking.endswith(
        "; lacks left_hand, left_lower_leg, left_foot"
    )
    assert main(["info", str(tmp_path), "--units", "0.01"]) == 0
    assert capsys.readouterr().out.splitlines()[2] == right


def test_a_mixed_folder_is_sorted_by_what_fits(tmp_path, capsys):
    whole = gaits.make(seconds=0.2)
    for name, units in (("a", "m"), ("b", "m"), ("c", "mm"), ("d", "mm"), ("e", "cm")):
        write_bvh(whole, tmp_path / f"{name}.bvh", units=units)
    write_bvh(whole, tmp_path / "f.bvh", up="z")
    assert main(["info", str(tmp_path)]) == 0
    *_, metres, millimetres, up = capsys.readouterr().out.splitlines()
    assert up == f"{tmp_path}: 1 of 6 files look like --up=z: f.bvh"
    assert metres == f"{tmp_path}: 2 of 6 files look like --units=m: a.bvh, b.bvh"
    assert millimetres.endswith("2 of 6 files look like --units=mm: c.bvh, d.bvh")
    assert main(["convert", str(tmp_path), "--out", str(tmp_path / "x")]) == 0
    assert "What looks like --units=m: a.bvh, b.bvh." in capsys.readouterr().out


def test_what_it_can_not_do(walk, tmp_path, capsys):
    with pytest.raises(BvhError, match="can't be opened"):
        describe(tmp_path / "none.bvh")
    with pytest.raises(BvhError, match="walk.bvh: .*no such joint"):
        describe(walk, roles={"head": "Kopf"})
    (tmp_path / "empty").mkdir()
    for wrong, said in (
        (["info", str(walk.with_name("none.bvh"))], "there is no such file or folder"),
        (["info", str(tmp_path / "empty")], "holds no .bvh, .amc, .glb or .gltf file"),
        (["info", str(walk), "--units", "ells"], "Unknown unit 'ells'"),
        (["info", str(walk), "--roles", "none.toml"], "can't be opened"),
    ):
        assert main(wrong) == 1
        assert said in capsys.readouterr().err
