"""Flat feet are those of a body, not of a clip: who mostly stands on the toes is told by others."""

from __future__ import annotations

from dataclasses import replace

import pytest
import roma
import torch
from other_axes import redrawn

from motionlab import Motion, Skeleton, datasets
from motionlab.datasets import gaits
from motionlab.retargeting.flat_feet import Stance, with_flat_feet
from motionlab.retargeting.onto_rig import onto_rig
from motionlab.retargeting.stance import stances

CANONICAL = Skeleton.canonical()
SIDES = ("left", "right")
WALKS = [gaits.make(seconds=3, speed=speed) for speed in (0.8, 1.2)]
STANDS = gaits.make(seconds=2, speed=0.0)


def pitches(degrees: float) -> torch.Tensor:
    return roma.rotvec_to_rotmat(torch.tensor([degrees, 0.0, 0.0]).deg2rad())


def on_toes(degrees: float) -> Motion:
    """A person who stands on the toes, heels raised by so much."""
    rotations, root = STANDS.rotations.clone(), STANDS.root_positions.clone()
    for side in SIDES:
        foot, toes = CANONICAL.role(f"{side}_foot"), CANONICAL.role(f"{side}_toes")
        rotations[:, foot] = rotations[:, foot] @ pitches(degrees)
        rotations[:, toes] = rotations[:, toes] @ pitches(-degrees)
    raised = replace(STANDS, rotations=rotations)
    toes = CANONICAL.role("left_toes")
    root[:, 1] += STANDS.positions()[:, toes, 1] - raised.positions()[:, toes, 1]
    return replace(raised, root_positions=root, name="on toes")


def drawn(motion: Motion, steeper: float) -> Motion:
    """The same places on a rig whose feet are drawn so much steeper at rest than they are when flat."""
    turns = torch.eye(3).repeat(CANONICAL.joints, 1, 1)
    for side in SIDES:
        turns[CANONICAL.role(f"{side}_foot")] = pitches(-steeper)
    return redrawn(motion, turns)


def off(found: Motion, wanted: Motion) -> float:
    """Degrees between the ways from ankles to toes, the worst of all frames."""
    worst = []
    for side in SIDES:
        ends = [CANONICAL.role(f"{side}_{part}") for part in ("foot", "toes")]
        a, b = (m.positions()[:, ends].diff(dim=1)[:, 0] for m in (found, wanted))
        worst.append(
            torch.rad2deg(torch.arccos(torch.cosine_similarity(a, b, dim=-1).clamp(-1, 1)))
        )
    return float(torch.stack(worst).max())


@pytest.mark.parametrize("steeper", [-20.0, 0.0, 12.0])
def test_all_clips_of_a_body_tell_how_its_flat_feet_look(steeper):
    wanted = [on_toes(25), *WALKS]
    clips = [drawn(motion, steeper) for motion in wanted]
    found = stances(clips, CANONICAL).references
    assert all(its is found[0] for its in found)
    assert [its for its in found[0].flat] == pytest.approx(2 * [torch.pi / 180 * steeper], abs=0.03)
    for clip, its, motion in zip(clips, found, wanted, strict=True):
        assert off(clip.retarget(reference=its), motion) < 8, motion.name
    assert off(onto_rig(clips[0], WALKS[0], reference=found[0]), wanted[0]) < 8


def test_a_folder_of_them_does_so_too(tmp_path):
    from motionlab import write_bvh

    for i, motion in enumerate((on_toes(25), *WALKS)):
        write_bvh(drawn(motion, 12), tmp_path / f"{i}.bvh")
    brought = datasets.from_folder(tmp_path, skeleton=CANONICAL)
    assert off(brought[0], on_toes(25)) < 8


def test_a_standing_reference_tells_them_for_one_clip():
    clip, reference = drawn(on_toes(25), 12), drawn(STANDS, 12)
    assert off(clip.retarget(reference=reference), on_toes(25)) < 8


def test_bodies_have_feet_of_their_own():
    clips = [drawn(motion, steeper) for motion in WALKS for steeper in (0.0, 8.0)]
    a, b, again, b_again = stances(clips, CANONICAL).references
    assert a is again and b is b_again
    assert b.flat[0] - a.flat[0] == pytest.approx(torch.pi / 180 * 8, abs=0.01)


def test_nobody_who_stands_flat_tells_nothing():
    running = replace(gaits.make(seconds=1, speed=4.0), contacts=None)[:4]
    assert with_flat_feet(None, [drawn(running, 10)]) == Stance()
    assert with_flat_feet(None, [drawn(running, 10)[:0]]) == Stance() == with_flat_feet(None, [])
