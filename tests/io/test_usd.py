"""USD files: joints worked out from the text, and by UsdSkel where it is installed."""

from __future__ import annotations

import ast
import re
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from motionlab import Motion
from motionlab.datasets import gaits
from motionlab.errors import MotionFileError
from motionlab.io.usd import write_usd

WALK = gaits.make(seconds=0.2, speed=1.2, turn_rate=0.5, name="walk")


def called(name: str, start: str) -> Motion:
    names = [start + joint for joint in WALK.skeleton.names]
    return replace(WALK, name=name, skeleton=replace(WALK.skeleton, names=names, roles=None))


def by_hand(text: str) -> np.ndarray:
    """Where joints are in each frame, (frames, joints, 3)."""
    joints = ast.literal_eval(re.search(r"joints = (\[.*\])", text)[1])
    parents = [joints.index(path.rpartition("/")[0]) if "/" in path else -1 for path in joints]
    samples = lambda what: np.array([
        ast.literal_eval(row)
        for row in re.findall(r"\d+: (\[.*\]),", text.split(f"{what}.timeSamples")[1].split("}")[0])
    ])  # fmt: skip
    shifts, quaternions = samples("translations"), samples("rotations")
    at, turn = [], []
    for joint, parent in enumerate(parents):
        local = Rotation.from_quat(quaternions[:, joint][:, [1, 2, 3, 0]])
        at.append(
            shifts[:, joint] if parent < 0 else at[parent] + turn[parent].apply(shifts[:, joint])
        )
        turn.append(local if parent < 0 else turn[parent] * local)
    return np.stack(at, axis=1)


@pytest.mark.parametrize(
    "motion", [WALK, called("3 ways", "mixamorig:"), called("ü", "Knöchel 1.")]
)
def test_joints_are_where_the_points_are(motion, tmp_path):
    write_usd(motion, tmp_path / "walk.usda")
    text = (tmp_path / "walk.usda").read_text(encoding="ascii")
    np.testing.assert_allclose(by_hand(text), motion.positions().numpy(), atol=1e-5)
    assert f"endTimeCode = {len(motion) - 1}\n" in text and "timeCodesPerSecond = 30\n" in text
    names = [
        *re.findall(r'def \w+ "(.*)" \(', text),
        *re.split("[/,]", re.search(r"joints = \[(.*)\]", text)[1]),
    ]
    assert all(re.fullmatch("[A-Za-z_][A-Za-z0-9_]*", name.strip(' "')) for name in names)


@pytest.mark.parametrize("motion", [WALK, called("3 ways", "mixamorig:")])
def test_usd_has_them_there(motion, tmp_path):
    pxr = pytest.importorskip("pxr", reason="needs pip install usd-core")
    from pxr import Usd, UsdGeom, UsdSkel

    write_usd(motion, tmp_path / "walk.usda")
    stage = Usd.Stage.Open(str(tmp_path / "walk.usda"))
    root, cache, all_ = (
        UsdSkel.Root(stage.GetDefaultPrim()),
        UsdSkel.Cache(),
        Usd.TraverseInstanceProxies(),
    )
    cache.Populate(root, all_)
    (binding,) = cache.ComputeSkelBindings(root, all_)
    query = cache.GetSkelQuery(binding.GetSkeleton())
    (skinned,) = binding.GetSkinningTargets()
    for frame, points in enumerate(motion.positions().numpy()):
        found = [each.ExtractTranslation() for each in query.ComputeJointSkelTransforms(frame)]
        np.testing.assert_allclose(np.array(found), points, atol=1e-5)
        vertices = UsdGeom.Mesh(skinned.GetPrim()).GetPointsAttr().Get()
        assert skinned.ComputeSkinnedPoints(query.ComputeSkinningTransforms(frame), vertices, frame)
        off = np.linalg.norm(np.array(vertices)[:, None] - points, axis=-1).min(1)
        assert off.max() < 0.25 and pxr  # the figure is round the points


def test_bad_input(tmp_path):
    for motion, path, words in (
        (WALK, tmp_path / "walk.usd", "must end in .usda, for example walk.usda"),
        (WALK[:0], tmp_path / "walk.usda", "no frames"),
        (WALK, tmp_path / "none" / "walk.usda", "can't be written"),
    ):
        with pytest.raises(MotionFileError, match=words):
            write_usd(motion, path)
    assert not list(tmp_path.iterdir())
