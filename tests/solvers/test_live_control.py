"""Steering a small network: commands, bad ones, budgets, streams; and the aim's arithmetic."""

import math

import pytest
import torch
from tiny_lstm import tiny_clips, tiny_lstm

import motionlab
from motionlab import metrics
from motionlab.errors import SolverError
from motionlab.metrics import broken
from motionlab.motion import concatenate
from motionlab.paths import Curves, Path
from motionlab.solvers.guided import Going
from motionlab.solvers.live_aim import BEND, HURRY, SIDEWAYS, SLOWED, STEPS, THERE, Aim
from motionlab.solvers.live_control import LiveControl
from motionlab.solvers.live_feet import Behind
from motionlab.solvers.live_frame import slowest_foot
from motionlab.solvers.live_going import wrapped


@pytest.fixture(scope="module")
def walker():
    model = tiny_lstm(tiny_clips("walk_1.2", "run_3.0", "walk_0.8_turn_left_0.5"), updates=12)
    model.start_names = ("walk 1.2 m/s", "run 3.0 m/s", "walk 0.8 m/s, turn left")
    return model


def live(model, **settings):
    return LiveControl(model, "walk", **{"futures": 4} | settings)


@pytest.mark.parametrize("way", ["push", "futures", "gradient"])
def test_two_who_are_asked_for_two_ways_part(walker, way):
    two = live(walker, characters=2, way=way, steps=2)
    two.steer(1.2, [1.2, -1.2])
    left, right = zip(*(two.go_on() for _ in range(8)), strict=True)
    assert [len(motion.root_positions) for motion in left] == [5] * 8
    left, right = two.motion(0), two.motion(1)
    assert left.root_positions[-1, 0] > 0.1 > -0.1 > right.root_positions[-1, 0]
    turns = two.going.turn  # and turn towards it
    assert turns[0] > turns[1]
    told = two.record(1)
    assert told["asked"]["direction (°)"] == pytest.approx(math.degrees(-1.2))
    assert two.evaluations == 8 * {"push": 1, "futures": 4, "gradient": 4 + 3}[way]


def test_windows_join_without_a_seam_and_a_seed_does_the_same_again(walker):
    one, same = live(walker, seed=3), live(walker, seed=3)
    for each in (one, same):
        each.steer(1.2, 0.8)
        for _ in range(4):
            each.go_on()
    motion = one.motion()
    torch.testing.assert_close(motion.root_positions, same.motion().root_positions)
    steps = motion.root_positions.diff(dim=0).norm(dim=1)
    assert steps[4::5].max() < 2 * steps.mean() + 0.02
    x, z = motion.root_positions[-1, [0, 2]].tolist()
    assert (x, z) == pytest.approx(one.going.place[0, :2].tolist(), abs=1e-4)


def test_who_is_asked_to_stand_stands_and_who_has_come_there_too(walker):
    two = live(walker, characters=2)
    two.steer(1.2, 0.0)
    two.steer(0.0, who=0)
    two.steer(target=[0.0, 0.8], who=1)
    for _ in range(24):
        two.go_on()
    assert two.going.velocity[0].norm() < 0.2
    assert (two.going.place[1, :2] - torch.tensor([0.0, 0.8])).norm() < 0.6


def test_a_path_is_walked_from_its_beginning(walker):
    one = live(walker)
    one.steer(1.2, path=Path.through([[0, 0], [0, 1.5], [1.5, 3]]))
    for _ in range(12):
        one.go_on()
    assert 0.5 < one.aim.arcs[0] <= 4
    one.steer(1.0, 0.0)
    assert one.aim.which[0] == -1  # left again


BAD = [
    ({"speed": math.nan}, "NaN"), ({"direction": math.inf}, "NaN"), ({"speed": -1.0}, "0 or more"),
    ({"speed": "fast"}, "must be a number"), ({"speed": [1.0, 2.0, 3.0]}, "each of 1"),
    ({"direction": 1.0, "target": [1, 2]}, "one of"), ({"target": [1, math.nan]}, "NaN"),
    ({"target": [1, 2, 3]}, "2 numbers"), ({"path": [[0, 0], [0, 1]]}, "Path"),
    ({"speed": 1.0, "who": 5}, "characters 0 to 0"), ({"speed": 1.0, "who": []}, "characters"),
    ({"path": Path.through([[0, 0], [0, 1]], times=[0, 1])}, "without times"),
]  # fmt: skip


@pytest.mark.parametrize("command, says", BAD)
def test_what_is_no_command_is_said_and_changes_nothing(walker, command, says):
    one = live(walker)
    one.steer(1.0, 0.5)
    with pytest.raises(SolverError, match=says):
        one.steer(**command)
    assert one.aim.speed[0] == 1.0 and one.aim.direction[0] == 0.5


@pytest.mark.parametrize("settings, says", [
    ({"way": "magic"}, "one of push"), ({"futures": 0}, "1 to 64"), ({"futures": 65}, "1 to 64"),
    ({"window": 0}, "window"), ({"characters": 0}, "characters"), ({"seconds": 0.0}, "seconds"),
    ({"seconds": math.nan}, "seconds"), ({"budget": 0}, "budget"), ({"temperature": -1.0}, "temper"),
    ({"places": [[0, 0, math.nan]]}, "NaN"),
])  # fmt: skip
def test_settings_that_make_no_sense_are_said(walker, settings, says):
    with pytest.raises(SolverError, match=says):
        live(walker, **settings)


def test_starts_are_one_each_or_one_for_all(walker):
    two = LiveControl(walker, ["walk", "run"], 2, way="push")
    assert not torch.equal(two.before.frame[0], two.before.frame[1])
    with pytest.raises(SolverError, match="2 starts for 3"):
        LiveControl(walker, ["walk", "run"], 3)
    with pytest.raises(SolverError, match="there is none"):
        LiveControl(walker, "swim")
    with pytest.raises(SolverError, match="Nothing"):
        two.motion()


def test_nobody_runs_a_hundred_metres_a_second_and_it_is_said(walker):
    one = live(walker, way="push")
    one.steer(100.0, 0.0)
    assert one.aim.speed[0] == one.fastest < 20
    assert any("100 m/s is faster than anybody" in note for note in one.record()["notes"])
    one.steer(1.0)
    assert one.record()["notes"] == []


def test_commands_that_change_with_every_frame_are_borne(walker):
    one, chance = live(walker, window=1, way="push"), torch.Generator().manual_seed(0)
    for draw in torch.rand(30, 2, generator=chance):
        one.steer(4 * draw[0], 6.3 * draw[1])
        one.go_on()
    assert one.motion().root_positions.isfinite().all() and one.latency["window"] == 1 / 30


def test_an_hour_without_a_command_is_remembered_in_part_only(walker):
    one = live(walker, way="push")
    one.steer(1.2, 0.0)
    for kept in one.kept:
        assert kept.maxlen * one.how.window == 600 * 30
    one.going.place[0] = torch.tensor([3000.0, 4000.0, 700.0])  # where he is then
    one.before = one.before._replace(place=one.going.place.clone())
    for _ in range(8):
        one.go_on()
    assert one.going.place.isfinite().all()
    assert one.record()["seconds since asked"] == pytest.approx(40 / 30)


@pytest.mark.slow
def test_who_is_told_nothing_stands_on_or_walks_on():
    """For 2 000 frames. The stander crept at 0.4 m/s, since his last step had swayed."""
    model = motionlab.load("lstm-gmm-contacts")
    two, paces = LiveControl(model, ["stand", "walk"], 2, way="push"), []
    for _ in range(400):
        motions = two.go_on()
        paces.append(two.going.velocity.norm(dim=1))
        for motion in motions:
            assert motion.rotations.isfinite().all()
    assert two.lost == [0, 0]
    stands, walks = torch.stack(paces[100:]).unbind(1)
    assert stands.max() < 0.05
    assert (walks.mean() / two.aim.speed[1] - 1).abs() < 0.1 and walks.min() > 0.5
    for i in range(2):
        assert metrics.broken_frames(two.motion(i)).double().mean() < 0.01


def test_time_that_is_up_ends_the_search_with_the_best_there_is(walker):
    hurried = live(walker, futures=64, seconds=1e-6)
    hurried.go_on()
    assert hurried.evaluations == 8  # the first few always are
    few = live(walker, futures=64, budget=6)
    few.go_on()
    assert few.evaluations == 6
    steep = live(walker, way="gradient", futures=4, budget=9, steps=50)
    steep.go_on()
    assert steep.evaluations == 9


def test_who_comes_apart_begins_again_where_he_is(walker):
    for way in ("push", "gradient"):
        two = live(walker, characters=2, way=way, steps=1)
        two.go_on()
        place = two.going.place.clone()
        two.before.state.hidden[0] = torch.nan
        two.go_on()
        assert two.lost == [1, 0] and two.before.frame.isfinite().all()
        torch.testing.assert_close(two.going.place[0], place[0])
        two.go_on()
        assert two.motion(0).rotations.isfinite().all() and two.lost == [1, 0]
        assert "began again" in two.record(0)["notes"][-1]


def test_behind_a_lock_frames_come_later_and_all_come(walker):
    one = live(walker, way="push", lock=True)
    assert one.latency["lock"] == 5 / 30 and one.latency["at most"] == 10 / 30
    made = [one.go_on()[0] for _ in range(3)]
    assert made[0] is None and [len(each.root_positions) for each in made[1:]] == [5, 5]
    assert len(one.behind.finish()[0].root_positions) == 5


def test_the_way_that_is_done_is_told_within_half_a_turn_however_often_one_turned(walker):
    one = live(walker, way="push")
    one.going.velocity.zero_()
    one.going.place[:, 2] = 5 * math.tau + 0.5  # who stands goes where he faces
    assert one.record()["done"]["direction (°)"] == pytest.approx(math.degrees(0.5), abs=1e-3)


def test_a_lock_may_end_and_begin_and_no_frame_is_lost(walker):
    one, free = live(walker, way="push", lock=True), live(walker, way="push")
    for _ in range(3):
        one.go_on(), free.go_on()
    (left,) = one.show(refined=True, lock=False)
    assert left.frames == 5 and one.latency["lock"] == 0
    assert one.motion().frames == free.motion().frames == 15
    assert one.show(refined=True, lock=False) == [None]  # nothing changes
    unlocked, there = one.go_on()[0], free.go_on()[0]
    torch.testing.assert_close(unlocked.rotations, there.rotations)
    torch.testing.assert_close(unlocked.root_positions, there.root_positions)
    assert one.show(refined=True, lock=True) == [None] and one.go_on() == [None]
    assert one.go_on()[0].frames == 5 and one.motion().frames == 25


def test_a_refiner_that_is_not_shown_listens():
    both = [
        LiveControl(
            "lstm-gmm-contacts", "walk", way="push", refiner=motionlab.load("refiner-contacts")
        )
        for _ in range(2)
    ]
    for one in both:
        one.steer(1.2, 0.0)
    both[0].show(refined=False, lock=False)
    bare, refined = (one.go_on()[0] for one in both)
    raw = both[0].model.encoding.to_motion(both[0].before.frame)
    torch.testing.assert_close(bare.rotations[-1, 1:], raw.rotations[0, 1:], atol=1e-4, rtol=0)
    assert (bare.rotations - refined.rotations).abs().max() > 1e-3
    both[0].show(refined=True, lock=False)
    bare, refined = (one.go_on()[0] for one in both)
    torch.testing.assert_close(bare.rotations, refined.rotations, atol=1e-4, rtol=0)


def test_a_refiner_in_the_stream_is_that_of_the_whole():
    model, refiner = motionlab.load("lstm-gmm-contacts"), motionlab.load("refiner-contacts")
    chance = torch.Generator().manual_seed(0)
    with torch.no_grad():
        rows = model.generate(13, model.starts[[0, 3]], generator=chance, **model.sampling)
        whole = broken.within(model.encoding, refiner(rows))
    places = torch.tensor([[1.0, 2.0, 0.5], [0.0, 0.0, -2.0]])
    behind = Behind(model.encoding, rows[:, 0], places, refiner)
    pieces = [behind.go_on(part) for part in rows[:, 1:].split([5, 5, 2], 1)]
    for i, features in enumerate(whole):
        there = model.encoding.to_motion(features, places[i])[1:]
        came = concatenate([each[i] for each in pieces])
        torch.testing.assert_close(came.rotations, there.rotations, atol=1e-3, rtol=0)
        torch.testing.assert_close(came.root_positions, there.root_positions, atol=1e-3, rtol=0)


def going(yaw=0.0, speed=1.2, turn=0.0):
    velocity = speed * torch.tensor([[math.sin(yaw), math.cos(yaw)]], dtype=torch.double)
    place = torch.tensor([[0.0, 0.0, yaw]], dtype=torch.double)
    return Going(30.0, place, velocity, torch.tensor([turn], dtype=torch.double))


def aimed(now, speed, direction):
    aim = Aim.none(now)
    aim.speed[:], aim.direction[:] = speed, direction
    return [float(part[0]) for part in aim.wanted(now)]


def test_the_aim_turns_the_short_way_and_stays_with_the_side_it_has_begun():
    assert aimed(going(), 1.2, 0.5)[1] > 0 > aimed(going(), 1.2, -0.5)[1]
    assert aimed(going(yaw=3.0), 1.2, -3.0)[1] > 0
    behind = math.pi - 0.1
    assert aimed(going(turn=-1.0), 1.2, behind)[1] < 0 < aimed(going(), 1.2, behind)[1]


def test_the_aim_asks_for_what_bodies_can_do():
    assert aimed(going(), 1.2, 3.0)[1] == BEND
    speed, bend, _ = aimed(going(speed=3.0), 3.0, 3.0)
    assert bend == pytest.approx(SIDEWAYS / 3) and speed == SLOWED
    assert aimed(going(speed=3.0), 3.0, 0.2)[0] == 3.0
    assert aimed(going(speed=1.2), 3.0, 0.0)[0] == pytest.approx(1.2 + HURRY)
    assert aimed(going(speed=3.0), 0.0, 0.0)[0] == 0.0  # who is asked to stand does not wait
    assert aimed(going(speed=0.0), 1.2, 0.0)[0] > 0.15


def test_who_is_told_nothing_is_asked_for_his_pace_and_to_stand_if_he_hardly_moves():
    assert Aim.none(going(speed=0.2)).speed.tolist() == [0.0]
    assert Aim.none(going(speed=1.2)).speed.tolist() == [pytest.approx(1.2)]


def test_who_stands_turns_on_the_spot_only_when_it_is_worth_it():
    assert aimed(going(speed=0.0), 0.0, 0.3)[1] == 0
    assert aimed(going(speed=0.0), 0.0, 1.0)[1] > 0


def test_who_stands_turns_before_he_goes_and_who_is_slow_goes_where_he_faces():
    assert aimed(going(speed=0.0), 1.2, 3.0)[0] == 0.3  # a step, and not yet a walk
    assert aimed(going(speed=0.0), 1.2, 0.5)[0] == pytest.approx(HURRY)
    faces = going(speed=0.3)
    faces.velocity = torch.tensor([[0.3, 0.0]]).double()  # a step to the left, and faces ahead
    assert aimed(faces, 0.5, math.pi / 2)[2] == pytest.approx(math.pi / 2)
    faces.velocity = 4 * faces.velocity  # who walks goes his way, however he faces
    assert aimed(faces, 1.2, math.pi / 2)[2] == pytest.approx(0)


def test_who_stands_short_of_a_line_s_end_is_asked_for_steps_in_all_frames_of_a_window():
    """And not to stand in its last ones, as if he had gone on meanwhile: he stood there for ever."""
    now = going(speed=0.02)
    aim = Aim.none(now)
    line = Path.through([[0, -1.0], [0, 0.3]])
    aim.speed[:], aim.which[:], aim.arcs[:] = 1.2, 0, line.length - 0.3
    aim.curves, aim.lengths = Curves([line]), torch.tensor([line.length]).double()
    for frame in range(5):
        assert float(aim.wanted(now, frame / 30)[0][0]) == STEPS
    aim.arcs[:] = line.length - THERE / 2
    assert float(aim.wanted(now)[0][0]) == 0  # there


def test_all_come_to_a_line_s_end_and_stand():
    model = motionlab.load("lstm-gmm-contacts")
    eight = LiveControl(model, "stand", 8, futures=4)
    eight.steer([0.6, 1.2, 1.2, 2.5] * 2, path=Path.through([[0, 0.3], [0, 1.2], [0.5, 2]]))
    for _ in range(42):
        eight.go_on()
    off = eight.going.place[:, :2] - torch.tensor([0.5, 2.0])
    assert off.norm(dim=1).max() < THERE + 0.05
    assert eight.going.velocity.norm(dim=1).max() < 0.1


def test_a_half_turn_from_a_stand_and_at_half_a_metre_a_second_is_stepped():
    """Twelve characters: nobody walks a loop or like a crab, and feet slide less on average than they did (0.43 m/s)."""
    model = motionlab.load("lstm-gmm-contacts")
    live = LiveControl(model, ["stand"] * 6 + ["walk"] * 6, 12, futures=8, seed=2)
    live.steer([0.0] * 6 + [0.5] * 6, 0.0)
    for _ in range(14):
        live.go_on()
    turned = live.frames
    live.steer([1.2] * 6 + [0.5] * 6, math.pi - 0.02)
    for _ in range(24):
        live.go_on()
    motions = [live.motion(i) for i in range(12)]
    slid = [
        slowest_foot(motion.positions(), motion.skeleton, 30)[turned:].mean() for motion in motions
    ]
    assert torch.stack(slid).mean() < 0.35
    for motion in motions:
        facing = metrics.facing(motion.positions(), model.encoding.skeleton).double()
        off = wrapped(facing[turned + 75 :] - math.pi)
        assert off.abs().mean().rad2deg() < 25
        root = motion.root_positions[turned:, [0, 2]]
        assert (root[:, 0] - root[0, 0]).abs().max() < 1.1  # who walks a loop is farther aside
        crab = wrapped(facing[turned + 80 : -5] - way_of(motion)[turned + 75 :])
        assert crab.abs().mean().rad2deg() < 28


def way_of(motion):
    """The way of ten frames each (frames - 10,)."""
    moved = motion.root_positions[10:, [0, 2]] - motion.root_positions[:-10, [0, 2]]
    return torch.atan2(moved[:, 0], moved[:, 1]).double()
