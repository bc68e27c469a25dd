"""Reading and writing BVH: good, odd and bad files, held against pybvh and brute force."""

from __future__ import annotations

import re
import time
import warnings
from dataclasses import replace

import bvh_corpus as corpus
import numpy as np
import pybvh
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from motionlab import Motion, Skeleton, read_bvh, write_bvh
from motionlab.errors import BvhError
from motionlab.io.bvh import parse_bvh

ORDERS = ("XYZ", "XZY", "YXZ", "YZX", "ZXY", "ZYX")
TENTH_OF_A_MILLIMETRE = 1e-4


def plain() -> Motion:
    return parse_bvh(corpus.PLAIN.encode(), "plain.bvh")


def random_motion(seed: int, frames: int = 5, joints: int = 6, orders=ORDERS) -> Motion:
    """A random tree, not depth-first, with end sites here and there."""
    rng = np.random.default_rng(seed)
    parents = [-1] + [int(rng.integers(0, j)) for j in range(1, joints)]
    skeleton = Skeleton(
        tuple(f"j{j}" for j in range(joints)),
        tuple(parents),
        torch.tensor(rng.uniform(-0.5, 0.5, (joints, 3))),
        (joints - 1, 0),
        torch.tensor(rng.uniform(-0.5, 0.5, (2, 3))),
        tuple(rng.choice(orders, joints)),
    )
    rotations = Rotation.random(frames * joints, rng=rng).as_matrix()
    return Motion(
        skeleton, rng.uniform(-3, 3, (frames, 3)), rotations.reshape(frames, joints, 3, 3), 30
    )


def by_name(motion: Motion) -> dict[str, torch.Tensor]:
    return dict(zip(motion.skeleton.point_names, motion.positions().unbind(1), strict=True))


def assert_same_positions(a: Motion, b: Motion, tolerance: float = TENTH_OF_A_MILLIMETRE) -> None:
    a, b = by_name(a), by_name(b)
    assert a.keys() == b.keys()
    for name in a:
        torch.testing.assert_close(a[name], b[name], rtol=0, atol=tolerance)


# -- good and odd files -------------------------------------------------------------------------


def test_plain_file():
    motion = plain()
    assert motion.skeleton.names == ("Hips", "Chest", "LeftArm", "RightArm")
    assert motion.skeleton.parents == (-1, 0, 1, 1)
    assert motion.skeleton.rotation_orders == ("ZXY", "ZXY", "XYZ", "YZX")
    assert motion.skeleton.end_parents == (2, 3)
    assert motion.fps == 30 and len(motion) == 3 and motion.name == "plain"
    torch.testing.assert_close(motion.root_positions[0], torch.tensor([0.015, 0.9, -0.02]))
    expected = Rotation.from_euler("YZX", [1, 2, 3], degrees=True).as_matrix()
    np.testing.assert_allclose(motion.rotations[0, 3].numpy(), expected, atol=1e-6)


@pytest.mark.parametrize("name", corpus.same_motion())
def test_odd_files_give_the_same_motion(name, tmp_path):
    path = tmp_path / "clip.bvh"
    path.write_bytes(corpus.same_motion()[name])
    motion = read_bvh(path)
    assert motion.skeleton.names == plain().skeleton.names
    assert motion.fps == 30
    assert_same_positions(motion, plain(), 0.001 if "noise" in name else 1e-6)


def test_positions_are_pybvhs(tmp_path):
    path = tmp_path / "clip.bvh"
    path.write_text(corpus.PLAIN, encoding="utf-8")
    theirs = pybvh.read_bvh_file(path, world_up="+y")
    nodes = sorted(range(len(theirs.nodes)), key=lambda i: theirs.nodes[i].is_end_site())
    ours = read_bvh(path).positions().numpy()
    np.testing.assert_allclose(ours, theirs.node_positions()[:, nodes] * 0.01, atol=1e-6)


def test_position_channels_of_the_first_inner_joint_move_the_body():
    """Brute force: joints one by one in plain numpy, position channels in place of offsets."""
    text = corpus.six_channels([(0, 20, 1), (5, 30, -4), (40, 20, 9)])
    text = text.replace("ROOT Hips", "ROOT World").replace("Chest", "Hips")
    motion = parse_bvh(text.encode(), "folded.bvh")
    assert motion.skeleton.names == ("Hips", "LeftArm", "RightArm")
    for frame, row in enumerate(text[text.index("\n1.5 90") :].split("\n")[1:4]):
        v = [float(word) for word in row.split()]

        def turn(order, at, v=v):
            return Rotation.from_euler(order, v[at : at + 3], degrees=True)

        root = turn("ZXY", 3)
        hips = np.array(v[:3]) + root.apply(v[6:9])
        body = root * turn("ZXY", 9)
        left, right = hips + body.apply([15, 10, 0]), hips + body.apply([-15, 10, 0])
        tips = [
            left + (body * turn("XYZ", 12)).apply([60, 0, 0]),
            right + (body * turn("YZX", 15)).apply([-60, 0, 0]),
        ]
        expected = np.array([hips, left, right, *tips]) * 0.01
        np.testing.assert_allclose(motion.positions()[frame].numpy(), expected, atol=1e-6)


def test_one_frame_is_folded_as_the_whole_clip_is():
    text = corpus.six_channels([(5, 30, -4)] * 3)
    text = text.replace("ROOT Hips", "ROOT World").replace("Chest", "Hips")
    text = "\n".join(text.replace("Frames: 3", "Frames: 1").rstrip().split("\n")[:-2])
    assert len(parse_bvh(text.encode(), "one.bvh")) == 1
    assert parse_bvh(text.encode(), "one.bvh").skeleton.names == ("Hips", "LeftArm", "RightArm")


@pytest.mark.parametrize(
    "letters, encoding",
    [
        ("Hüfte", "latin-1"),
        ("Hüfte", "utf-8"),
        ("腰", "utf-8"),
        ("腰", "utf-16"),
        ("ßein", "cp1252"),
    ],
)
def test_letters_in_names(letters, encoding, tmp_path):
    path = tmp_path / f"{letters} ä.bvh"
    path.write_bytes(corpus.PLAIN.replace("Chest", letters).encode(encoding))
    motion = read_bvh(path)
    assert motion.skeleton.names[1] == letters
    write_bvh(motion, path)
    assert read_bvh(path).skeleton.names == motion.skeleton.names


def test_names_with_blanks():
    text = corpus.PLAIN.replace("LeftArm", "Left Arm (1)")
    assert parse_bvh(text.encode(), "x.bvh").skeleton.names[2] == "Left_Arm_(1)"


def test_no_end_sites():
    text = re.sub(r" *End Site\n *{\n.*\n *}\n", "", corpus.PLAIN)
    motion = parse_bvh(text.encode(), "x.bvh")
    assert motion.skeleton.end_parents == () and motion.positions().shape == (3, 4, 3)


def test_one_frame():
    text = corpus.PLAIN[: corpus.PLAIN.index("2.5 91.0")].replace("Frames: 3", "Frames: 1")
    assert_same_positions(parse_bvh(text.encode(), "x.bvh"), plain()[:1], 1e-6)


@pytest.mark.parametrize("shape", [corpus.chain, corpus.star])
def test_ten_thousand_joints(shape, tmp_path):
    path = tmp_path / "many.bvh"
    path.write_bytes(shape(10_000))
    start = time.process_time()
    motion = read_bvh(path)
    assert motion.skeleton.joints == 10_000
    assert motion.positions().shape == (2, motion.skeleton.points, 3)
    if shape is corpus.chain:  # pybvh writes recursively
        with pytest.raises(BvhError, match="deeply"):
            write_bvh(motion, tmp_path / "again.bvh")
        assert [file.name for file in tmp_path.iterdir()] == ["many.bvh"]
    assert time.process_time() - start < 60


# -- what a source may say ----------------------------------------------------------------------


@pytest.mark.parametrize("units, metres", [("m", 1), ("cm", 0.01), ("in", 0.0254), (0.2, 0.2)])
@pytest.mark.filterwarnings("ignore:.*longest way")  # nobody is that large
def test_units(units, metres):
    motion = parse_bvh(corpus.PLAIN.encode(), "x.bvh", units=units)
    torch.testing.assert_close(motion.positions(), plain().positions() * metres / 0.01)


def test_units_that_nobody_says_are_centimetres():
    motion = parse_bvh(corpus.PLAIN.encode(), "x.bvh", units=None)
    torch.testing.assert_close(motion.positions(), plain().positions(), rtol=0, atol=0)


@pytest.mark.parametrize("units", ["furlong", 0, -1, float("nan"), "", [1]])
def test_unknown_units(units):
    with pytest.raises(BvhError, match="unit"):
        parse_bvh(corpus.PLAIN.encode(), "x.bvh", units=units)


def test_fps_replaces_a_wrong_frame_time():
    text = corpus.PLAIN.replace("0.0333333", "0")
    assert parse_bvh(text.encode(), "x.bvh", fps=60).fps == 60


@pytest.mark.parametrize("fps", [0, -30, float("inf"), "fast"])
def test_bad_fps(fps):
    with pytest.raises(BvhError, match="fps"):
        parse_bvh(corpus.PLAIN.encode(), "x.bvh", fps=fps)


@pytest.mark.parametrize(
    "frame_time, fps",
    [("0.0333333", 30), ("0.033", 30.30303), ("0.00833333", 120), ("0.0417083", 23.976024)],
)
def test_rates_near_whole_numbers_are_whole(frame_time, fps):
    text = corpus.PLAIN.replace("0.0333333", frame_time)
    assert parse_bvh(text.encode(), "x.bvh").fps == pytest.approx(fps, abs=1e-6)


def test_tpose_and_zero_frames_are_left_out():
    zeros = "1.0 90.0 0.0" + " 0" * 12 + "\n"
    head, rows = corpus.PLAIN[: corpus.ROWS], corpus.PLAIN[corpus.ROWS :]
    text = head.replace("Frames: 3", "Frames: 6") + rows[: rows.index("\n") + 1] + zeros * 2 + rows

    def read(**quirks):
        return parse_bvh(text.encode(), "x.bvh", **quirks)

    assert len(read()) == len(read(drop_zeros=True)) == 6
    assert len(read(tpose_first=True)) == 5
    assert_same_positions(read(tpose_first=True, drop_zeros=True), plain(), 1e-6)
    still = head.replace("Frames: 3", "Frames: 2") + zeros * 2
    with pytest.raises(BvhError, match="nothing is left"):
        parse_bvh(still.encode(), "x.bvh", drop_zeros=True)


def test_wrong_units_are_noticed(tmp_path):
    motion = Motion(
        Skeleton.canonical(), torch.zeros(2, 3), torch.eye(3).expand(2, 21, 3, 3), fps=30
    )
    write_bvh(motion, tmp_path / "clip.bvh", units="m")
    with pytest.warns(UserWarning, match="units='cm'"):
        read_bvh(tmp_path / "clip.bvh")


def test_the_inches_of_a_tall_adult_are_noticed(tmp_path):
    body = Skeleton.canonical()
    tall = replace(body, offsets=body.offsets * 1.8 / 1.3446)  # metres from foot to head
    still = Motion(tall, torch.zeros(2, 3), torch.eye(3).expand(2, 21, 3, 3), fps=30)
    write_bvh(still, tmp_path / "clip.bvh", units="in")
    with pytest.warns(UserWarning, match="units='in' makes it 1.80 m"):
        read_bvh(tmp_path / "clip.bvh")


@pytest.mark.parametrize("units, said", [("cm", []), ("m", [True]), ("mm", [True])])
def test_wrong_units_are_noticed_where_feet_are_not_known(tmp_path, units, said):
    body = Skeleton.canonical()
    names = [re.sub("Foot$", "Toe", re.sub("Toes$", "_18", name)) for name in body.names]
    body = replace(body, names=names, roles=None)
    still = Motion(body, torch.zeros(2, 3), torch.eye(3).expand(2, 21, 3, 3), fps=30)
    assert "left_foot" not in still.skeleton.roles
    write_bvh(still, tmp_path / "clip.bvh", units=units)
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        read_bvh(tmp_path / "clip.bvh")
    assert [f"units='{units}' makes it" in str(each.message) for each in told] == said


# -- writing ------------------------------------------------------------------------------------


@settings(max_examples=40, deadline=None)
@given(seed=st.integers(0, 2**32), joints=st.integers(1, 12), frames=st.integers(1, 6))
def test_written_and_read_again(tmp_path_factory, seed, joints, frames):
    path = tmp_path_factory.mktemp("bvh") / "clip.bvh"
    motion = random_motion(seed, frames, joints)
    write_bvh(motion, path)
    again = read_bvh(path)
    assert_same_positions(motion, again)
    orders = dict(zip(motion.skeleton.names, motion.skeleton.rotation_orders, strict=True))
    assert orders == dict(zip(again.skeleton.names, again.skeleton.rotation_orders, strict=True))
    assert again.fps == motion.fps
    write_bvh(again, path)  # once read, the order of joints and points stays
    assert read_bvh(path).skeleton.matches(again.skeleton)


@pytest.mark.parametrize("order", ORDERS)
@pytest.mark.parametrize("middle", [90, -90, 89.9999, -89.99])
def test_gimbal_lock(order, middle, tmp_path):
    first, third = np.meshgrid(np.arange(-180, 180, 24.0), np.arange(-180, 180, 36.0))
    angles = np.stack([first.ravel(), np.full(first.size, middle), third.ravel()], axis=-1)
    motion = random_motion(1, frames=len(angles), orders=(order,))
    turned = Rotation.from_euler(order, angles, degrees=True).as_matrix()
    rotations = np.broadcast_to(turned[:, None], motion.rotations.shape)
    motion = Motion(motion.skeleton, motion.root_positions, rotations.copy(), 30)
    write_bvh(motion, tmp_path / "clip.bvh")
    assert_same_positions(motion, read_bvh(tmp_path / "clip.bvh"))


def test_joints_in_any_order(tmp_path):
    """Two limbs whose joints alternate: a BVH file nests one limb after the other."""
    motion = random_motion(0, joints=5)
    skeleton = Skeleton(
        ("root", "a1", "b1", "a2", "b2"), (-1, 0, 0, 1, 2), motion.skeleton.offsets, (4, 3),
        motion.skeleton.end_offsets, motion.skeleton.rotation_orders,
    )  # fmt: skip
    motion = Motion(skeleton, motion.root_positions, motion.rotations, 30)
    write_bvh(motion, tmp_path / "clip.bvh")
    again = read_bvh(tmp_path / "clip.bvh")
    assert again.skeleton.names == ("root", "a1", "a2", "b1", "b2")
    assert_same_positions(motion, again)


def test_refused_writes_leave_nothing_behind(tmp_path, monkeypatch):
    motion = plain()
    path = tmp_path / "clip.bvh"
    path.write_text("mine", encoding="utf-8")
    refused = [
        (motion, tmp_path / "absent" / "clip.bvh", {}, "can't be written"),
        (motion, tmp_path / "clip.txt", {}, "must end in .bvh"),
        (motion, path, {"overwrite": False}, "overwrite=True"),
        (motion, path, {"units": "furlong"}, "unit"),
        (motion[:0], path, {}, "no frames"),
    ]
    for what, where, options, words in refused:
        with pytest.raises(BvhError, match=words):
            write_bvh(what, where, **options)
    (tmp_path / "folder.bvh").mkdir()
    with pytest.raises(BvhError, match="can't be written"):
        write_bvh(motion, tmp_path / "folder.bvh")

    def disk_full(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(pybvh, "write_bvh_file", disk_full)
    with pytest.raises(BvhError, match="No space left"):
        write_bvh(motion, path)
    assert path.read_text(encoding="utf-8") == "mine"
    assert sorted(file.name for file in tmp_path.iterdir()) == ["clip.bvh", "folder.bvh"]


def test_names_that_bvh_cannot_hold(tmp_path):
    skeleton = Skeleton(("a b", "a{b"), (-1, 0), torch.zeros(2, 3))
    motion = Motion(skeleton, torch.zeros(1, 3), torch.eye(3).expand(1, 2, 3, 3), 30)
    with pytest.raises(BvhError, match="rename"):
        write_bvh(motion, tmp_path / "clip.bvh")


# -- real clips ---------------------------------------------------------------------------------


@pytest.mark.filterwarnings("ignore:.*from frame 0 to frame 1")  # blurred over more than one frame
def test_real_clips_survive_writing(real_clips, tmp_path):
    for source, clips in real_clips.items():
        units = 0.056444 if source == "cmu" else 0.01
        for path, data in clips.items():
            motion = parse_bvh(data, path, units=units, tpose_first=True)[:300]
            write_bvh(motion, tmp_path / "clip.bvh", units=units)
            again = read_bvh(tmp_path / "clip.bvh", units=units)
            assert again.skeleton.point_names == motion.skeleton.point_names, path
            assert again.fps == motion.fps
            difference = (again.positions() - motion.positions()).abs().max()
            assert difference < TENTH_OF_A_MILLIMETRE, path
            assert len(motion.skeleton.roles) >= 19, path
            if not source.startswith("bandai"):
                (tmp_path / "theirs.bvh").write_bytes(data)
                theirs = pybvh.read_bvh_file(tmp_path / "theirs.bvh", world_up="+y")
                nodes = sorted(
                    range(len(theirs.nodes)), key=lambda i: theirs.nodes[i].is_end_site()
                )
                expected = theirs.node_positions()[1:301, nodes] * units
                np.testing.assert_allclose(motion.positions().numpy(), expected, atol=1e-5)


def test_writing_with_the_arguments_swapped(tmp_path):
    for arguments in ((tmp_path / "e.bvh", plain()), ("x", tmp_path / "y.bvh"), (plain(), None)):
        with pytest.raises(BvhError, match="the motion first, then the path"):
            write_bvh(*arguments)
    assert not list(tmp_path.iterdir())
