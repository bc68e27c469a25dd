"""Acclaim skeletons and motions: against plain arithmetic, CMU's files and what people write."""

from __future__ import annotations

import warnings
import zipfile
from dataclasses import replace

import numpy as np
import pytest
import tiny_acclaim as tiny
import torch
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from motionlab import read_amc, read_bvh, write_bvh
from motionlab.__main__ import main
from motionlab.datasets import from_folder, gaits
from motionlab.errors import AmcError, DataError
from motionlab.io.acclaim import parse_amc
from motionlab.io.bvh import parse_bvh

UNIT = 0.0254 / 0.45  # metres


def parse(amc: str, asf: str | None = None, **reading):
    """A motion from text, at a rate that is said."""
    skeleton = tiny.asf() if asf is None else asf
    return parse_amc(amc.encode(), skeleton.encode(), "x.amc", **{"fps": 120, **reading})


# -- against plain arithmetic ---------------------------------------------------------------------

ANGLE = st.floats(-200, 200).map(lambda value: round(value, 3))
AXES = st.permutations("XYZ").map("".join)
TURNS = st.lists(st.sampled_from(("rx", "ry", "rz")), unique=True, max_size=3).map(tuple)


@st.composite
def bodies(draw) -> list[tiny.Bone]:
    bones = []
    for number in range(draw(st.integers(1, 6))):
        direction = np.array(draw(st.tuples(*[st.floats(-1, 1)] * 3))) + [0, 0, 1.5]
        bones.append(
            tiny.Bone(
                f"bone{number}",
                draw(st.sampled_from(["root", *(bone.name for bone in bones)])),
                tuple((direction / np.linalg.norm(direction)).tolist()),
                round(draw(st.floats(0, 9)), 4),
                draw(st.tuples(ANGLE, ANGLE, ANGLE)),
                draw(AXES),
                draw(TURNS),
            )
        )
    return bones


def turned(order: str, values: dict[str, float], unit: str) -> Rotation:
    """About fixed axes, one after the other."""
    whole = Rotation.identity()
    for axis in order.lower():
        angle = values.get(axis, 0.0) if unit == "rad" else np.deg2rad(values.get(axis, 0.0))
        about = np.eye(3)["xyz".index(axis)]
        whole = Rotation.from_rotvec(angle * about) * whole
    return whole


def expected(bones, frame, order, unit) -> dict[str, np.ndarray]:
    """Where each bone begins and ends, in the file's unit, by what the format's definition says."""
    root = dict(zip(order.lower().split(), frame["root"], strict=True))
    of_root = {kind[1]: value for kind, value in root.items() if kind[0] == "r"}
    start = np.array([root.get(f"t{axis}", 0.0) for axis in "xyz"])
    sequence = "".join(kind[1] for kind in order.lower().split() if kind[0] == "r")
    turn, found = {"root": turned(sequence, of_root, unit)}, {"root": start}
    for bone in bones:
        c = turned(bone.axes, dict(zip("xyz", bone.axis, strict=True)), unit)
        values = {k[1]: v for k, v in zip(bone.dof, frame.get(bone.name, ()), strict=True)}
        m = turned(bone.axes, values, unit)
        turn[bone.name] = turn[bone.parent] * c * m * c.inv()
        along = np.array(bone.direction) * bone.length
        found[bone.name] = found[bone.parent] + turn[bone.name].apply(along)
    return found


@settings(max_examples=60, deadline=None)
@given(bodies(), st.permutations("TX TY TZ RX RY RZ".split()), st.sampled_from(["deg", "rad"]), st.data())  # fmt: skip
def test_bones_are_where_the_definition_puts_them(bones, order, unit, data):
    frames = []
    for _ in range(data.draw(st.integers(1, 3))):
        frame = {"root": [data.draw(ANGLE) for _ in order]}
        for bone in bones:
            if bone.dof:
                frame[bone.name] = [data.draw(ANGLE) for _ in bone.dof]
        frames.append(frame)
    length = data.draw(st.sampled_from([None, 1.0, 0.45, 2.54]))
    skeleton = tiny.asf(bones, length=length, angle=unit, order=" ".join(order))
    head = [":FULLY-SPECIFIED", ":DEGREES" if unit == "deg" else ":RADIANS"]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # these bodies are no persons
        motion = parse(tiny.amc(frames, head), skeleton)
    points = motion.positions().double().numpy() / 0.0254 * (length or 1.0)
    parents = {bone.name: bone.parent for bone in bones}
    for t, frame in enumerate(frames):
        ends = expected(bones, frame, " ".join(order), unit)
        for name, point in zip(motion.skeleton.point_names, points[t], strict=True):
            begins = "root" if name == "root" else parents.get(name)
            wanted = ends[name.removesuffix("End")] if name.endswith("End") else ends[begins]
            np.testing.assert_allclose(point, wanted, atol=2e-3)


def test_real_clips_are_as_others_have_converted_them(recorded_clips):
    """A short clip of each subject, against BVH files of theirs; joints in the same order."""
    amc = zipfile.ZipFile(recorded_clips / "cmu-amc.zip")
    bvh = zipfile.ZipFile(recorded_clips / "converted" / "cmu-amc.zip")
    sizes = {file.filename: file.file_size for file in amc.infolist() if "_" in file.filename}
    clips = {name.partition("_")[0]: name for name in sorted(sizes, key=sizes.get, reverse=True)}
    assert len(clips) == 8
    for subject, name in clips.items():
        motion = parse_amc(amc.read(name), amc.read(f"{subject}.asf"), name, fps=120)
        other = parse_bvh(bvh.read(name.replace(".amc", ".bvh")), name, units=UNIT, up="y")
        assert len(motion) == len(other) > 50
        assert (motion.positions() - other.positions()).abs().max() < 2e-5  # metres; four decimals
        assert (motion.rotations - other.rotations).abs().max() < 5e-6
        roles = {role: joint for role, joint in motion.skeleton.roles.items() if role != "chest"}
        assert roles.items() <= other.skeleton.roles.items() and len(roles) == 20
        assert motion.skeleton.mirror_partners == other.skeleton.mirror_partners


# -- what people write ----------------------------------------------------------------------------


def test_roles_and_partners_of_cmus_bones():
    skeleton = parse(tiny.amc(tiny.sway(2))).skeleton
    named = {role: skeleton.names[joint] for role, joint in skeleton.roles.items()}
    assert {role: named[role] for role in ("hips", "spine", "chest", "neck", "head")} == {
        "hips": "root", "spine": "lowerback", "chest": "thorax", "neck": "lowerneck", "head": "head",
    }  # fmt: skip
    for side in ("left", "right"):
        of_side = {role.partition("_")[2]: name[1:] for role, name in named.items() if side in role}
        assert of_side == {
            "upper_leg": "femur", "lower_leg": "tibia", "foot": "foot", "toes": "toes",
            "shoulder": "clavicle", "upper_arm": "humerus", "lower_arm": "radius", "hand": "wrist",
        }  # fmt: skip
    assert skeleton.without_partner == ()
    assert len(parse(tiny.amc(tiny.sway(20))).retarget()) == 20


def same(one, other, tolerance=2e-6) -> None:
    assert one.skeleton.parents == other.skeleton.parents and len(one) == len(other)
    torch.testing.assert_close(one.positions(), other.positions(), rtol=0, atol=tolerance)


AMC, ASF = tiny.amc(tiny.sway(4)), tiny.asf()


@pytest.mark.parametrize(
    ("amc", "asf"),
    [
        (AMC.replace("\n", "\r\n"), ASF.replace("\n", "\r\n")),
        (AMC.replace(" ", "\t"), ASF.replace(" ", "\t")),
        (AMC.upper(), ASF),
        (AMC, ASF.upper()),
        (AMC.replace("\n", "  # said\n"), ASF.replace("\n", " # said\n").replace(":docu", "#:docu")),
        (AMC.replace("\n", "\n\n \n"), ASF.replace("\n", "\n\n \n")),
        (AMC.replace(":FULLY-SPECIFIED\n:DEGREES\n", ""), ASF),
        ("\ufeff" + AMC, "\ufeff" + ASF),
        (AMC.rstrip(), ASF.rstrip()),
        (AMC.replace("ltibia", "lhipjoint\nltibia"), ASF),  # a bone without values may be named
        (AMC, ASF.replace("(-160.0 20.0)", "(-160, 20)").replace("direction 0 1 0", "direction 0, 1, 0")),
        (AMC, ASF.replace("  begin\n     id", "  begin\n   bodymass 3\n   cofmass 1.0\n     id")),
        (AMC, ASF.replace("   position 0 0 0\n   orientation 0 0 0\n", "")),
        (AMC, ASF.replace("axis 0.0 0.0 0.0  XYZ", "axis 0 0 0")),
        (AMC, ASF + ":skin person.obj\n  not read\n"),
        (AMC, ASF.replace("    thorax lowerneck lclavicle rclavicle\n", "    thorax lowerneck\n thorax lclavicle rclavicle\n")),
    ],
)  # fmt: skip
def test_spellings_that_mean_the_same(amc, asf):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        same(parse(amc, asf), parse(AMC))


def test_three_angles_a_bone_as_a_player_writes_them():
    """Where the motion says so, all bones have three, whatever the skeleton lists."""
    frames = tiny.sway(3)
    whole = [{"root": frame["root"]} for frame in frames]
    for bone in tiny.PERSON:
        for frame, old in zip(whole, frames, strict=True):
            values = dict(zip(bone.dof, old.get(bone.name, ()), strict=True))
            frame[bone.name] = [values.get(kind, 0.0) for kind in ("rx", "ry", "rz")]
    head = [":FULLY-SPECIFIED", ":FORCE-ALL-JOINTS-BE-3DOF", ":DEGREES"]
    same(parse(tiny.amc(whole, head)), parse(tiny.amc(frames)))


def test_radians_in_the_skeleton_and_degrees_in_the_motion():
    turned = [replace(b, axis=tuple(np.deg2rad(b.axis).tolist())) for b in tiny.PERSON]
    same(parse(AMC, tiny.asf(turned, angle="rad")), parse(AMC))


def test_angles_that_are_not_said_are_degrees():
    asf = tiny.asf().replace("  angle deg\n", "")
    with pytest.warns(UserWarning, match=r"its \.asf\) does not say in :units what its angles are"):
        same(parse(AMC, asf), parse(AMC))


def test_angles_and_axes_in_other_orders_and_long_directions_are_told():
    """All can be meant otherwise."""
    turned = [replace(b, axes="ZYX") if b.name == "lwrist" else b for b in tiny.PERSON]
    with pytest.warns(UserWarning, match=r"line \d+: the axes of 'lwrist' are turned in the order"):
        parse(AMC, tiny.asf(turned))
    swapped = [replace(b, dof=("rz", "rx")) if b.name == "lfoot" else b for b in tiny.PERSON]
    frames = tiny.sway(4)
    for frame in frames:
        frame["lfoot"].reverse()
    with pytest.warns(
        UserWarning, match=r"line \d+: 'lfoot' lists its angles in the order ZX and its "
    ):
        same(parse(tiny.amc(frames), tiny.asf(swapped)), parse(AMC))
    for frame in frames:
        frame["lfoot"].reverse()
        frame["root"][3:] = [20.0, 0.0, 10.0]
    with pytest.warns(
        UserWarning, match="'root' lists its angles in the order ZYX .* of the angles"
    ):
        motion = parse(tiny.amc(frames), tiny.asf(order="TX TY TZ RZ RY RX"))
    turn = Rotation.from_euler("zx", [20, 10], degrees=True).as_matrix()
    np.testing.assert_allclose(motion.rotations[0, 0], turn, atol=1e-6)
    long = [replace(b, direction=(0, 2, 0)) if b.name == "head" else b for b in tiny.PERSON]
    with pytest.warns(UserWarning, match="a direction is 2 long, not 1; bones are as long as"):
        same(parse(AMC, tiny.asf(long)), parse(AMC))


def test_the_roots_first_pose_moves_the_whole_motion():
    asf = tiny.asf(position="1 2 3", orientation="0 90 0")
    with pytest.warns(UserWarning, match=r"line \d+: the root is turned before all motion"):
        motion = parse(AMC, asf)
    plain = parse(AMC)
    shifted = plain.root_positions + torch.tensor([1.0, 2.0, 3.0]) * UNIT
    torch.testing.assert_close(motion.root_positions, shifted)
    quarter = torch.from_numpy(Rotation.from_euler("y", 90, degrees=True).as_matrix()).float()
    torch.testing.assert_close(motion.rotations[:, 0], quarter @ plain.rotations[:, 0])
    torch.testing.assert_close(motion.rotations[:, 1:], plain.rotations[:, 1:])


def test_units_up_and_roles_can_be_said():
    plain = parse(AMC)
    with pytest.warns(UserWarning, match="units=0.0254"):
        inches = parse(AMC, tiny.asf(length=None))
    torch.testing.assert_close(inches.positions() * 0.45**-1, plain.positions())
    torch.testing.assert_close(
        parse(AMC, tiny.asf(length=None), units=UNIT).positions(), plain.positions()
    )
    named = parse(AMC, roles={"spine": "upperback"}).skeleton
    assert named.role("spine") == named.index("upperback") != plain.skeleton.role("spine")
    with pytest.warns(UserWarning, match="read it with up='y'"):
        lying = parse(AMC, up="-z")
    torch.testing.assert_close(lying.positions()[..., 1], -plain.positions()[..., 2])


def test_the_rate():
    with pytest.warns(UserWarning, match="does not say its frame rate; it is read with 120"):
        assert parse(AMC, fps=None).fps == 120
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert parse(":SAMPLES-PER-SECOND 60\n" + AMC, fps=None).fps == 60
        assert parse(":SAMPLES-PER-SECOND 60\n" + AMC, fps=30).fps == 30
        every_fourth = tiny.amc(tiny.sway(4), numbers=(1, 5, 9, 13))
        assert parse(every_fourth, fps=30).fps == 30
    with pytest.warns(
        UserWarning, match="frame numbers go up by 4, so that it is read with 30 frames"
    ):
        assert parse(every_fourth, fps=None).fps == 30
    with pytest.warns(UserWarning, match="frame 5 follows frame 2; 4 frames are not there in all"):
        assert len(parse(tiny.amc(tiny.sway(4), numbers=(1, 2, 5, 8)))) == 4


def test_a_bone_that_some_frames_leave_out():
    frames = tiny.sway(5)
    del frames[1]["lfemur"], frames[2]["lfemur"], frames[0]["rfemur"]
    with pytest.warns(UserWarning, match="some frames have no row for lfemur, rfemur"):
        motion = parse(tiny.amc(frames))
    full = tiny.sway(5)
    full[1]["lfemur"] = full[2]["lfemur"] = full[0]["lfemur"]
    full[0]["rfemur"] = full[1]["rfemur"]
    same(motion, parse(tiny.amc(full)))


def test_a_bone_that_all_frames_leave_out():
    frames = tiny.sway(2)
    for frame in frames:
        del frame["lthumb"]
    with pytest.warns(UserWarning, match="no frame has a row for lthumb; they do not turn"):
        motion = parse(tiny.amc(frames))
    thumb = motion.skeleton.index("lthumb")
    torch.testing.assert_close(motion.rotations[:, thumb], torch.eye(3).expand(2, 3, 3))


def test_bones_that_stretch():
    long = [replace(b, dof=("rx", "l")) if b.name == "ltibia" else b for b in tiny.PERSON]
    frames = tiny.sway(3)
    for frame, stretch in zip(frames, (0.0, 0.1, -0.3), strict=True):
        frame["ltibia"][1:] = [stretch]
    asf = tiny.asf(long)
    with pytest.raises(AmcError, match=r"by up to 1\.7 cm, 'ltibia' the most; .* rigid='mean'"):
        parse(tiny.amc(frames), asf)
    with pytest.warns(UserWarning, match=r"by up to 1\.7 cm, 'ltibia' the most; that is left out"):
        same(parse(tiny.amc(frames), asf, rigid="mean"), parse(tiny.amc(tiny.sway(3))))
    for frame in frames:
        frame["ltibia"][1] = 0.0
    same(parse(tiny.amc(frames), asf), parse(tiny.amc(tiny.sway(3))))


def test_frames_to_leave_out():
    frames = [{name: [0.0] * len(row) for name, row in frame.items()} for frame in tiny.sway(3)]
    amc = tiny.amc(frames + tiny.sway(3))
    same(parse(amc, drop_zeros=True), parse(tiny.amc(tiny.sway(3))))
    assert len(parse(amc, tpose_first=True)) == 5
    with pytest.raises(AmcError, match=r"x\.amc: nothing is left of 3 frames"):
        parse(tiny.amc(frames), drop_zeros=True)


# -- files ----------------------------------------------------------------------------------------


def put(folder, **texts) -> None:
    for name, text in texts.items():
        stem, _, suffix = name.rpartition("_")
        (folder / f"{stem}.{suffix}").write_text(text, encoding="utf-8")


def test_the_skeleton_is_found_beside_the_motion(tmp_path):
    other = tiny.asf([replace(bone, length=1.1 * bone.length) for bone in tiny.PERSON])
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        put(tmp_path, **{"05_asf": ASF, "0_asf": other, "05_01_amc": AMC})
        motion = read_amc(tmp_path / "05_01.amc", fps=120)
        same(motion, parse(AMC))
        assert (motion.name, motion.fps) == ("05_01", 120)
        put(tmp_path, **{"05_01_ASF": other})
        assert not read_amc(tmp_path / "05_01.amc", fps=120).skeleton.matches(motion.skeleton)
        put(tmp_path, **{"walk_amc": AMC, "Rory3_ASF": ASF})  # as the motion's first line says
        same(read_amc(tmp_path / "walk.amc", fps=120), motion)
        same(read_amc(tmp_path / "05_01.amc", tmp_path / "05.asf", fps=120), motion)
    lone = tmp_path / "lone"
    lone.mkdir()
    put(lone, **{"07_asf": ASF, "walk_amc": AMC})
    with pytest.warns(UserWarning, match=r"it is read with 07\.asf, the only \.asf file beside it"):
        same(read_amc(lone / "walk.amc", fps=120), motion)


def test_folders_hold_both_kinds(tmp_path, capsys):
    put(tmp_path, **{"05_asf": ASF, "05_01_amc": AMC, "05_02_AMC": AMC})
    write_bvh(gaits.make(seconds=0.5), tmp_path / "walk.bvh")
    with pytest.warns(UserWarning, match=r"2 of 3 files, first .*does not say its frame rate"):
        clips = from_folder(tmp_path)
    assert [clip.name for clip in clips] == ["05_01", "05_02", "walk"]
    same(clips[1], parse(AMC))
    with pytest.raises(DataError, match=r"'05_01' is there twice, as 05_01\.amc and 05_01\.bvh"):
        write_bvh(clips[0], tmp_path / "05_01.bvh")
        from_folder(tmp_path)
    (tmp_path / "05_01.bvh").unlink()
    assert main(["info", str(tmp_path)]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line.partition(":")[0] for line in lines] == ["05_01.amc", "05_02.AMC", "walk.bvh"]
    assert all("has all roles that retargeting needs" in line for line in lines)
    assert main(["info", str(tmp_path / "05_01.amc")]) == 0
    text = capsys.readouterr().out
    assert text.startswith("# 05_01: 31 joints, 4 frames, 0.03 s, 120 fps, ")
    assert 'left_upper_leg = "lfemur"' in text and "does not say its frame rate" in text


def test_it_can_be_written_as_bvh(tmp_path):
    motion = parse(AMC)
    write_bvh(motion, tmp_path / "out.bvh")
    same(read_bvh(tmp_path / "out.bvh"), motion, 1e-4)
