"""The 3D scene: parts are where the motion says, and the page holds all it needs."""

import base64
import io
import json
import re
import zipfile

import numpy as np
import pytest
import torch

from motionlab import Motion, MotionLabError, Skeleton
from motionlab.errors import ViewerError
from motionlab.viewer import scene
from motionlab.viewer.live.scene_page import DOTS_PER_SECOND, viewer_script, write_viewer


@pytest.fixture(scope="module")
def motion() -> Motion:
    """Half a second of falling joints: every rotation random, the root on its way; 30 fps."""
    skeleton = Skeleton.canonical()
    random = torch.Generator().manual_seed(1)
    turns = torch.linalg.qr(torch.randn(40, skeleton.joints, 3, 3, generator=random))[0]
    turns = turns * turns.det().sign()[..., None, None]
    root = torch.linspace(0, 3, 40)[:, None] * torch.tensor([1.0, 0.0, 0.5])
    return Motion(skeleton, root + torch.tensor([0.0, 0.95, 0.0]), turns, 30.0, name="falling")


def test_parts_are_where_the_motion_says(motion):
    shown = scene(motion, 20, "left_hand", trail=0.4)
    hand = motion.skeleton.roles["left_hand"]
    points = shown.take.positions
    below = shown.take.on_floor(shown.take.hips[20])
    for actor, bone, length in zip(shown.limbs, shown.take.bones, shown.lengths, strict=True):
        ends = np.array([[0, 0, 0, 1], [0, length, 0, 1]]) @ actor.user_matrix.T
        np.testing.assert_allclose(ends[:, :3], points[20, bone[:2].astype(int)] - below, atol=1e-6)
    axes = shown.arrows[0].user_matrix
    np.testing.assert_allclose(axes[:3, :3], motion.orientations()[20, hand], atol=1e-6)
    dots = [actor.user_matrix for actor in shown.dots if actor.user_matrix[0, 0] > 0.5]
    assert len(dots) == 0.4 * DOTS_PER_SECOND
    np.testing.assert_allclose(dots[2][:3, 3], points[20 - 6, hand] - below, atol=1e-6)


def test_pose_moves_and_chooses(motion):
    shown = scene(motion)
    assert all(actor.user_matrix[0, 0] < 1e-3 for actor in [*shown.arrows, *shown.dots])
    before = [actor.user_matrix.copy() for actor in shown.limbs]
    shown.pose(30, motion.skeleton.roles["left_foot"], 1.0)
    assert not np.allclose(before[0], shown.limbs[0].user_matrix)
    assert len({tuple(actor.prop.color.float_rgb) for actor in shown.limbs}) == 2


def content(html: str) -> dict:
    return json.loads(re.search(r'<script type="application/json">(.*?)</script>', html)[1])


def numbers(text: str, kind: str) -> np.ndarray:
    return np.frombuffer(base64.b64decode(text), kind)


def test_the_page_holds_the_motion(motion, monkeypatch):
    monkeypatch.setenv("MOTIONLAB_VIEWER", "page")
    monkeypatch.setenv("MOTIONLAB_BACKEND", "matplotlib")
    shown = scene(motion, 3, "head")
    bundle = shown._repr_mimebundle_()
    assert list(bundle) == ["text/html"], "no widget state in a built page"
    html = bundle["text/html"]
    assert len(html) < 300_000 and "http://" not in html and "https://" not in html
    held = content(html)
    hips = numbers(held["hips"], "<f4").reshape(-1, 1, 3)
    local = numbers(held["local"], "<i2").reshape(held["frames"], held["points"], 3)
    np.testing.assert_allclose(hips + held["unit"] * local, motion.positions(), atol=1e-3)
    assert held["joint"] == motion.skeleton.roles["head"] and held["frame"] == 3
    with zipfile.ZipFile(io.BytesIO(base64.b64decode(held["zip"]))) as archive:
        saved = json.loads(archive.read("index.json"))
    actors = re.findall(r'"type": "vtk(?:OpenGL)?Actor"', json.dumps(saved["scene"]))
    assert len(actors) == 2 + len(held["feet"]) + len(held["bones"]) + 3 + held["dots"]


def test_long_motions_are_thinned_for_the_page(motion, monkeypatch):
    monkeypatch.setenv("MOTIONLAB_BACKEND", "matplotlib")
    long = motion
    for _ in range(4):
        long = long + long
    held = content(scene(long, 100).html())
    assert (held["stride"], held["frames"], held["frame"]) == (3, 214, 33)


def test_the_viewer_is_one_classic_script(tmp_path, motion, monkeypatch):
    monkeypatch.setenv("MOTIONLAB_BACKEND", "matplotlib")
    path = write_viewer(tmp_path)
    assert path.name == "motionlab-scene.js" and path.read_text("utf-8") == viewer_script()
    assert "OfflineLocalView" in viewer_script() and "import.meta" not in viewer_script()
    alone = scene(motion).save(tmp_path / "alone.html")
    assert alone.stat().st_size > path.stat().st_size, "vtk.js is inside"


def test_only_a_page_can_be_saved(motion, tmp_path):
    shown = scene(motion)
    for name, message in (("scene.png", "must end in .html"), ("no/scene.html", "no folder")):
        with pytest.raises(ViewerError, match=message):
            shown.save(tmp_path / name)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    "arguments, message",
    [
        ({"joint": "tail"}, "LeftFoot"),
        ({"joint": 99}, "99"),
        ({"frame": 40}, "40 frames"),
        ({"trail": 5.0}, "between 0 and 2"),
        ({"size": (1, 1)}, "pixels"),
    ],
)
def test_what_cannot_be_shown_is_said(motion, arguments, message):
    with pytest.raises(MotionLabError, match=message):
        scene(motion, **arguments)
    with pytest.raises(MotionLabError, match="Motion"):
        scene(motion.positions())
