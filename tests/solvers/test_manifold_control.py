"""Control of an STRNN: what is wished is nearer, and the weights are what they were, bit for bit."""

import math

import pytest
import torch

from motionlab import Skeleton, metrics
from motionlab.datasets import gaits
from motionlab.encodings import BodyFrame, Normalizer
from motionlab.encodings.path import walk
from motionlab.errors import ModelError, SolverError
from motionlab.models import LstmGmm, Strnn
from motionlab.paths import Path
from motionlab.solvers.manifold_control import Costs, along, control


@pytest.fixture(scope="module")
def clips():
    encoding = BodyFrame(Skeleton.canonical(), 30)
    made = [encoding.encode(gaits.make(seconds=5, speed=1 + 0.2 * i, seed=i)) for i in range(3)]
    return encoding, torch.stack([clip[:140] for clip in made])


@pytest.fixture(scope="module")
def model(clips):
    """A small network that has learned to walk a little."""
    encoding, rows = clips
    torch.manual_seed(0)
    model = Strnn(encoding, Normalizer.fit(list(rows)), 32, 10, 10, spatial=False)
    adam = torch.optim.Adam(model.parameters(), lr=5e-3)
    for update in range(150):
        at = 10 * (update % 12)
        model.loss(rows[:, at : at + 20]).backward()
        adam.step()
        adam.zero_grad()
    return model


def weights(model):
    return {name: its.clone() for name, its in model.state_dict().items()}


def same(model, before):
    return all(torch.equal(its, before[name]) for name, its in model.state_dict().items())


def velocities(model, features):
    return features[..., model.encoding.slices["root"]][..., 6:]


@pytest.mark.parametrize(("fit", "rate"), [("weights", 0.01), ("state", 0.1)])
def test_a_signal_is_followed_and_the_weights_are_as_before(model, clips, fit, rate):
    _, rows = clips
    before, signal = weights(model), torch.tensor([0.0, 0.8, 0.5]).expand(35, 3)
    free = control(model, rows[:2], signal, 35, fit=fit, steps=0).features
    assert torch.allclose(free, model.extrapolate(rows[:2], 35), atol=1e-4)
    alone = Costs(bones=0.0, contacts=0.0)
    led = control(model, rows[:2], signal, 35, fit=fit, steps=20, rate=rate, costs=alone).features
    assert led.shape == (2, 35, 73) and same(model, before)
    assert all(its.requires_grad and its.grad is None for its in model.parameters())
    off = lambda made: (velocities(model, made) - signal).square().mean()
    assert off(led) < 0.5 * off(free)


def test_weights_are_as_before_when_it_ends_badly(model, clips):
    before, asked = weights(model), []

    def wish(place, n):
        asked.append(place)
        if len(asked) == 2:
            raise KeyboardInterrupt
        return torch.zeros(1, n, 3)

    for fit in ("weights", "state"):
        asked.clear()
        with pytest.raises(KeyboardInterrupt):
            control(model, clips[1][:1], wish, 30, fit=fit, steps=3)
        assert same(model, before) and all(its.requires_grad for its in model.parameters())


@pytest.mark.parametrize("fit", ["weights", "state"])
def test_no_character_hangs_on_another(model, clips, fit):
    signal = torch.tensor([[0.0, 0.5, 0.3], [0.1, 1.5, -0.3]])[:, None].expand(2, 20, 3)
    both = control(model, clips[1][:2], signal, 20, fit=fit, steps=5).features
    alone = control(model, clips[1][1:2], signal[1:], 20, fit=fit, steps=5).features
    assert torch.allclose(both[1:], alone, atol=1e-3)


def test_what_costs_is_less(model, clips):
    signal, skeleton = torch.tensor([0.0, 1.0, 0.0]).expand(20, 3), model.encoding.skeleton
    of = lambda **costs: (
        control(model, clips[1][:1], signal, 20, rate=3e-3, costs=Costs(**costs)).features
    )
    bones = lambda made: float(
        metrics.bone_length_error(model.encoding.positions(made), skeleton).mean.mean()
    )
    assert bones(of(bones=1e4)) < 0.8 * bones(of(bones=0.0))
    feet = lambda made: metrics.foot_skate(
        model.encoding.positions(made), model.encoding.contacts(made) > 0.5, skeleton, 30
    )
    assert feet(of(contacts=10.0)) < feet(of(contacts=0.0))


def test_a_path_is_aimed_at_from_beside_it():
    way = Path.through(torch.tensor([[0.0, 0.0], [0.0, 5.0]]))
    place = torch.tensor([[0.3, 0.0, 0.4]])
    asked = along([way], torch.tensor([1.2]), 30)(place, 20)
    steps = torch.cat([asked[:, :1], asked], 1) / 30
    path, yaw = walk(steps, tuple(place.double().unbind(-1)))
    assert torch.allclose(
        path[0, -1, [0, 2]], torch.tensor([0.0, 0.8], dtype=path.dtype), atol=0.02
    )
    assert math.isclose(float(yaw[0, -1]), 0.0, abs_tol=1e-6)
    assert float((path.diff(dim=1).norm(dim=-1) * 30).max()) < 1.5


def test_who_does_as_is_asked_keeps_his_speed():
    """More than half a metre a window: the place on the path must not lag behind the body."""
    bend = torch.linspace(0, 6, 200, dtype=torch.float64)
    way = Path.through(torch.stack([2 - 2 * (bend / 2).cos(), 2 * (bend / 2).sin()], 1))
    wish, place, far = along([way], torch.tensor([1.5]), 30), torch.zeros(1, 3), 0.0
    for _ in range(5):
        asked = wish(place, 20)
        steps = torch.cat([asked[:, :1], asked], 1) / 30
        path, yaw = walk(steps, tuple(place.double().unbind(-1)))
        far += float(path.diff(dim=1).norm(dim=-1).sum())
        place = torch.cat([path[:, -1, [0, 2]], yaw[:, -1:]], 1)
    assert math.isclose(far, 5.0, rel_tol=0.02)
    assert abs(float(place[:, :2].sub(torch.tensor([[2.0, 0.0]])).norm()) - 2) < 0.02


def test_places_are_where_the_motion_is(model, clips):
    way = Path.through(torch.tensor([[1.0, 2.0], [1.0, 6.0]]))
    start = torch.tensor([[1.0, 2.0, 0.0]])
    found = control(model, clips[1][:1], along([way], torch.tensor([1.0]), 30), 60, start=start,
                    fit="state", rate=0.1)  # fmt: skip
    root = model.encoding.positions(found.features, found.places)[0, :, 0]
    assert root[0, [0, 2]].sub(start[0, :2]).norm() < 0.1
    assert root[-1, 2] > 3.0 and root[:, 0].sub(1.0).abs().max() < 0.3


def test_numbers_that_make_no_sense(model, clips):
    rows, signal = clips[1][:1], torch.zeros(20, 3)
    with pytest.raises(SolverError, match="has 20 frames, the motion is to have 21"):
        control(model, rows, signal, 21)
    with pytest.raises(SolverError, match="NaN"):
        control(model, rows, signal * math.nan, 20)
    with pytest.raises(SolverError, match="shape"):
        control(model, rows, torch.zeros(3, 20, 3), 20)
    for bad in ({"fit": "frames"}, {"steps": -1}, {"rate": 0.0}, {"costs": Costs(bones=-1.0)}):
        with pytest.raises(SolverError, match="control"):
            control(model, rows, signal, 20, **bad)
    with pytest.raises(SolverError, match="0 frames"):
        control(model, rows, signal, 0)
    with pytest.raises(ModelError, match="10"):
        control(model, rows[:, :9], signal, 20)
    with pytest.raises(SolverError, match="one for each path"):
        along([Path.through([[0, 0], [0, 1]])], torch.tensor([1.0, 2.0]), 30)
    without = BodyFrame(Skeleton.canonical(), 30, contacts=False)
    with pytest.raises(SolverError, match="contacts"):
        control(Strnn(without, Normalizer(69, 69), 32), rows, signal, 20)
    with pytest.raises(SolverError, match="LstmGmm"):
        control(LstmGmm(without, Normalizer(69, 69), 8), rows, signal, 20)
