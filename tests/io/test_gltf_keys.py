"""glTF animations: which one, at what rate, and what they do from key to key."""

from __future__ import annotations

import numpy as np
import pytest
from gltf_files import Gltf, skin, worlds
from scipy.spatial.transform import Rotation

from motionlab import Motion, read_gltf
from motionlab.errors import GltfError

TURNS = Rotation.random(6, random_state=5).as_quat()
# as exporters do not: neighbours in different halves of the sphere
TURNS[3:] *= -1


def chain() -> Gltf:
    """Three joints, one above the other."""
    nodes = [{"name": name, "translation": [0.1, 0.5, 0]} for name in ("a", "b", "c")]
    nodes[0]["children"], nodes[1]["children"] = [1], [2]
    gltf = Gltf(nodes)
    skin(gltf, [0, 1, 2], np.tile(np.eye(4), (3, 1, 1)))
    return gltf


@pytest.fixture
def read(tmp_path):
    return lambda gltf, **options: read_gltf(gltf.save(tmp_path / "clip.glb"), **options)


def check(gltf: Gltf, motion: Motion, start: float = 0.0) -> None:
    times = np.float32(start) + np.arange(len(motion)) / motion.fps
    at = worlds(gltf, times, 0)[:, :3]
    np.testing.assert_allclose(motion.positions(), at[..., :3, 3], atol=1e-5)
    np.testing.assert_allclose(motion.orientations(), at[..., :3, :3], atol=1e-5)


def test_ways_from_key_to_key(read):
    """LINEAR along the shorter arc, STEP, CUBICSPLINE; each track has keys at times of its own."""
    gltf, random = chain(), np.random.default_rng(1)
    gltf.animate(
        {
            (0, "translation"): ([0.3, 0.9, 2.0], random.normal(size=(9, 3)), "CUBICSPLINE"),
            (0, "rotation"): ([0.2, 0.7, 1.1], TURNS[2:5], "LINEAR"),
            (1, "rotation"): ([0.0, 0.5, 1.5], TURNS[:3], "STEP"),
            (2, "rotation"): ([0.5, 1.0], random.normal(size=(6, 4)), "CUBICSPLINE"),
        }
    )
    motion = read(gltf, fps=17)
    assert len(motion) == 35 and motion.fps == 17
    check(gltf, motion)
    with pytest.warns(UserWarning, match=r"no even rate.* 30 frames .*fps="):
        check(gltf, read(gltf))


@pytest.mark.parametrize("rate", [1, 4, 5, 7.5, 10, 24, 29.97, 30, 59.94, 60, 120, 240])
def test_the_rate_is_that_of_the_keys(rate, read):
    gltf = chain()
    times = 300.04 + np.arange(6 * 40) / rate  # where float32 is rounded to 0.03 ms
    gltf.animate({(0, "rotation"): (times, np.tile(TURNS, (40, 1)), "LINEAR")})
    motion = read(gltf)
    assert motion.fps == pytest.approx(rate, rel=1e-5) and len(motion) == 240
    turns = Rotation.from_matrix(motion.rotations[:, 0].numpy())
    assert (turns * Rotation.from_quat(np.tile(TURNS, (40, 1))).inv()).magnitude().max() < 1e-3


def test_keys_that_were_left_out_or_rounded(read):
    """Exporters leave out what interpolation gives, and some round to milliseconds."""
    times = np.arange(60) / 30
    keep = np.delete(np.arange(60), [3, 4, 10, 20, 21, 22, 40])
    for keys in (times[keep], times.round(3)[keep], times + 1e-5 * np.sin(times * 99)):
        gltf = chain()
        values = np.tile(TURNS, (10, 1))[: len(keys)]
        gltf.animate({(1, "rotation"): (keys, values, "LINEAR"),
                      (0, "rotation"): (keys[[0, -1]], TURNS[:2], "LINEAR")})  # fmt: skip
        motion = read(gltf)
        assert (motion.fps, len(motion)) == (30, 60)


@pytest.mark.parametrize("times", [[0, 0.5, 1.0], [0, 2.0], [0, 0.04, 0.3, 0.31, 1.0]])
def test_poses_at_no_rate_are_told(times, read):
    gltf = chain()
    gltf.animate({(0, "rotation"): (times, TURNS[: len(times)], "LINEAR")})
    with pytest.warns(UserWarning, match=r"clip\.glb: the keys .* fps="):
        motion = read(gltf)
    assert motion.fps == 30 and len(motion) == round(times[-1] * 30) + 1
    check(gltf, motion)
    assert len(read(gltf, fps=2)) == int(times[-1] * 2) + 1


@pytest.mark.parametrize(
    "rate, keys, way", [(5, 40, "CUBICSPLINE"), (6, 9, "LINEAR"), (0.5, 40, "STEP")]
)
def test_even_keys_that_may_be_poses_are_told(rate, keys, way, read):
    """What lies between poses counts."""
    gltf = chain()
    values = Rotation.random(keys, random_state=3).as_quat()
    values = np.repeat(values, 3, axis=0) if way == "CUBICSPLINE" else values
    gltf.animate({(0, "rotation"): (np.arange(keys) / rate, values, way)})
    words = rf"come as poses do, {rate} per second; .* at 30 frames .* pass {rate}, .* as fps="
    with pytest.warns(UserWarning, match=words):
        motion = read(gltf)
    assert (motion.fps, len(motion)) == (30, round((keys - 1) * 30 / rate) + 1)
    check(gltf, motion)
    assert len(read(gltf, fps=rate)) == keys


def test_one_key_is_one_frame(read):
    gltf = chain()
    gltf.animate({(0, "rotation"): ([1.0], TURNS[:1], "LINEAR")})
    assert len(read(gltf)) == 1


def test_one_of_several_animations(read):
    gltf = chain()
    for name, last in (("Idle", 3), ("Walk", 4), ("Walk", 5), (None, 6)):
        times = np.arange(last) / 30
        gltf.animate({(0, "rotation"): (times, TURNS[:last], "LINEAR")}, name)
    gltf.animate({(3, "translation"): ([0, 1], np.eye(3)[:2], "LINEAR")}, "mesh")
    gltf.json["animations"][0]["channels"].append({"sampler": 0, "target": {"path": "rotation"}})
    listed = r"'Idle' \(0\), 'Walk' \(1\), 'Walk' \(2\), '' \(3\)"
    with pytest.raises(GltfError, match=rf"4 animations: {listed}; .*animation='Idle'"):
        read(gltf)
    for asked, frames in (("Idle", 3), (0, 3), (1, 4), ("2", 5), (3, 6)):
        assert len(read(gltf, animation=asked)) == frames
    with pytest.raises(GltfError, match="several .* 'Walk': .*by its number"):
        read(gltf, animation="Walk")
    for asked in ("Run", 4, -1, 1.5, "mesh"):
        with pytest.raises(GltfError, match=rf"animation= may be one of {listed}"):
            read(gltf, animation=asked)
    del gltf.json["animations"][:4]  # what is left moves no joint
    with pytest.warns(UserWarning, match="no animation"):
        assert len(read(gltf)) == 1


@pytest.mark.parametrize(
    "change, words",
    [
        (lambda a: a["channels"][0].update(sampler=9), "has no keys"),
        (lambda a: a["channels"][0].update(sampler=None), "has no keys"),
        (lambda a: a["channels"][0]["target"].update(node=44), "names node 44"),
        (lambda a: a["channels"].append(a["channels"][0]), "animated twice"),
        (lambda a: a["samplers"][0].update(interpolation="CUBIC"), "'CUBIC', which glTF"),
        (lambda a: a["samplers"][0].update(interpolation="CUBICSPLINE"), "keys with 1 values"),
        (lambda a: a["samplers"][0].update(output=a["samplers"][0]["input"]), "SCALAR.* VEC4"),
        (lambda a: a["samplers"][0].update(input=99), "names accessor 99"),
    ],
)
def test_animations_that_are_wrong(change, words, read):
    gltf = chain()
    gltf.animate({(0, "rotation"): (np.arange(3) / 30, TURNS[:3], "LINEAR")})
    change(gltf.json["animations"][0])
    with pytest.raises(GltfError, match=rf"clip\.glb: .*{words}"):
        read(gltf)


@pytest.mark.parametrize(
    "times, turns, words",
    [
        ([0, 1, 1], TURNS[:3], "do not ascend"),
        ([0, np.nan, 1], TURNS[:3], "no numbers"),
        ([0, 0.1, 0.2], [*TURNS[:2], [np.inf] * 4], "no numbers"),
        ([0, 0.1, 0.2], [*TURNS[:2], [0] * 4], "no rotation"),
        ([0, 1, 1e9], TURNS[:3], "too long"),
        ([], np.zeros((0, 4)), "0 keys"),
    ],
)
def test_keys_that_are_wrong(times, turns, words, read):
    gltf = chain()
    add = gltf.add
    gltf.add = lambda values, *args, **more: add(
        np.reshape(values, (-1, 4 if np.ndim(values) > 1 else 1)), *args, **more
    )
    if not times:
        gltf.animate({(0, "rotation"): ([0.0], TURNS[:1], "LINEAR")})
        for accessor in gltf.json["accessors"][-2:]:
            accessor["count"] = 0
    else:
        gltf.animate({(0, "rotation"): (times, turns, "LINEAR")})
        for accessor in gltf.json["accessors"]:  # JSON has no NaN
            accessor.pop("min"), accessor.pop("max")
    with pytest.raises(GltfError, match=rf"clip\.glb: .*{words}"):
        read(gltf)
