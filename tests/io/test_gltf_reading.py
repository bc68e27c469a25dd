"""glTF files read: our own, a character as from Mixamo, any tree of nodes, by hand-made matrices."""

from __future__ import annotations

import os
import warnings
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch
from gltf_files import Gltf, mixamo, skin, worlds
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from motionlab import Motion, Skeleton, datasets, read_gltf, write_gltf
from motionlab.commands.info import describe
from motionlab.datasets import gaits
from motionlab.errors import BvhError, GltfError
from motionlab.io.bvh import parse_bvh
from motionlab.roles import ALL


@pytest.fixture(scope="module")
def walk() -> Motion:
    return gaits.make(seconds=1.0, speed=1.4, turn_rate=0.4, seed=3)


def check_same(read: Motion, motion: Motion, most: float = 1e-4) -> None:
    assert read.skeleton.matches(motion.skeleton)
    assert len(read) == len(motion) and read.fps == pytest.approx(motion.fps)
    assert float((read.positions() - motion.positions()).abs().max()) < most


# -- our own files --------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["walk_0.8_turn_left_0.5", "run_3.0", "stand"])
def test_what_is_written_is_read(name, tmp_path):
    (motion,) = datasets.load("gaits", clips=[name])
    write_gltf(motion, tmp_path / "clip.glb")
    read = read_gltf(tmp_path / "clip.glb", source="mine")
    check_same(read, motion, 1e-5)
    assert (read.name, read.source) == ("clip", "mine")
    assert read.skeleton.roles == motion.skeleton.roles


def test_real_clips_too(real_clips, tmp_path):
    for clips in real_clips.values():
        path, data = next(iter(clips.items()))
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of units
            clip = parse_bvh(data, path)[:3000:4]
            write_gltf(clip, tmp_path / "clip.glb")
            check_same(read_gltf(tmp_path / "clip.glb", fps=clip.fps), clip)


@st.composite
def chains(draw) -> Motion:
    """Any tree with end sites, its joints in the order in which a tree is walked."""
    count = draw(st.integers(1, 8))
    parents = [-1]
    for joint in range(1, count):  # a joint, or one above it, carries the next
        line = [joint - 1]
        while parents[line[-1]] >= 0:
            line.append(parents[line[-1]])
        parents.append(draw(st.sampled_from(line)))
    ends = sorted(draw(st.lists(st.integers(0, count - 1), max_size=4)))
    chance = torch.Generator().manual_seed(draw(st.integers(0, 10**6)))
    random = lambda *shape: torch.randn(*shape, generator=chance)
    skeleton = Skeleton(
        [f"Knochen {joint} ü" for joint in range(count)], parents, random(count, 3), ends,
        random(len(ends), 3),
    )  # fmt: skip
    frames = draw(st.integers(2, 5))
    turns = Rotation.random(frames * count, random_state=draw(st.integers(0, 99))).as_matrix()
    turns = torch.from_numpy(turns).float().reshape(frames, count, 3, 3)
    return Motion(skeleton, random(frames, 3), turns, draw(st.sampled_from([12, 24, 30, 120])))


@settings(max_examples=25, deadline=None)
@given(chains())
def test_any_skeleton_that_is_written_is_read(tmp_path_factory, motion):
    path = tmp_path_factory.getbasetemp() / "any.glb"
    write_gltf(motion, path)
    check_same(read_gltf(path), motion)


# -- files of others ------------------------------------------------------------------------------


@pytest.mark.parametrize("turn, scale", [(-90, 0.01), (90, 0.01), (0, 1), (37, 2.5)])
def test_a_character_as_from_mixamo(walk, turn, scale, tmp_path):
    path = mixamo(walk, turn=turn, scale=scale).save(tmp_path / "Walking.glb")
    read = read_gltf(path)
    assert read.fps == walk.fps and read.skeleton.names[0] == "mixamorig:Hips"
    assert float((read.positions() - walk.positions()).abs().max()) < 1e-4
    assert set(read.skeleton.roles) == set(ALL)
    known = {role: walk.skeleton.names[joint] for role, joint in walk.skeleton.roles.items()}
    assert {role: walk.skeleton.names[j] for role, j in read.skeleton.roles.items()} == known


def test_a_folder_and_info_take_them(walk, tmp_path):
    gltf = mixamo(walk)
    gltf.save(tmp_path / "a.glb")
    (tmp_path / "b.gltf").write_bytes(gltf.gltf())
    clips = datasets.from_folder(tmp_path)
    assert [clip.name for clip in clips] == ["a", "b"]
    for clip in clips:
        assert float((clip.positions() - walk.positions()).abs().max()) < 1e-4
    assert 'left_foot = "mixamorig:LeftFoot"' in describe(tmp_path / "a.glb")
    assert len(describe(tmp_path).splitlines()) == 2


@st.composite
def trees(draw) -> tuple[Gltf, list[int], np.ndarray]:
    """Nodes hung together, turned and scaled anyhow, animated anyhow; joints, and times to look."""
    count = draw(st.integers(1, 7))
    random = np.random.default_rng(draw(st.integers(0, 10**6)))
    parents = [-1] + [draw(st.integers(0, i - 1)) for i in range(1, count)]
    order = random.permutation(count)  # in the file a child may stand before its parent
    nodes: list[dict] = [{} for _ in range(count)]
    joints = sorted(range(count), key=lambda i: -i)[: draw(st.integers(1, count))]
    moves = {}
    for i in range(count):
        node = nodes[order[i]]
        node["name"] = f"n{i}"
        if parents[i] >= 0:
            nodes[order[parents[i]]].setdefault("children", []).append(int(order[i]))
        turn, shift = Rotation.random(random_state=i).as_quat(), random.normal(size=3)
        size = [float(random.uniform(0.5, 2))] * 3
        if draw(st.booleans()):
            whole = np.eye(4)
            whole[:3, :3] = Rotation.from_quat(turn).as_matrix() * size[0]
            whole[:3, 3] = shift
            node["matrix"] = whole.T.ravel().tolist()
            continue
        node |= {"rotation": turn.tolist(), "translation": shift.tolist(), "scale": size}
        for path in draw(st.sets(st.sampled_from(["rotation", "translation"]))):
            if path == "translation" and parents[i] >= 0:
                continue  # joints that slide are another test's
            way = draw(st.sampled_from(["LINEAR", "STEP", "CUBICSPLINE"]))
            keys = random.uniform(0, 2, draw(st.integers(1, 4))).round(2)
            keys = np.unique(keys)
            width = 4 if path == "rotation" else 3
            out = random.normal(size=(len(keys) * (3 if way == "CUBICSPLINE" else 1), width))
            moves[int(order[i]), path] = keys, out, way
    gltf = Gltf(nodes)
    joints = [int(order[i]) for i in joints]
    skin(gltf, joints, np.tile(np.eye(4), (len(joints), 1, 1)))
    if moves:
        gltf.animate(moves)
    return gltf, joints, moves


@settings(max_examples=30, deadline=None)
@given(trees(), st.sampled_from([7.0, 30.0]))
def test_any_nodes_are_where_their_matrices_say(tmp_path_factory, tree, fps):
    gltf, joints, moves = tree
    path = gltf.save(tmp_path_factory.getbasetemp() / "any.glb")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of no animation
        read = read_gltf(path, fps=fps, root="n0")  # which all hang on
    names = [node.get("name") for node in gltf.json["nodes"]]
    parents = {c: i for i, node in enumerate(gltf.json["nodes"]) for c in node.get("children", ())}
    about = [names.index(name) for name in read.skeleton.names]
    while about[0] in parents:  # and what the root hangs on
        about.insert(0, parents[about[0]])
    keys = [times for (node, _), (times, _, _) in moves.items() if node in about]
    keys = np.concatenate(keys or [np.zeros(1)])
    times = np.float32(keys.min()) + np.arange(len(read)) / fps
    assert keys.max() - 1 / fps - 1e-3 < times[-1] < keys.max() + 1e-3
    # a frame that float32 sets beside a key is at the key: of a STEP that is another value
    nearest = keys.astype(np.float32)[np.abs(times[:, None] - keys).argmin(axis=1)]
    times = np.where(np.abs(nearest - times) < 1e-6, nearest, times)
    expected = worlds(gltf, times.clip(max=np.float32(keys.max())), 0 if moves else None)
    assert set(joints) <= {names.index(name) for name in read.skeleton.names}
    for joint, name in enumerate(read.skeleton.names):
        at = expected[:, names.index(name)]
        np.testing.assert_allclose(read.positions()[:, joint], at[:, :3, 3], atol=1e-3)
        turns = at[:, :3, :3] / np.cbrt(np.linalg.det(at[:, :3, :3]))[:, None, None]
        np.testing.assert_allclose(read.orientations()[:, joint], turns, atol=1e-3)


def test_a_step_is_taken_in_the_frame_at_which_it_is_written(tmp_path):
    turns = Rotation.from_euler("y", [[0], [60], [120]], degrees=True).as_quat()
    gltf = Gltf([{"name": "n0", "children": [1]}, {"name": "n1", "translation": [0, 1, 0]}])
    skin(gltf, [0, 1], np.tile(np.eye(4), (2, 1, 1)))
    # 0.11 s + 33 frames is 1.21 s, but not in float32
    gltf.animate({(0, "rotation"): (np.array([0.11, 1.21, 1.37]), turns, "STEP")})
    read = read_gltf(gltf.save(tmp_path / "step.glb"), fps=30)
    facing = Rotation.from_matrix(read.orientations()[:, 0].numpy()).as_euler("YXZ")[:, 0]
    np.testing.assert_allclose(np.degrees(facing), [0] * 33 + [60] * 5, atol=1e-3)


# -- options --------------------------------------------------------------------------------------


def test_units_and_up_are_said_or_doubted(walk, tmp_path):
    big = replace(walk, root_positions=walk.root_positions * 100)
    s = walk.skeleton
    big = replace(
        big, skeleton=replace(s, offsets=s.offsets * 100, end_offsets=s.end_offsets * 100)
    )
    write_gltf(big, tmp_path / "big.glb")
    with pytest.warns(UserWarning, match=r"big\.glb: .*units='m'.*units='cm' makes it 1\.34 m"):
        read_gltf(tmp_path / "big.glb")
    check_same(read_gltf(tmp_path / "big.glb", units="cm"), walk)
    gltf = mixamo(walk)
    gltf.json["nodes"].append({"children": [0], "rotation": [2**-0.5, 0, 0, 2**-0.5]})
    path = gltf.save(tmp_path / "lying.glb")
    with pytest.warns(UserWarning, match=r"lying\.glb: .*up='z'") as told:
        read_gltf(path)
    assert len(told) == 1
    with pytest.warns(UserWarning, match=r"read with up='-y' .*up='z'"):
        read_gltf(path, up="-y")
    upright = read_gltf(path, up="z")
    assert float((upright.positions() - walk.positions()).abs().max()) < 1e-4


def test_roles_frames_and_what_they_may_be(walk, tmp_path):
    path = mixamo(walk).save(tmp_path / "clip.glb")
    said = read_gltf(path, roles={"chest": "mixamorig:Spine", "spine": ""})
    assert said.skeleton.names[said.skeleton.roles["chest"]] == "mixamorig:Spine"
    assert len(read_gltf(path, tpose_first=True)) == len(walk) - 1
    # the nodes stand as in the first frame
    assert len(read_gltf(path, drop_zeros=True)) == len(walk) - 1
    for options, words in (
        ({"roles": {"left_foot": "Fuss"}}, r"clip\.glb: .*no such joint"),
        ({"roles": {"foot": "Fuss"}}, r"clip\.glb: .*no role"),
        ({"units": "yd"}, "Unknown unit"),
        ({"up": "w"}, "no axis"),
        ({"fps": -1}, "positive number of frames"),
        ({"rigid": "median"}, "use 'mean'"),
        (
            {"root": "Fuss"},
            r"clip\.glb: there is no joint 'Fuss'; root= may be one of 'mixamorig:H",
        ),
    ):
        with pytest.raises(GltfError, match=words) as raised:
            read_gltf(path, **options)
        assert not isinstance(raised.value, BvhError)


def test_a_crouch_is_no_fallen_world(walk, tmp_path):
    """Nodes that stand upright when nothing plays tell that y is up."""
    bow = torch.from_numpy(Rotation.from_euler("X", 80, degrees=True).as_matrix()).float()
    rotations = walk.rotations.clone()
    rotations[:, 0] = rotations[:, 0] @ bow
    write_gltf(replace(walk, rotations=rotations), tmp_path / "bow.glb")
    read_gltf(tmp_path / "bow.glb")  # without a warning


def test_a_path_that_is_none(tmp_path):
    for path in (3, None, tmp_path, tmp_path / "none.glb", os.fspath(tmp_path) + "\0.glb"):
        with pytest.raises(GltfError, match="can't be opened|is not a path"):
            read_gltf(path)
    assert Path(tmp_path).exists()
