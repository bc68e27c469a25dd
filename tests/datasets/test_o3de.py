"""Takes of O3DE's motion matching: their bones' own axes, their missing keys, their body."""

import numpy as np
import pytest
import torch
from godot_file import animation
from scipy.spatial.transform import Rotation

from motionlab import Motion, Skeleton
from motionlab.datasets import gaits, o3de, registry
from motionlab.errors import GodotError

BODY = o3de.skeleton()


def a_walk() -> Motion:
    """A T-pose, then a walk on the body of the takes."""
    walk = gaits.make(seconds=1, speed=1.3, fps=60).retarget(BODY)
    stand = torch.eye(3).expand(1, BODY.joints, 3, 3)
    root = torch.tensor([[0, o3de.HIP_HEIGHT + o3de.LIFT, 0]])
    return Motion(
        BODY,
        torch.cat([root, walk.root_positions]),
        torch.cat([stand, walk.rotations]),
        60,
    )


def as_take(motion: Motion, seed: int, end: float = 0.4) -> dict:
    """Tracks of a motion whose bones rest in axes of their own. Ends `end` frames after its last."""
    axes = Rotation.random(BODY.joints, random_state=seed)
    count = len(motion)
    turned, local = [], {}
    root = Rotation.from_euler("y", np.linspace(0, 40, count)[:, None], degrees=True)
    for i, (name, parent) in enumerate(zip(BODY.names, BODY.parents, strict=True)):
        its = Rotation.from_matrix(motion.rotations[:, i].numpy())
        turned.append(turned[parent] * its if parent >= 0 else its)
        above = turned[parent] * axes[parent] if parent >= 0 else root
        local[name] = above.inv() * turned[-1] * axes[i]
    way = (motion.root_positions.numpy() - [0, o3de.LIFT, 0]) / o3de.HIP_HEIGHT
    ground = way * [1, 0, 1]
    tracks = {("Root", "position_3d"): ground, ("Root", "rotation_3d"): root.as_quat()}
    tracks["Hips", "position_3d"] = root.inv().apply(way - ground)
    tracks |= {(name, "rotation_3d"): turn.as_quat() for name, turn in local.items()}
    times = np.append(np.arange(count), count) / 60  # the last keys are of the take's end
    close = lambda rows: np.concatenate([rows, rows[-1:]])
    return {track: np.column_stack([times, close(rows)]) for track, rows in tracks.items()}


@pytest.mark.parametrize("seed", range(3))
def test_a_take_is_what_was_written(seed):
    """Whatever axes its bones rest in, and wherever the root turns."""
    motion = a_walk()
    take = o3de.parse_take(animation(as_take(motion, seed)), "walk.res", source="made")
    assert (len(take), take.fps, take.source) == (len(motion), 60, "made")
    torch.testing.assert_close(take.positions(), motion.positions(), atol=1e-5, rtol=0)
    torch.testing.assert_close(take.rotations, motion.rotations, atol=1e-5, rtol=0)


def test_between_keys_bones_turn_evenly():
    tracks = as_take(a_walk(), 0)
    whole = o3de.parse_take(animation(tracks), "walk.res")
    kept = {track: np.delete(keys, [5, 6, 7], axis=0) for track, keys in tracks.items()}
    take = o3de.parse_take(animation(kept), "walk.res")
    for same in (slice(5), slice(8, None)):
        torch.testing.assert_close(take.rotations[same], whole.rotations[same], atol=1e-5, rtol=0)
    step = lambda i: take.rotations[i].mT @ take.rotations[i + 1]
    for i in (5, 6, 7):  # the hips turn inside the root, which turns too: almost evenly
        torch.testing.assert_close(step(4)[0], step(i)[0], atol=1e-3, rtol=0)
    middle = (take.root_positions[4] + take.root_positions[8]) / 2
    torch.testing.assert_close(take.root_positions[6], middle, atol=1e-3, rtol=0)


def test_a_bone_that_never_turns_has_one_key():
    tracks = as_take(a_walk(), 0)
    tracks["LeftToes", "rotation_3d"] = tracks["LeftToes", "rotation_3d"][:1]
    toes = o3de.parse_take(animation(tracks), "walk.res").rotations[:, BODY.index("LeftToes")]
    torch.testing.assert_close(toes, torch.eye(3).expand_as(toes), atol=1e-5, rtol=0)


def test_the_body():
    assert set(BODY.roles) == set(Skeleton.canonical().roles) and BODY.matches(BODY.mirrored())
    assert registry.sources()["o3de-motionmatching"].units == o3de.HIP_HEIGHT


def test_another_animation_is_refused():
    tracks = as_take(a_walk(), 0)
    del tracks["Hips", "position_3d"]
    with pytest.raises(GodotError, match=r"walk\.res: has no track .*Hips"):
        o3de.parse_take(animation(tracks), "walk.res")
