"""What other programs need of the GLB files that we write: names, end sites, the time of the last key."""

from __future__ import annotations

import numpy as np
import pytest
import torch
from glb_reader import Glb
from three_in_node import in_three, three_plays

from motionlab import Motion, read_gltf, write_gltf
from motionlab.datasets import gaits

WALK = gaits.make(seconds=1, speed=1.2, name="walk")


@pytest.fixture
def write(tmp_path):
    def written(motion, **options) -> Glb:
        path = tmp_path / "motion.glb"
        write_gltf(motion, path, **options)
        return Glb(path)

    return written


def still(frames: int, fps: float = 30) -> Motion:
    turns = torch.eye(3).expand(frames, WALK.skeleton.joints, 3, 3)
    return Motion(WALK.skeleton, torch.zeros(frames, 3), turns, fps)


@pytest.mark.parametrize("name", ["walk", "Hips", "HeadEnd", "Hips_body"])
@pytest.mark.parametrize("root_motion", [None, "ground"])
def test_an_animation_is_called_as_no_node_is(write, name, root_motion):
    """assimp 0.0.10, in JavaScript, exports no file in which one is."""
    tree = write(WALK[:2], name=name, root_motion=root_motion).tree
    names = [node["name"] for node in tree["nodes"]]
    assert len(set(names)) == len(names)
    assert tree["animations"][0]["name"] not in [*names, tree["meshes"][0]["name"]]


def test_end_sites_are_joints_of_the_skin(write, tmp_path):
    """They carry the round ends of hands and toes; the skull is the head's. Nodes that carry nothing are cleared away by gltf-transform's prune()."""
    glb, skeleton = write(WALK[:2]), WALK.skeleton
    assert glb.tree["skins"][0]["joints"] == list(range(skeleton.points))
    mesh = glb.mesh()
    for end, name in enumerate(skeleton.point_names[21:], start=21):
        carried = ((mesh["JOINTS_0"] == end) & (mesh["WEIGHTS_0"] > 0)).any(1)
        away = np.linalg.norm(mesh["POSITION"][carried] - glb.worlds()[0, end, :3, 3], axis=1)
        assert len(away) == 0 if name == "HeadEnd" else 0 < away.max() < 0.06, name
    again = read_gltf(tmp_path / "motion.glb").skeleton
    assert again.matches(skeleton) and again.names == skeleton.names


@pytest.mark.parametrize("fps, frames", [(30, 300), (25, 26), (120, 2), (29.97, 91), (30, 1)])
def test_the_last_frame_is_shown_by_players_that_begin_anew_and_that_stop(write, fps, frames):
    """Anew at the time of the last key: it must be later than that of the last frame, also in float32."""
    motion = still(frames, fps)
    times = write(motion).keys("rotation")[0][0]
    last = (frames - 1) / fps
    assert len(times) == frames and abs(times[-1] - last) < 1e-6
    assert frames == 1 or times[-1] > max(last, np.float32(last))


@in_three
def test_three_shows_the_last_frame(write, tmp_path):
    write(WALK)
    last = (len(WALK) - 1) / WALK.fps
    played = three_plays(tmp_path / "motion.glb", 0, last, last + 1 / WALK.fps)
    expected = WALK.positions().numpy()
    for way, frames in (("loop", (0, -1)), ("stop", (0, -1, -1))):
        for places, frame in zip(played[way], frames, strict=False):
            for point, name in enumerate(WALK.skeleton.point_names):
                np.testing.assert_allclose(places[name], expected[frame, point], atol=1e-4)
