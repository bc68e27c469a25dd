"""A T-pose in front of the motion is told; motion that begins fast is not."""

from __future__ import annotations

import warnings
from dataclasses import replace

import pytest
import torch

from motionlab import Motion, Skeleton, read_bvh, read_gltf, write_bvh, write_gltf
from motionlab.datasets import gaits
from motionlab.datasets.registry import sources
from motionlab.io.bvh import parse_bvh
from motionlab.io.first_pose import doubt_first


def with_tpose(motion: Motion) -> Motion:
    """The motion after a frame at rest."""
    still = torch.eye(3).expand_as(motion.rotations[:1])
    return replace(
        motion,
        rotations=torch.cat([still, motion.rotations]),
        root_positions=torch.cat([motion.root_positions[:1], motion.root_positions]),
        contacts=None,
    )


@pytest.mark.parametrize("fps", [30, 120])
@pytest.mark.parametrize("speed", [1.3, 3.0])
@pytest.mark.parametrize("scale", [1.0, 0.01, 39.4])
def test_a_tpose_is_told_at_any_rate_pace_and_unit(fps, speed, scale):
    walk = gaits.make(seconds=1, speed=speed, fps=fps)
    s = walk.skeleton
    body = replace(s, offsets=scale * s.offsets, end_offsets=scale * s.end_offsets)
    walk = replace(walk, skeleton=body, root_positions=scale * walk.root_positions)
    assert doubt_first(walk, said=False) is None
    said = doubt_first(with_tpose(walk), said=False)
    assert "times as far" in said and "tpose_first=True" in said
    assert doubt_first(with_tpose(walk), said=True) is None


@pytest.mark.parametrize("frames", [2, 10, 100])
def test_a_tpose_that_is_held_is_told_too(frames):
    walk = with_tpose(gaits.make(seconds=6))
    held = [0] * frames + list(range(1, len(walk)))
    walk = replace(walk, rotations=walk.rotations[held], root_positions=walk.root_positions[held])
    for said in (False, True):
        assert "drop_zeros=True" in (told := doubt_first(walk, said))
        assert f"frames 0 to {frames - 1} are one pose" in told


def test_who_stands_still_and_walks_off_is_left_alone():
    walk = replace(gaits.make(seconds=3), contacts=None)
    held = [0] * 20 + list(range(1, len(walk)))
    walk = replace(walk, rotations=walk.rotations[held], root_positions=walk.root_positions[held])
    assert doubt_first(walk, said=False) is None


def test_poses_one_after_the_other_are_left_alone():
    walk = replace(gaits.make(seconds=3), contacts=None)
    held = [30 * (i // 30) for i in range(len(walk))]
    poses = replace(walk, rotations=walk.rotations[held], root_positions=walk.root_positions[held])
    assert doubt_first(with_tpose(poses), said=False) is None


def test_raw_files_of_cmu_s_begin_so_and_cleaned_clips_do_not(real_clips):
    for source in ("cmu", "aclstm-cmu"):
        said = []
        for path, data in real_clips[source].items():
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                motion = parse_bvh(data, path, units=sources()[source].units)
            said.append(doubt_first(motion, said=False) is not None)
            assert doubt_first(motion[10:], said=False) is None, path
        assert sum(said) >= len(said) - 1 > 0, source  # CMU's 02_01 has none


def test_it_is_told_where_files_are_read(tmp_path):
    write_bvh(with_tpose(gaits.make(seconds=1)), tmp_path / "a.bvh")
    write_gltf(with_tpose(gaits.make(seconds=1)), tmp_path / "a.glb")
    for read, name in ((read_bvh, "a.bvh"), (read_gltf, "a.glb")):
        with pytest.warns(UserWarning, match=f"{name}: from frame 0 to frame 1 .*tpose_first=True"):
            read(tmp_path / name)
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            read(tmp_path / name, tpose_first=True)


def test_a_rig_may_stand_in_its_first_frame(tmp_path):
    from motionlab.commands.rig import read_rig
    from motionlab.io.bvh_reading import Reading

    write_bvh(with_tpose(gaits.make(seconds=1)), tmp_path / "rig.bvh")
    assert read_rig(tmp_path / "rig.bvh", Reading())[1] == {}


def test_short_and_still_clips_and_bodies_without_extent_are_left_alone():
    walk = gaits.make(seconds=1)
    assert doubt_first(with_tpose(walk)[:8], said=False) is None
    still = replace(walk, rotations=walk.rotations[:1].expand_as(walk.rotations))
    assert doubt_first(still, said=False) is None
    point = Skeleton(("a",), (-1,), torch.zeros(1, 3))
    motion = Motion(point, torch.randn(20, 3), torch.eye(3).expand(20, 1, 3, 3), 30.0)
    assert doubt_first(motion, said=False) is None
