"""What a motion teaches: told step by step what to say, the runtime walks the motion again."""

import math
from dataclasses import replace

import pytest
import torch

from motionlab import contacts
from motionlab.datasets import gaits
from motionlab.errors import ModelError
from motionlab.feet.strides import phase
from motionlab.kinematics import yaw_matrix
from motionlab.models.pfnn.examples import _Body, examples, normalizers
from motionlab.models.pfnn.layout import Layout, size, split
from motionlab.models.pfnn.walk import Walk, seen, step

REACH = 30
NOBODY = torch.zeros(1, 0)  # gaits


def layout(**other) -> Layout:
    bend = gaits.make(seconds=0.1)
    return Layout(bend.skeleton, **{"fps": 30, "reach": REACH, "stride": 5, **other})


@pytest.fixture(scope="module")
def motion():
    return gaits.make(seconds=6, speed=1.2, turn_rate=0.5, seed=1)


@pytest.fixture(scope="module")
def rows(motion):
    return examples(layout(), motion)


def parts(rows: torch.Tensor):
    """Phase, and the parts of what is seen and said."""
    its = layout()
    at, saw, said = rows.split([1, size(its.seen), size(its.said)], dim=-1)
    return at[:, 0], split(its.seen, saw), split(its.said, said)


def first_frame(motion) -> int:
    """Of the frames that have a row, the first."""
    known = phase(motion.contacts, motion.fps).isfinite().nonzero()[:, 0]
    return max(REACH, int(known[0]))


def test_told_what_to_say_the_runtime_walks_the_motion(motion, rows):
    its, body, start = layout(), _Body(layout(), motion), first_frame(motion)
    around = torch.arange(start - REACH, start + REACH)
    points = motion.positions()[:, : motion.skeleton.joints]
    walk = Walk(
        body.places[around].float()[None], body.directions[around].float()[None],
        points[start - 1][None], (points[start - 1] - points[start - 2])[None], body.phase[start][None].float(),
    )  # fmt: skip
    at, _, _ = parts(rows)
    for number, row in enumerate(rows):
        saw = row[1 : 1 + size(its.seen)]
        # of the trajectory to come it knows every fifth frame, and nothing of the last fifth
        network = _Telling(its, row[1 + size(its.seen) :])
        now = seen(network, walk, NOBODY)[0]
        mine, wanted = split(its.seen, now), split(its.seen, saw)
        for name in ("joints", "velocities"):
            assert torch.allclose(mine[name], wanted[name], atol=2e-5)
        for name in ("places", "directions"):
            assert torch.allclose(mine[name][:, :7], wanted[name][:, :7], atol=2e-5)
        assert float(walk.phase) % (2 * math.pi) == pytest.approx(float(at[number]), abs=1e-4)
        frame, walk = step(network, walk, NOBODY)
        assert torch.allclose(frame.joints[0], points[start + number], atol=2e-5)
        world = motion.orientations()[start + number]
        assert torch.allclose(frame.rotations[0], world, atol=2e-5)
        assert torch.equal(frame.contacts[0] > 0.5, motion.contacts[start + number])
    assert len(rows) > 60


class _Telling:
    """A network that says what it is told to."""

    def __init__(self, layout: Layout, said: torch.Tensor) -> None:
        self.layout, self.said = layout, said

    def __call__(self, seen: torch.Tensor, phase: torch.Tensor) -> torch.Tensor:
        return self.said[None]


def test_a_bend_is_seen_as_one(motion, rows):
    _, saw, said = parts(rows)
    fps, speed, rate = 30, 1.2, 0.5
    assert float(said["turn"].mean()) == pytest.approx(
        -rate / fps, rel=0.05
    )  # to the left: about -y
    assert float(said["step"][:, 1].mean()) == pytest.approx(speed / fps, rel=0.03)
    assert float(saw["places"][:, 1, 0].mean()) < -0.9  # a second ago it was behind
    ahead = saw["places"][:, :, -1].mean(0)  # 25 frames ahead, on a circle
    angle, radius = rate * 25 / fps, speed / rate
    assert torch.allclose(
        ahead, radius * torch.tensor([1 - math.cos(angle), math.sin(angle)]), atol=0.06
    )
    assert (saw["places"][:, :, 6].abs() < 1e-6).all()  # the present is where it is
    assert torch.allclose(saw["directions"].norm(dim=1), torch.ones(1), atol=1e-5)


def test_where_a_motion_is_makes_no_difference(motion, rows):
    turn = yaw_matrix(torch.tensor(2.0))
    rotations = motion.rotations.clone()
    rotations[:, 0] = turn @ rotations[:, 0]
    moved = replace(
        motion,
        root_positions=motion.root_positions @ turn.mT + torch.tensor([30.0, 0.0, -8.0]),
        rotations=rotations,
    )
    assert torch.allclose(examples(layout(), moved), rows, atol=1e-4)


def test_without_contacts_they_are_found(motion):
    bare = replace(motion, contacts=None)
    labelled = replace(motion, contacts=contacts.label(motion))
    assert torch.equal(examples(layout(), bare), examples(layout(), labelled))


@pytest.mark.parametrize("seconds, speed", [(1.9, 1.2), (0.1, 1.2), (6, 0.0)])
def test_too_short_or_without_a_stride_it_teaches_nothing(seconds, speed):
    its = layout()
    made = examples(its, gaits.make(seconds=seconds, speed=speed))
    assert made.shape == (0, 1 + size(its.seen) + size(its.said))


def test_normalisers_share_a_deviation_within_a_kind(rows):
    its = layout()
    seen_by, said_by = normalizers(its, rows)
    _, saw, said = parts(rows)
    std = split(its.said, said_by.std)["joints"]
    assert torch.allclose(std, said["joints"].std(0, correction=0).mean(), atol=1e-5)
    loud = split(its.seen, seen_by.std)["joints"]
    assert torch.allclose(loud, 10 * saw["joints"].std(0, correction=0).mean(), atol=1e-4)
    assert torch.allclose(seen_by.mean, rows[:, 1 : 1 + size(its.seen)].mean(0), atol=1e-5)
    assert (said_by.std > 0).all()


def test_other_bodies_and_rates(motion):
    with pytest.raises(ModelError, match="another rate"):
        examples(layout(fps=60), motion)
    with pytest.raises(ModelError, match="gaits=0"):
        examples(layout(gaits=6), motion)
    longer = replace(motion.skeleton, offsets=1.1 * motion.skeleton.offsets)
    with pytest.raises(ModelError, match="another skeleton"):
        examples(replace(layout(), skeleton=longer), motion)
