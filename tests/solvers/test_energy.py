"""The energy: its likelihood is the network's, its slopes are those of differences, term by term."""

import math

import pytest
import torch

from motionlab.encodings import JointAngles, Normalizer
from motionlab.errors import SolverError
from motionlab.feet.contacts import foot_points, rest_heights
from motionlab.models import LstmGmm
from motionlab.paths import Curves, Path
from motionlab.solvers import terms
from motionlab.solvers.energy import NOISE, Energy


@pytest.fixture(scope="module")
def piece(window):
    """A bent way near each of the two characters."""
    before = window[0]
    ways = [
        Path.through(place[:2] + torch.tensor([[-1.0, -0.5], [0.2, 0.1], [1.0, 1.5]]), corner=0)
        for place in before.place
    ]
    zero = torch.zeros(2)
    return Curves(ways).piece(zero, zero + 2.5, torch.arange(2))


@pytest.fixture(scope="module")
def wishes(network, window, piece):
    """Every term, with wishes that are not fulfilled."""
    before, s, _ = window
    encoding, body = network.encoding, network.encoding.skeleton
    points = torch.zeros(2, 6, 1, 3, dtype=torch.double)
    seen = torch.ones(2, 6, 1, dtype=torch.bool)
    seen[0, 2] = False
    points[0, 2] = math.nan
    angles = network.normalizer.inverse(s)[..., encoding.slices["pose"]] + 0.1
    return {
        "path": terms.path(piece),
        "hand": terms.path(piece, point=body.role("left_hand"), std=0.3),
        "toe": terms.path(piece, point=body.role("right_toes"), std=0.3),
        "time": terms.time(piece, torch.linspace(0.5, 1, 6).expand(2, -1)),
        "ahead": terms.ahead(piece, encoding.fps, frames=4),
        "speed": terms.speed(torch.tensor([2.0, 0.3]), encoding.fps),
        "direction": terms.direction(torch.tensor([2.0, -3.0]), body),
        "turn": terms.turn(0.7),
        "step length": terms.step_length(0.9, body),
        "contact": terms.contact(body),
        "resting": terms.resting(body, encoding.fps, slower=20.0),
        "planted": terms.planted(body, encoding.fps),
        "poses": lambda features, *rest: terms.poses(encoding)(5 * features, *rest),
        "places": terms.places(points, [0], seen),
        "headings": terms.headings(torch.full((2, 6), 0.3).double()),
        "channels": terms.channels(angles, encoding.slices["pose"]),
    }


def test_prior_is_the_likelihood_of_the_network(network, window):
    """In one piece, or in two windows with what disturbed it carried along."""
    before, s, d = window
    features = network.normalizer.inverse(s)
    none = torch.zeros_like(d)
    rows = torch.cat([before.frame[:, None], features], 1)
    # a network that has seen one frame only can be asked for the same by log_prob
    state = network.observe(before.frame[:, None])
    energy = Energy(network, before._replace(state=state))
    torch.testing.assert_close(energy.parts(s, none)["prior"], -network.log_prob(rows).sum(1))
    shifted = torch.cat([none[:, :1], d], 1)
    torch.testing.assert_close(energy.parts(s, d)["prior"], -network.log_prob(rows, shifted).sum(1))
    whole = Energy(network, before).parts(s, d)["prior"]
    _, state = network.read(features[:, :4], before.state, d[:, :4])
    cut = Energy(network, before).parts(s[:, :4], d[:, :4])["prior"]
    rest = Energy(network, before._replace(state=state)).parts(s[:, 4:], d[:, 4:])["prior"]
    torch.testing.assert_close(cut + rest, whole)
    one = Energy(network, before).parts(s[:, :1], d[:, :1])["prior"]
    assert one.shape == (2,) and (one != cut).all()


def test_noise_is_a_gaussian(network, window):
    before, s, d = window
    found = Energy(network, before).parts(s, d)["noise"]
    torch.testing.assert_close(found, (d**2).sum((1, 2)) / (2 * NOISE**2))


NAMES = ["prior", "noise", "path", "hand", "toe", "time", "ahead", "speed", "direction", "turn",
         "step length", "contact", "resting", "planted", "poses", "places",
         "channels"]  # fmt: skip


@pytest.mark.parametrize("name", NAMES)
def test_slopes_are_those_of_differences(network, window, wishes, name):
    before, s, d = window
    energy = Energy(network, before, wishes)
    s, d = s.clone().requires_grad_(), d.clone().requires_grad_()
    value = energy.parts(s, d)[name]
    assert value.isfinite().all()
    assert (value > 0).all() or name == "prior"
    slopes = torch.autograd.grad(value.sum(), [s, d], allow_unused=True, materialize_grads=True)
    chance, h = torch.Generator().manual_seed(2), 1e-6
    for i, (which, slope) in enumerate(zip((s, d), slopes, strict=True)):
        if name != "noise" and i == 0:
            assert (slope.flatten(1).abs().amax(1) > 0).any()
        for _ in range(4):
            way = torch.randn(which.shape, generator=chance, dtype=torch.double)
            moves = [(way if part is which else torch.zeros_like(part)) for part in (s, d)]
            up, down = (
                energy.parts(*(p.detach() + x * m for p, m in zip((s, d), moves, strict=True)))
                for x in (h, -h)
            )
            expected = (up[name] - down[name]) / (2 * h)
            found = (slope * way).sum((1, 2))
            torch.testing.assert_close(found, expected, rtol=2e-5, atol=1e-4)


@pytest.mark.parametrize("name", [name for name in NAMES if name not in ("prior", "noise")])
def test_a_term_looks_at_no_other_points_than_it_says(network, window, wishes, name):
    """What it does not look at is NaN for it, if it is alone."""
    before, s, d = window
    alone = Energy(network, before, {name: wishes[name]}).parts(s, d)[name]
    among = Energy(network, before, wishes | {"all": lambda *rows: rows[0].new_ones(2)})
    torch.testing.assert_close(alone, among.parts(s, d)[name], rtol=1e-9, atol=1e-12)


def test_slope_in_d_runs_through_the_recurrence(network, window):
    """What disturbs the first frame matters to all that follow it; the last, to nothing here."""
    before, s, d = window
    d = d.clone().requires_grad_()
    energy = Energy(network, before)
    slope = torch.autograd.grad(energy.parts(s, d)["prior"].sum(), d)[0]
    size = slope.abs().amax((0, 2))
    assert (size[:-1] > 0).all() and size[-1] == 0


def test_characters_do_not_touch_each_other(network, window, wishes):
    before, s, d = window
    both = Energy(network, before, {"contact": wishes["contact"]})(s, d)
    alone = Energy(network, before[[1]], {"contact": wishes["contact"]})(s[1:], d[1:])
    torch.testing.assert_close(both[1:], alone)


def test_weights_scale_and_leave_out(network, window, wishes):
    before, s, d = window
    full = Energy(network, before, wishes).parts(s, d)
    some = Energy(network, before, wishes, {"path": 3.0, "hand": 0, "prior": 0}).parts(s, d)
    assert set(full) - set(some) == {"hand", "prior"}
    torch.testing.assert_close(some["path"], 3 * full["path"])
    total = Energy(network, before, wishes)(s, d)
    torch.testing.assert_close(total, sum(full.values()))


def test_each_window_may_have_weights_of_its_own(network, window, wishes):
    before, s, d = window
    weights = {"path": torch.tensor([0.0, 3.0]), "prior": torch.tensor([1.0, 0.0])}
    both = Energy(network, before, wishes, weights)(s, d)
    for row in (0, 1):
        its = {name: float(weight[row]) for name, weight in weights.items()}
        torch.testing.assert_close(both[row], Energy(network, before, wishes, its)(s, d)[row])


@pytest.mark.parametrize("weight", [-1.0, float("nan"), torch.tensor([1.0, -0.5]), float("inf")])
def test_a_weight_that_is_none_is_refused(network, window, wishes, weight):
    with pytest.raises(SolverError, match="must be 0 or more"):
        Energy(network, window[0], wishes, {"path": weight})


# -- what terms mean ------------------------------------------------------------------------------


def straight(metres, frames=6, batch=1):
    """A body of 27 points that slides ahead (+z) as one, with a frame before."""
    positions = torch.zeros(batch, 1 + frames, 27, 3, dtype=torch.double)
    positions[..., 2] = torch.linspace(0, metres, 1 + frames, dtype=torch.double)[:, None]
    return positions


def test_a_wish_that_is_fulfilled_costs_nothing(clips):
    body, fps = clips[0].skeleton, 30.0
    positions = straight(0.6)
    features = torch.zeros(1, 7, 68, dtype=torch.double)
    features[:, 1:, 2] = 0.1
    way = Curves([Path.through([[0, 0], [0, 3]])])
    piece = way.piece(torch.tensor([0.0]), torch.tensor([3.0]), torch.tensor([0]))
    behind = torch.linspace(0.1, 0.6, 6)[None]
    for term in (terms.path(piece), terms.time(piece, behind), terms.speed(3.0, fps),
                 terms.turn(0.6), terms.ahead(piece, fps)):  # fmt: skip
        assert term(features, positions, None).item() == pytest.approx(0, abs=1e-9)
    aside = positions.clone()
    aside[..., 0] += 0.03
    assert terms.path(piece, std=0.03)(features, aside, None).item() == pytest.approx(3.0)
    assert terms.time(piece, behind + 0.2, std=0.1)(features, aside, None).item() == pytest.approx(
        12.0, rel=1e-5
    )
    with pytest.raises(SolverError, match="lstm-gmm-contacts"):
        terms.contact(body)(features, positions, None)


def test_contact_costs_what_slides_and_floats(clips):
    body = clips[0].skeleton
    positions = straight(0.06)
    contacts = torch.zeros(1, 7, 2)
    term = terms.contact(body, slide=0.01, height=0.01)
    assert term(None, positions, contacts).item() == 0
    positions[..., body.role("left_toes"), 1] = float(rest_heights(body)[1])
    contacts[:, 3:, 0] = 0.9  # four frames down, three steps of a centimetre between them
    assert term(None, positions, contacts).item() == pytest.approx(3 / 2)
    positions[:, 5, body.role("left_toes"), 1] += 0.02
    assert term(None, positions, contacts).item() == pytest.approx(3 / 2 + 2)


def test_one_foot_that_stays_is_enough_and_who_has_none_pays_for_his_speed(clips):
    """The cost of a glide is half the square of its speed in 0.3 m/s, a frame."""
    body = clips[0].skeleton
    term = terms.planted(body, 30.0, speed=0.3)
    points = torch.zeros(3, 5, body.points, 3)
    points[0, :, :, 0] = torch.arange(5)[:, None] * 0.6 / 30  # glides at 0.6 m/s
    points[1, :, :, 0] = torch.arange(5)[:, None] * 0.6 / 30
    points[1, :, foot_points(body)[1], 0] = 0.7  # one toe stays
    points[2, :, :, 1] = torch.arange(5)[:, None].float()  # rises: no matter of the ground
    torch.testing.assert_close(term(points, points, None), torch.tensor([4 * 2.0, 0, 0]))


def test_what_is_slow_rests_and_what_is_fast_may(clips):
    body, features = clips[0].skeleton, None
    term = terms.resting(body, 30.0, slide=0.01, slower=0.45)
    slow, fast = straight(0.06), straight(0.12)  # 0.3 and 0.6 m/s, four joints, six frames
    assert term(features, slow, None).item() == pytest.approx(4 * 6 / 2)
    assert term(features, fast, None).item() == 0


def test_only_what_no_body_of_the_data_does_costs(clips):
    body = clips[0].skeleton
    encoding = JointAngles(body, contacts=True)
    features = encoding.encode(clips[0])[None, :7].clone()
    term = terms.poses(encoding, std=0.1)
    assert term(features, None, None).item() < 1e-6
    channel = encoding.feature_names.index("Head_z")  # the data have -0.784 to 0.784
    features[:, 3, channel] = 0.984
    assert term(features, None, None).item() == pytest.approx(2, rel=1e-3)
    features[:, 0, channel] = 9.0  # what stands fast already costs nothing
    assert term(features, None, None).item() == pytest.approx(2, rel=1e-3)


def test_step_length_is_measured_where_a_toe_sets_down(clips):
    body = clips[0].skeleton
    positions = straight(0.0)
    positions[..., body.role("left_toes"), 2] = 0.5
    contacts = torch.zeros(1, 7, 2)
    term = terms.step_length(0.4, body, std=0.1)
    assert term(None, positions, contacts).item() == 0
    contacts[:, 4:, 1] = 1
    assert term(None, positions, contacts).item() == pytest.approx(0.5)


def test_directions_meet_behind_the_back(network, window):
    """A body that faces just beyond half a turn is near to one that faces just short of it."""
    before, s, d = window
    energy = Energy(network, before)
    rows = energy.decoded(network.normalizer.inverse(s))
    body = network.encoding.skeleton
    cost = lambda way: terms.direction(way, body, std=1.0)(*rows)
    torch.testing.assert_close(cost(math.pi - 0.1), cost(-math.pi - 0.1))
    assert (cost(torch.linspace(-3, 3, 2)) <= math.pi**2 / 2 + 1e-9).all()


# -- bad input ------------------------------------------------------------------------------------


def test_what_makes_no_energy_is_told(network, window, wishes):
    before = window[0]
    for arguments, said in [
        (({"noise": wishes["path"]}, None), "own terms"),
        ((wishes, {"way": 1.0}), "the terms are prior, noise, path"),
        ((wishes, {"path": -1.0}), "0 or more"),
        ((wishes, {"path": math.nan}), "0 or more"),
    ]:
        with pytest.raises(SolverError, match=said):
            Energy(network, before, *arguments)
    with pytest.raises(SolverError, match="Linear has no likelihood"):
        Energy(torch.nn.Linear(1, 1), before)


def test_a_model_without_contacts_is_asked_for_them(window, clips):
    encoding = JointAngles(clips[0].skeleton, clips[0].fps)
    rows = encoding.encode(clips[0]).double()
    model = LstmGmm(encoding, Normalizer.fit([rows]).double(), width=8).double()
    model.requires_grad_(False)
    state = model.observe(rows[:5])
    before = window[0]._replace(state=state, frame=rows[4:5], place=torch.zeros(1, 3))
    energy = Energy(model, before, {"contact": terms.contact(encoding.skeleton)})
    with pytest.raises(SolverError, match="features have none"):
        energy(model.normalizer(rows[None, 5:9]), torch.zeros(1, 4, encoding.dim))
    left_out = Energy(model, before, energy.terms, {"contact": 0})
    assert left_out(
        model.normalizer(rows[None, 5:9]), torch.zeros(1, 4, encoding.dim).double()
    ).isfinite()


def test_what_is_said_of_first_frames_is_asked_once_where_nobody_seeks_them(network, window):
    before, s, d = window
    energy = Energy(network, before)
    asked = []
    said = network.predict
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(network, "predict", lambda state: asked.append(state) or said(state))
        first, again = energy(s, d), energy(s, d)
        assert torch.equal(first, again) and len(asked) == 1
        hidden = (before.state.hidden + 0.1).requires_grad_()
        other = before._replace(state=before.state._replace(hidden=hidden))
        for _ in range(2):
            (slope,) = torch.autograd.grad(energy(s, d, other).sum(), hidden)
            assert slope.abs().sum() > 0
        assert len(asked) == 3
