"""Every kind of network goes on where the recorded motion left off, facing as it faced."""

from __future__ import annotations

from dataclasses import replace

import pytest
import torch
from steady_pfnn import PACE, layout, steady

from experiments.comparison import going_on, led
from experiments.comparison.begun import joints_of
from experiments.comparison.trainings import joints_alone, rows_of
from motionlab import metrics
from motionlab.encodings import BodyFrame, JointAngles, Normalizer, RootRelative
from motionlab.models import AcLstm, LstmGmm, Strnn

SEEN = 60


class Oracle:
    """Stands for a network: it says the rows that came."""

    def __init__(self, encoding, rows):
        self.encoding, self.rows, self.sampling = encoding, rows, {}

    def observe(self, seen, **_):
        assert (seen - self.rows[:, :SEEN]).abs().max() < 1e-5  # it is shown what was recorded
        return seen

    def generate(self, n, start, **_):
        return self.rows[:, SEEN : SEEN + n].clone()

    def extrapolate(self, seen, n, **_):
        return self.generate(n, self.observe(seen))


def oracles(walks):
    rows, encoding = walks
    plain = JointAngles(encoding.skeleton, 30, contacts=False)
    root = RootRelative(joints_alone(encoding.skeleton), 30)
    body = BodyFrame(encoding.skeleton, 30)
    motions = [encoding.to_motion(some) for some in rows]
    around = rows_of(joints_of(encoding, rows))
    down = going_on.contacts.label
    in_body = []
    for motion in motions:
        found = down(motion)
        found[:, [1, 3]] = motion.contacts[:, [1, 3]]
        in_body.append(body.encode(replace(motion, contacts=found)))
    return {
        "angles": going_on.angles(Oracle(plain, rows[..., : plain.dim]), {}),
        "with contacts": going_on.angles(Oracle(encoding, rows), {}),
        "around the root": going_on.around_root(Oracle(root, around)),
        "body frame": going_on.body_frame(Deaf(body, torch.stack(in_body))),
    }


class Deaf(Oracle):
    """Contacts of heels near the end of what is seen are told by frames that come later."""

    def observe(self, seen, **_):
        return seen


@pytest.mark.parametrize("kind", ["angles", "with contacts", "around the root", "body frame"])
def test_an_oracle_of_each_encoding_ends_up_where_people_did(walks, begun, kind):
    rows, encoding = walks
    came = joints_of(encoding, rows)[:, SEEN:90]
    made = oracles(walks)[kind](begun, 30, seed=0, quiet=True)
    assert made.shape == came.shape
    assert (made - came).norm(dim=-1).max() < 2e-3


def test_who_goes_straight_on_keeps_each_joints_velocity_around_the_root(begun):
    made, seen = going_on.straight_on(begun, 10, seed=0), begun.points
    root = seen[:, -1, 0] - seen[:, -2, 0]
    assert torch.allclose(
        made[:, 4, 0, [0, 2]], seen[:, -1, 0, [0, 2]] + 5 * root[:, [0, 2]], atol=1e-4
    )
    around = seen - seen[:, :, :1]
    wanted = around[:, -1] + 5 * (around[:, -1] - around[:, -2])
    assert torch.allclose((made - made[:, :, :1])[:, 4], wanted, atol=1e-4)


def test_what_explodes_is_no_motion_from_then_on(walks, begun):
    rows, encoding = walks
    broken = rows.clone()
    broken[1, SEEN + 5] = torch.nan
    made = going_on.angles(Oracle(encoding, broken), {})
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Oracle, "observe", lambda self, seen, **_: seen)
        found = made(begun, 20, seed=0)
    assert found[1, :5].isfinite().all() and found[1, 5:].isnan().all()
    assert found[[0, 2, 3]].isfinite().all()


def test_networks_go_on_by_their_seed(walks, begun):
    rows, encoding = walks
    torch.manual_seed(0)
    around = RootRelative(joints_alone(encoding.skeleton), 30)
    body = BodyFrame(encoding.skeleton, 30)
    fitted = lambda its: Normalizer.fit(list(its))
    of_body = fitted(body.encode(encoding.to_motion(some)) for some in rows)
    ways = [
        going_on.angles(LstmGmm(encoding, fitted(rows), width=8), {"temperature": 0.5}),
        going_on.around_root(AcLstm(around, fitted(rows_of(joints_of(encoding, rows))), width=8)),
        going_on.body_frame(Strnn(body, of_body, 32, 20, 20, spatial=False).eval()),
    ]
    for go_on in ways:
        with torch.no_grad():
            first, again, other = (go_on(begun, 8, seed=seed) for seed in (0, 0, 1))
        assert first.shape == (4, 8, 21, 3) and torch.equal(first, again)
        assert not torch.equal(first, other)


def test_pace_is_that_of_the_last_second(begun):
    speed, way = going_on.pace(begun)
    root = begun.points[:, :, 0][..., [0, 2]]
    assert torch.allclose(speed[:, None] * way, root[:, -1] - root[:, -31], atol=1e-5)
    assert torch.allclose(way.norm(dim=-1), torch.ones(4))


def test_a_pfnn_takes_over_the_walk_and_is_led_straight_on(begun):
    network = steady(layout(), turn=torch.zeros(1))
    made = led.led(network)(begun, 20, seed=0)
    assert made.shape == (4, 20, 21, 3) and made.isfinite().all()
    ground = made[:, :, 0][..., [0, 2]]
    steps = ground.diff(dim=1).norm(dim=-1)
    assert torch.allclose(steps[:, 10:], torch.full_like(steps[:, 10:], PACE), atol=2e-3)
    assert (ground[:, 0] - begun.points[:, -1, 0][..., [0, 2]]).norm(dim=-1).max() < 0.15
    turned = metrics.facing(made, begun.encoding.skeleton)[:, 5:].diff(dim=1)
    assert turned.abs().max() < 0.01
    _, way = going_on.pace(begun)
    walk = led.taken_over(network, begun, torch.zeros(4, 3))
    assert torch.equal(walk.joints, begun.points[:, -1].float())
    ahead = walk.directions[:, -1][:, [0, 2]]
    assert ((ahead * way).sum(-1) > 0.9).all()  # people face the way they walk


def test_of_many_phases_that_is_taken_whose_frame_fits(begun, monkeypatch):
    network, asked = steady(layout()), []

    def step(network, walk, gaits):
        asked.append(walk.phase)
        off = (walk.phase - 2.0).abs()[:, None, None]
        return led.Frame(walk.joints + walk.velocities + off, torch.zeros(0), torch.zeros(0)), walk

    monkeypatch.setattr(led, "step", step)
    walk = led.in_phase(network, led.taken_over(network, begun, torch.zeros(4, 3)))
    assert len(asked[0]) == 4 * led.PHASES
    assert (walk.phase - 2.0).abs().max() <= torch.pi / led.PHASES
