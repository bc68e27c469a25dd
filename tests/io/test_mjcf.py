"""MuJoCo models: bodies and keys worked out by hand, and by MuJoCo where it is installed."""

from __future__ import annotations

from dataclasses import replace
from xml.etree import ElementTree

import numpy as np
import pytest
import roma
import torch
from scipy.spatial.transform import Rotation

from motionlab import Motion, Skeleton
from motionlab.datasets import gaits
from motionlab.errors import MotionFileError
from motionlab.io.mjcf import write_mjcf

WALK = gaits.make(seconds=0.2, speed=1.2, turn_rate=0.5, name="walk")


def odd() -> Motion:
    """A tree that is not numbered depth first, with bones and end sites of no length, names to escape."""
    chance = torch.Generator().manual_seed(0)
    skeleton = Skeleton(
        ["a <b>", "b&c", '"c"', "d", "e"], [-1, 0, 0, 1, 2], torch.tensor([[1.0, 2, 3], [0, 1, 0], [0, 0, 0], [0.5, 0, 0], [0, 0, 2]]),
        [3, 3, 4], torch.tensor([[0.0, 0, 1], [1, 0, 0], [0, 0, 0]]),
    )  # fmt: skip
    turns = roma.random_rotmat((3, 5), generator=chance)
    return Motion(skeleton, torch.randn(3, 3, generator=chance), turns, 24, name='x "y"')


def y_up(places: np.ndarray) -> np.ndarray:
    return np.stack([places[..., 0], places[..., 2], -places[..., 1]], axis=-1)


def by_hand(path) -> tuple[np.ndarray, list[str]]:
    """Where bodies are in each key, (keys, bodies, 3), z up, and their names."""
    tree = ElementTree.parse(path).getroot()
    bodies = list(tree.iter("body"))
    above = {child: body for body in bodies for child in body.findall("body")}
    places = []
    for key in tree.iter("key"):
        qpos = np.array(key.get("qpos").split(), float)
        turns = Rotation.from_quat(qpos[3:].reshape(-1, 4)[:, [1, 2, 3, 0]])
        at, turn = {}, {}
        for body, local in zip(bodies, turns, strict=True):
            if body not in above:
                at[body], turn[body] = qpos[:3], local
                continue
            its = above[body]
            at[body] = at[its] + turn[its].apply(np.array(body.get("pos").split(), float))
            turn[body] = turn[its] * local
        places.append([at[body] for body in bodies])
    return np.array(places), [body.get("name") for body in bodies]


@pytest.mark.parametrize("motion", [WALK, odd()], ids=["walk", "odd"])
def test_bodies_are_where_the_joints_are(motion, tmp_path):
    write_mjcf(motion, tmp_path / "walk.xml")
    places, names = by_hand(tmp_path / "walk.xml")
    expected = motion.positions()[:, [motion.skeleton.index(name) for name in names]]
    np.testing.assert_allclose(y_up(places), expected.numpy(), atol=1e-5)
    assert sorted(names) == sorted(motion.skeleton.names)


@pytest.mark.parametrize("motion", [WALK, odd()], ids=["walk", "odd"])
def test_mujoco_has_them_there(motion, tmp_path):
    mujoco = pytest.importorskip("mujoco", reason="needs pip install mujoco")
    write_mjcf(motion, tmp_path / "walk.xml")
    model = mujoco.MjModel.from_xml_path(str(tmp_path / "walk.xml"))
    data = mujoco.MjData(model)
    np.testing.assert_allclose(data.qpos[7:].reshape(-1, 4), [[1, 0, 0, 0]] * (model.nbody - 2))
    assert model.key(1).name == "frame 1" and model.key_time[1] == pytest.approx(1 / motion.fps)
    assert model.nkey == len(motion) and model.opt.timestep == pytest.approx(1 / motion.fps)
    for frame, points in enumerate(motion.positions().numpy()):
        data.qpos[:] = model.key_qpos[frame]
        mujoco.mj_forward(model, data)
        for name, point in zip(motion.skeleton.names, points, strict=False):
            np.testing.assert_allclose(y_up(data.body(name).xpos), point, atol=1e-5)
    if motion is WALK:
        end = y_up(data.site("HeadEnd").xpos)
        np.testing.assert_allclose(end, points[motion.skeleton.joints], atol=1e-5)


@pytest.mark.parametrize("motion", [WALK, odd()], ids=["walk", "odd"])
def test_keys_have_names_and_times_and_the_body_begins_on_a_floor(motion, tmp_path):
    """As it is loaded: all turns are none, and the root is where its body's pos says."""
    write_mjcf(motion, tmp_path / "walk.xml")
    tree = ElementTree.parse(tmp_path / "walk.xml").getroot()
    keys = [(key.get("name"), float(key.get("time"))) for key in tree.iter("key")]
    assert keys == [(f"frame {i}", pytest.approx(i / motion.fps)) for i in range(len(motion))]
    world = tree.find("worldbody")
    assert world.find("geom").get("type") == "plane" and world.find("light") is not None
    assert {geom.get("contype") for geom in tree.iter("geom")} == {"0"}

    def heights(body, above):
        own = above + np.array(body.get("pos").split(), float)[2]
        ends = [own + float(site.get("pos").split()[2]) for site in body.findall("site")]
        return [own, *ends, *(z for child in body.findall("body") for z in heights(child, own))]

    assert min(heights(world.find("body"), 0.0)) == pytest.approx(0, abs=1e-6)


def test_bad_input(tmp_path):
    for motion, path, words in (
        (WALK, tmp_path / "walk.mjcf", "must end in .xml, for example walk.xml"),
        (WALK[:0], tmp_path / "walk.xml", "no frames"),
        (WALK, tmp_path / "none" / "walk.xml", "can't be written"),
    ):
        with pytest.raises(MotionFileError, match=words):
            write_mjcf(motion, path)
    grad = replace(WALK, rotations=WALK.rotations.clone().requires_grad_())
    write_mjcf(grad, tmp_path / "WALK.XML")
    assert [path.name for path in tmp_path.iterdir()] == ["WALK.XML"]
