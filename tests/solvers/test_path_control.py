"""Paths walked by a small network: states that go on exactly, ends, wishes, and no endless loop."""

import pytest
import torch
from tiny_lstm import tiny_clips, tiny_lstm

from motionlab.errors import SolverError
from motionlab.metrics import root_path_error
from motionlab.models.sampler import Chance
from motionlab.paths import Path
from motionlab.solvers import path_control, terms, windows
from motionlab.solvers.energy import Before
from motionlab.solvers.path_control import follow
from motionlab.solvers.run_up import pick_start, run_up

QUICK = {"steps": 3, "candidates": 2, "fastest": 4.0, "window": 12, "overlap": 6,
         "retries": 0}  # fmt: skip


@pytest.fixture(scope="module")
def walker():
    model = tiny_lstm(tiny_clips("walk_1.2", "run_3.0", "walk_0.8_turn_left_0.5"), updates=40)
    model.start_names = ("walk 1.2 m/s", "run 3.0 m/s", "walk 0.8 m/s, turn left")
    return model


@pytest.fixture(autouse=True)
def one_try(monkeypatch):
    """So small a network is always astray."""
    monkeypatch.setattr(windows, "LONGER", 0)


def calm(seed=0):
    return Chance(torch.Generator().manual_seed(seed), temperature=0.3)


def beginning(model, paths, paces=None):
    paces = paces or [1.2] * len(paths)
    return run_up(model, model.starts[[0] * len(paths)], paths, paces, calm())


BENT = Path.through([[0, 0], [0, 0.7], [0.5, 1.1]])
STRAIGHT = Path.through([[2, 1], [2.8, 1]])


@pytest.fixture(scope="module")
def before(walker):
    return beginning(walker, [BENT, STRAIGHT])


def both(walker, before, seed=0, **options):
    tables = [path.timetable(1.2, 4.0, 30.0) for path in (BENT, STRAIGHT)]
    return follow(walker, [BENT, STRAIGHT], before, tables, chance=calm(seed), **QUICK | options)


def test_the_motion_begins_where_the_path_does_and_ends_where_it_ends(walker, before):
    found = both(walker, before)
    for path, way, place in zip((BENT, STRAIGHT), found, before.place, strict=True):
        assert way.finished and not way.interrupted and way.features.isfinite().all()
        torch.testing.assert_close(place[:2], path.places[0])
        root = walker.encoding.root_path(way.features, way.place)[:, [0, 2]].double()
        assert (root[-1] - path.places[-1]).norm() < 0.3
        assert float(root_path_error(root[:, None, [0, 0, 1]], path.places).rms) < 30
        assert set(way.parts) == {
            "prior",
            "noise",
            "path",
            "time",
            "ahead",
            "resting",
            "contact",
            "poses",
        }
        windows = -(-len(way.features[1:]) // 6)
        assert way.evaluations >= windows * (3 + 1 + 2) and way.seconds > 0
    # the same seed walks the same way, another one another way
    assert torch.equal(both(walker, before)[0].features, found[0].features)
    other = both(walker, before, seed=1, method="none")
    assert not torch.equal(other[0].features[:15], found[0].features[:15])
    energy = lambda ways: sum(sum(way.parts.values()) for way in ways)
    searched = both(walker, before, steps=12)
    assert energy(searched) < energy(other)  # who searches, too, is nearer to what is wished


def test_the_state_goes_on_exactly(walker):
    """Windows end, and the network knows all that it would know had it never been stopped."""
    before = beginning(walker, [STRAIGHT])
    table = STRAIGHT.timetable(1.2, 4.0, 30.0)
    how = windows.Settings(4.0, path_control.wishes, {}, calm(), "none", 1, 1, True, 0, 12, 6)
    job = windows.Job(walker, [STRAIGHT], before, [windows.Way(table, [before.frame])], how)
    for _ in range(2):
        job.go_on()
    frames = torch.cat(job.ways[0].frames)[None]
    assert frames.shape[1] == 13
    _, state = walker.read(frames[:, 1:], before.state)  # nothing disturbed it
    torch.testing.assert_close(job.before.state.cell, state.cell, atol=1e-5, rtol=1e-4)
    torch.testing.assert_close(job.before.frame, frames[:, -1])
    root = walker.encoding.root_path(frames, before.place)[0, -1, [0, 2]].double()
    torch.testing.assert_close(job.before.place[0, :2], root, atol=1e-5, rtol=0)


def test_times_fix_the_frames_waits_and_all(walker):
    path = Path.through([[0, 0], [0, 0.4], [0, 0.4], [0, 0.8]], times=[0, 0.4, 0.6, 1.0])
    (way,) = follow(
        walker, [path], beginning(walker, [path]), [path.timetable(1, 4.0, 30.0)],
        chance=calm(), **QUICK,
    )  # fmt: skip
    assert len(way.features) == 31 and way.finished


def test_who_never_arrives_stops_all_the_same(walker):
    """A wish that holds the body back: told, and no endless loop."""
    stay = lambda stretch: {"stay": terms.speed(0.0, 30.0, std=1e-3)}
    (way,) = follow(
        walker, [STRAIGHT], beginning(walker, [STRAIGHT]), [STRAIGHT.timetable(1.2, 4.0, 30.0)],
        wish=stay, chance=calm(), **QUICK | {"steps": 10},
    )  # fmt: skip
    assert way.features.isfinite().all() and len(way.features) < 120
    assert set(way.parts) == {"prior", "noise", "stay"}


def test_who_is_astray_begins_again_so_often_and_no_more(walker, monkeypatch):
    monkeypatch.setattr(windows, "ASTRAY", 0.0)
    table = STRAIGHT.timetable(1.2, 4.0, 30.0)
    (way,) = follow(
        walker, [STRAIGHT], beginning(walker, [STRAIGHT]), [table], chance=calm(),
        **QUICK | {"retries": 2},
    )  # fmt: skip
    assert way.retries >= 2 and way.retries % 2 == 0
    assert way.features.isfinite().all()


def test_who_holds_a_broken_pose_begins_again_and_whole_ones_win(walker, monkeypatch):
    """Even if their energy is higher: what is judged first is always called broken here."""
    judged, before = [], beginning(walker, [STRAIGHT])

    def beyond(encoding, features):
        judged.append(len(features))
        return torch.full(features.shape[:2], 1.0 if len(judged) % 2 else -1.0)

    monkeypatch.setattr(windows.broken, "beyond", beyond)
    monkeypatch.setattr(windows, "ASTRAY", torch.inf)
    monkeypatch.setattr(windows, "UNLIKELY", torch.inf)
    table = STRAIGHT.timetable(1.2, 4.0, 30.0)
    (way,) = follow(walker, [STRAIGHT], before, [table], chance=calm(), **QUICK | {"retries": 1})
    assert way.retries == len(judged) / 2 == -(-len(way.features[1:]) // 6)


@pytest.mark.parametrize(
    ("pace", "timed", "late"),
    [(1.2, False, False), (1.0, False, False), (0.4, False, True), (2.2, False, True),
     (1.2, True, False), (0.7, True, True), (1.7, True, True)],
)  # fmt: skip
def test_who_is_far_behind_or_before_is_late(walker, pace, timed, late):
    """Of a line that is walked at 1.2 m/s; one with times gives no leeway."""
    path = Path.through([[2, 1], [5, 1]], times=[0, 2.5] if timed else None)
    table = path.timetable(None if timed else 1.2, 4.0, 30.0)
    settings = windows.Settings(
        4.0, path_control.wishes, {}, calm(), "adam", 1, 1, False, 0, 34, 17
    )
    before = beginning(walker, [path])
    job = windows.Job(walker, [path], before, [windows.Way(table, [before.frame[0]])], settings)
    features = before.frame[:, None].repeat(1, 34, 1)
    facing = torch.remainder(torch.pi / 2 - before.place[0, 2], 2 * torch.pi)
    features[..., :3] = torch.stack([facing.sin(), facing.cos(), facing * 0]) * pace / 30
    features[..., 2] = 0.0
    s = walker.normalizer(features)
    solved = windows.Solved(s, torch.zeros_like(features), torch.zeros(1), 0)
    rows = torch.arange(1)
    assert bool(job._late(job._due(), solved, rows)) is late


def test_who_begins_again_is_guided(walker, monkeypatch):
    monkeypatch.setattr(windows, "ASTRAY", 0.0)
    pushes, guided = [], windows.guided
    monkeypatch.setattr(windows, "guided", lambda *a: pushes.append(a[-1]) or guided(*a))
    table = STRAIGHT.timetable(1.2, 4.0, 30.0)
    follow(walker, [STRAIGHT], beginning(walker, [STRAIGHT]), [table], chance=calm(),
           **QUICK | {"retries": 1})  # fmt: skip
    assert pushes[:4] == [False, True, False, True]


def test_who_begins_again_goes_on_searching_too(walker, monkeypatch):
    """Or a late window would be given for one that is in time, and rough."""
    monkeypatch.setattr(windows, "ROUGH", 0.0)
    monkeypatch.setattr(windows, "ASTRAY", 0.0)
    table, looked = STRAIGHT.timetable(1.2, 4.0, 30.0), []
    for longer in (0, 1):
        monkeypatch.setattr(windows, "LONGER", longer)
        (way,) = follow(walker, [STRAIGHT], beginning(walker, [STRAIGHT]), [table], chance=calm(),
                        **QUICK | {"retries": 1})  # fmt: skip
        looked.append(way.evaluations / (len(way.features) - 1))
    assert looked[1] > 1.4 * looked[0]  # both searches of a window are longer


def test_better_is_lower_or_whole():
    first = windows.Solved(torch.zeros(3, 1), torch.zeros(3, 1), torch.tensor([1.0, 2, 3]), 1)
    again = windows.Solved(torch.ones(2, 1), torch.ones(2, 1), torch.tensor([9.0, 1]), 1)
    rows = torch.tensor([1, 2])
    found = windows._better(first, again, rows)
    assert found.energy.tolist() == [1, 2, 1] and found.s[:, 0].tolist() == [0, 0, 1]
    found = windows._better(first, again, rows, torch.tensor([True, False]))
    assert found.energy.tolist() == [1, 9, 1] and found.s[:, 0].tolist() == [0, 1, 1]


@pytest.mark.parametrize(("rough", "more"), [(0.0, True), (10.0, False)])
def test_who_is_not_near_goes_on_searching(walker, before, monkeypatch, rough, more):
    monkeypatch.setattr(windows, "ROUGH", rough)
    table = STRAIGHT.timetable(1.2, 4.0, 30.0)
    looked = []
    for longer in (0, 1):
        monkeypatch.setattr(windows, "LONGER", longer)
        (way,) = follow(walker, [STRAIGHT], before[[1]], [table], chance=calm(), **QUICK)
        looked.append(way.evaluations / len(way.features))
    assert (looked[1] > looked[0]) == more


@pytest.mark.parametrize("timed", [False, True])
def test_what_stands_fast_is_shown_window_by_window(walker, timed):
    more = {"times": [0, 0.5, 1.1]} if timed else {}
    paths = [Path.through([[0, 0], [0, 0.4], [0.2, 0.7]], **more), STRAIGHT]
    shown = []
    found = follow(
        walker, paths, beginning(walker, paths), [p.timetable(1.2, 4.0, 30.0) for p in paths],
        chance=calm(), watch=shown.append, **QUICK,
    )  # fmt: skip
    for number, way in enumerate(found):
        news = [some for some in shown if some.path == number]
        rows = [news[0].features[:1], *(some.features[1:] for some in news)]
        assert torch.equal(torch.cat(rows), way.features)
        done = [some.done for some in news]
        assert done == sorted(done) and done[-1] == 1 and 0 < done[0] < 1
        walked = walker.encoding.root_path(way.features, way.place)[:, [0, 2]].double()
        frame = len(news[0].features) - 1
        torch.testing.assert_close(news[1].place[:2], walked[frame], atol=1e-5, rtol=0)


def test_who_watches_may_leave_off(walker):
    shown = []

    def watch(news):
        shown.append(news)
        if len(shown) == 2:
            raise KeyboardInterrupt

    (way,) = follow(
        walker, [BENT], beginning(walker, [BENT]), [BENT.timetable(1.2, 4.0, 30.0)],
        chance=calm(), watch=watch, **QUICK,
    )  # fmt: skip
    assert way.interrupted and len(way.features) == 1 + 12 + 6


@pytest.mark.parametrize("name", path_control.BASELINES)
def test_what_a_search_is_compared_with(walker, before, name):
    few = {"steps": 2, "candidates": 2}
    given = path_control.BASELINES[name]
    found = both(walker, before, **given | {key: few[key] for key in few if key in given})
    for way in found:
        assert way.finished and way.features.isfinite().all() and way.retries == 0


def test_free_samples_know_nothing_of_the_path(walker, before):
    """Drawn by the same chance, they are the network's own, and the same on every path."""
    frames = []
    for path in (STRAIGHT, Path.through([[2, 1], [2.0, 1.5]])):
        tables = [path.timetable(1.2, 4.0, 30.0)]
        free = dict(method="none", guide=False, candidates=1, chance=calm())
        (way,) = follow(walker, [path], before[[1]], tables, **QUICK | free)
        frames.append(way.features[:10])
    assert torch.equal(*frames)


def test_interrupted_it_gives_what_it_has(walker):
    asked = []

    def wish(stretch):
        asked.append(stretch.first)
        if stretch.first == 12:
            raise KeyboardInterrupt
        return path_control.wishes(stretch)

    run = lambda wish: follow(
        walker, [BENT], beginning(walker, [BENT]), [BENT.timetable(1.2, 4.0, 30.0)],
        wish=wish, chance=calm(), **QUICK,
    )  # fmt: skip
    (way,) = run(wish)
    assert way.interrupted and not way.finished and len(way.features) == 1 + 12 + 6

    def at_once(stretch):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run(at_once)


def test_each_path_may_have_weights_of_its_own(walker):
    paths = [BENT, BENT]
    tables = [path.timetable(1.2, 4.0, 30.0) for path in paths]
    weights = {"path": torch.tensor([0.0, 1.0]), "time": 1.0}
    free, held = follow(
        walker, paths, beginning(walker, paths), tables, weights=weights, chance=calm(), **QUICK
    )
    assert free.parts["path"] == 0 and held.parts["path"] > 0
    assert free.retries == 0  # who is asked for no path can't be astray of it
    assert free.features.isfinite().all() and held.features.isfinite().all()


@pytest.mark.parametrize(
    ("options", "said"),
    [({"method": "newton"}, "adam, lbfgs"), ({"steps": 0}, "at least 1"),
     ({"overlap": 12}, "share"), ({"overlap": 0}, "share"), ({"window": 1, "overlap": 1}, "share"),
     ({"retries": -1}, "at least 1, 1 and 0"), ({"candidates": 0}, "at least 1"),
     ({"weights": {"way": 2.0}}, "the terms are"),
     ({"weights": {"path": torch.ones(2)}}, "weights for 1 path")],
)  # fmt: skip
def test_settings_that_make_no_sense(walker, options, said):
    before, table = beginning(walker, [STRAIGHT]), STRAIGHT.timetable(1.2, 4.0, 30.0)
    with pytest.raises(SolverError, match=said):
        follow(walker, [STRAIGHT], before, [table], chance=calm(), **QUICK | options)


# -- the run-up -----------------------------------------------------------------------------------


def test_a_start_is_picked_by_name_and_speed(walker):
    assert [pick_start(walker, None, pace) for pace in (0.9, 2.0, 2.9)] == [0, 0, 1]
    assert (
        pick_start(walker, 2, 1.0) == 2
        and pick_start(walker, "run", 1.0) == 1
        and pick_start(walker, "2", 1.0) == 2
    )
    assert pick_start(walker, "walk 0.8", 1.0) == 2 and pick_start(walker, "walk", 0.8) == 0
    for wrong in ("fly", "7", "", 7, -1):
        with pytest.raises(SolverError, match=r"1 run 3\.0 m/s"):
            pick_start(walker, wrong, 1.0)


def test_the_run_up_leads_onto_the_path(walker):
    paths = [BENT, STRAIGHT, Path.through([[0, 0], [-2, -2]])]
    before = run_up(walker, walker.starts[[0, 0, 0]], paths, [1.2] * 3, calm())
    assert isinstance(before, Before) and before.place.shape == (3, 3)
    for path, place in zip(paths, before.place, strict=True):
        torch.testing.assert_close(place[:2], path.places[0])
        ahead = path.places[5] - path.places[0]
        off = torch.atan2(ahead[0], ahead[1]) - place[2]
        assert off.cos() > 0.8  # it faces about where it is going
