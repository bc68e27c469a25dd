"""glTF as a file: where its numbers lie and how, and everything that can be wrong with it."""

from __future__ import annotations

import copy
import json
import warnings

import numpy as np
import pytest
from gltf_files import Gltf, mixamo, skin
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from motionlab import Motion, read_gltf
from motionlab.datasets import gaits
from motionlab.errors import GltfError
from motionlab.io.bvh_reading import Reading
from motionlab.io.gltf_file import File
from motionlab.io.gltf_reading import parse

TURNS = Rotation.random(5, random_state=5).as_quat()


@pytest.fixture(scope="module")
def walk() -> Motion:
    return gaits.make(seconds=0.2, speed=1.4, turn_rate=0.4, seed=3)


def check_walks(read: Motion, walk: Motion) -> None:
    assert float((read.positions() - walk.positions()).abs().max()) < 1e-4


def pair() -> Gltf:
    gltf = Gltf([{"name": "a", "children": [1]}, {"name": "b", "translation": [0, 1, 0]}])
    skin(gltf, [0, 1], np.tile(np.eye(4), (2, 1, 1)))
    return gltf


def turned(gltf: Gltf) -> Rotation:
    motion, _ = parse(gltf.glb(), "clip.glb", Reading())
    return Rotation.from_matrix(motion.rotations[:, 0].numpy())


def near(turns: Rotation, most: float) -> bool:
    return bool((turns * Rotation.from_quat(TURNS).inv()).magnitude().max() < most)


# -- where numbers lie ----------------------------------------------------------------------------


def test_numbers_in_the_text_or_beside_it(walk, tmp_path):
    gltf = mixamo(walk)
    clip = tmp_path / "clip.gltf"
    for kind in ("application/octet-stream", "application/gltf-buffer"):
        clip.write_bytes(b"\xef\xbb\xbf" + gltf.gltf(kind=kind))
        check_walks(read_gltf(clip), walk)
    (tmp_path / "parts").mkdir()
    (tmp_path / "parts" / "mein Gang ü.bin").write_bytes(gltf.buffer)
    for uri in ("parts/mein%20Gang%20%C3%BC.bin", "parts/../parts/mein Gang ü.bin"):
        clip.write_bytes(gltf.gltf(uri))
        check_walks(read_gltf(clip), walk)
    with pytest.raises(GltfError, match=r"lie in another file, 'parts.*export it as one \.glb"):
        parse(clip.read_bytes(), "clip.gltf", Reading())


def test_nothing_is_read_outside_the_folder(walk, tmp_path):
    gltf = mixamo(walk)
    inside = tmp_path / "inside"
    inside.mkdir()
    (tmp_path / "walk.bin").write_bytes(gltf.buffer)
    (inside / "link.bin").symlink_to(tmp_path / "walk.bin")
    for uri in (
        "../walk.bin",
        "%2e%2e/walk.bin",
        f"{tmp_path}/walk.bin",
        "link.bin",
        "x/../../walk.bin",
    ):
        (inside / "clip.gltf").write_bytes(gltf.gltf(uri))
        with pytest.raises(GltfError, match=r"clip\.gltf: .*outside its folder.*; put that file"):
            read_gltf(inside / "clip.gltf")
    for uri in ("file:///walk.bin", "https://example.org/walk.bin"):
        (inside / "clip.gltf").write_bytes(gltf.gltf(uri))
        with pytest.raises(GltfError, match="lie at .*save that beside it"):
            read_gltf(inside / "clip.gltf")
    for uri in ("none.bin", ".", "a\0b", "x" * 5000):
        (inside / "clip.gltf").write_bytes(gltf.gltf(uri))
        with pytest.raises(GltfError, match="can't be opened"):
            read_gltf(inside / "clip.gltf")


@pytest.mark.parametrize("dtype, near_", [("i1", 0.02), ("<i2", 1e-4), ("<f4", 1e-5)])
@pytest.mark.parametrize("stride", [0, 20])
def test_numbers_as_fractions_and_between_others(dtype, near_, stride):
    gltf = pair()
    fraction = {"normalized": True} if dtype != "<f4" else {}
    moves = {(0, "rotation"): (np.arange(5) / 30, TURNS, "LINEAR")}
    gltf.animate(moves, dtype=dtype, stride=stride, **fraction)
    numbers = File(gltf.glb(), "clip.glb").numbers(len(gltf.json["accessors"]) - 1, "VEC4")
    assert np.abs(numbers - TURNS).max() < near_
    assert near(turned(gltf), near_)


def test_sparse_numbers():
    """Three of five keys are said one by one, over what lies there or over zeros."""
    for base in (TURNS[[0, 0, 2, 2, 2]], None):
        gltf = pair()
        gltf.animate({(0, "rotation"): (np.arange(5) / 30, TURNS, "LINEAR")})
        about = gltf.json["accessors"][-1]
        which = [1, 3, 4] if base is not None else [0, 1, 2, 3, 4]
        if base is None:
            del about["bufferView"]
        else:
            about["bufferView"] = gltf.view(base.astype("<f4").tobytes())
        about["sparse"] = {
            "count": len(which),
            "indices": {"bufferView": gltf.view(bytes(which)), "componentType": 5121},
            "values": {"bufferView": gltf.view(TURNS[which].astype("<f4").tobytes())},
        }
        assert near(turned(gltf), 1e-5)
        about["sparse"]["indices"]["bufferView"] = gltf.view(bytes([9] * 5))
        with pytest.raises(GltfError, match="replaces what is not there"):
            turned(gltf)


def test_compressed_numbers_are_told():
    gltf = pair()
    gltf.animate({(0, "rotation"): (np.arange(5) / 30, TURNS, "LINEAR")})
    gltf.json["extensionsRequired"] = ["KHR_draco_mesh_compression"]  # of meshes, not our business
    assert near(turned(gltf), 1e-5)
    gltf.json["bufferViews"][-1]["extensions"] = {"EXT_meshopt_compression": {}}
    with pytest.raises(
        GltfError, match=r"compressed \(EXT_meshopt_compression\); export it without"
    ):
        turned(gltf)


# -- damaged files --------------------------------------------------------------------------------


def test_damaged_files(walk, tmp_path):
    good = mixamo(walk).glb()
    length = int.from_bytes(good[12:16], "little")
    for data, words in (
        (b"", "empty; copy or download"),
        (b"  \n", "empty"),
        (b"HIERARCHY\nROOT Hips", "begins with b'HIERARCHY.*no glTF file"),
        (b"Kaydara FBX Binary  \0", "begins with b'Kaydara FBX"),
        (good[:8], "cut off"),
        (good[:1000], "cut off"),
        (good[:-8], "cut off"),
        (good[:4] + b"\1" + good[5:], "version 1; export it as glTF 2.0"),
        (good[:16] + b"NOSJ" + good[20:], "no part that is JSON"),
        (good[:20] + b"?" + good[21:], "JSON is broken"),
        (good[:20] + b"\xff" + good[21:], "JSON is broken"),
        (good[:8] + (20 + length).to_bytes(4, "little") + good[12:], "buffer 0 is not in the file"),
        (b"{}", "its asset is None"),
        (b'{"asset": {"version": "1.0"}}', "glTF '1.0'"),
        (b'{"asset": {"version": "2.0"}, "nodes": 3}', "nodes are 3, no list"),
        (b'{"asset": {"version": "2.0"}, "nodes": [3]}', "node 0 is 3, no object"),
        (b'{"asset": ' + b"[" * 100_000, "JSON is broken"),
    ):
        (tmp_path / "clip.glb").write_bytes(data)
        with pytest.raises(GltfError, match=rf"clip\.glb: .*{words}"):
            read_gltf(tmp_path / "clip.glb")


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 2**30), st.integers(0, 255))
def test_a_byte_that_is_wrong_is_no_traceback(walk, place, byte):
    data = bytearray(mixamo(walk[:2]).glb())
    data[place % len(data)] = byte
    check_survives(bytes(data))


JUNK = st.sampled_from([None, -1, 3, 1e300, 0.5, True, "x", [], {}, [None], {"x": 1}, 10**30])


def leaves(tree, path=()):
    """Paths of everything in a JSON tree."""
    if path:
        yield path
    for key in (
        tree if isinstance(tree, dict) else range(len(tree)) if isinstance(tree, list) else ()
    ):
        yield from leaves(tree[key], (*path, key))


@settings(max_examples=150, deadline=None)
@given(st.data())
def test_an_object_that_is_wrong_is_no_traceback(data):
    gltf = pair()
    gltf.json["nodes"][0] |= {"rotation": [0, 0, 0, 1], "scale": [1, 1, 1]}
    gltf.animate({(0, "rotation"): (np.arange(3) / 30, TURNS[:3], "LINEAR")}, "x")
    tree = json.loads(gltf.gltf())
    path = data.draw(st.sampled_from(list(leaves(tree))))
    inside = copy.deepcopy(tree)
    place = inside
    for key in path[:-1]:
        place = place[key]
    place[path[-1]] = data.draw(JUNK)
    check_survives(json.dumps(inside).encode())


def check_survives(data: bytes) -> None:
    """A motion, or an error with the file's name in it."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            motion, _ = parse(data, "clip.glb", Reading())
        except GltfError as error:
            assert str(error).startswith("clip.glb: ")
        else:
            assert bool(motion.positions().isfinite().all())
