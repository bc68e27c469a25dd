"""`motionlab.design` and `motionlab design`, on weights that were shipped a moment ago."""

import math

import pytest
import torch

import motionlab
from motionlab.__main__ import main
from motionlab.datasets import gaits
from motionlab.errors import EncodingError, MotionLabError, SolverError, WayError
from motionlab.models import Refiner
from motionlab.paths import Path
from motionlab.solvers.design import design_all, enlarged, fastest_of

QUICK = {"steps": 2, "candidates": 1}
CORNER = [[1, 1], [1, 2.2], [2.2, 2.2]]


@pytest.fixture(scope="module")
def model(shipped):
    return motionlab.load(shipped)


def test_a_path_becomes_a_motion_that_stands_on_it(model):
    motion, record = motionlab.design(CORNER, model=model, **QUICK)
    root = motion.root_positions
    assert root[0, [0, 2]].tolist() == pytest.approx([1, 1], abs=1e-4)
    assert motion.positions().isfinite().all() and motion.fps == 30
    assert record["timing"]["walked (s)"] == pytest.approx((len(motion) - 1) / 30)
    assert record["error (cm)"]["rms"] >= 0 and record["evaluations"] > 0
    assert record["start"] in model.start_names
    again, _ = motionlab.design(CORNER, model=model, **QUICK)
    assert torch.equal(again.rotations, motion.rotations)
    other, _ = motionlab.design(CORNER, model=model, seed=1, **QUICK)
    assert len(other) != len(motion) or not torch.equal(other.rotations, motion.rotations)


def test_what_no_one_can_do_is_told_by_how_much_and_where(model):
    fastest = fastest_of(model)
    motion, record = motionlab.design([[0, 0], [0, 3]], speed=20, model=model, **QUICK)
    assert any(f"{fastest:.1f} m/s was asked" in note for note in record["notes"])
    assert record["timing"]["walked (m/s)"] < 2 * fastest
    motion, record = motionlab.design([[0, 0], [0, 30]], times=[0, 0.5], model=model, **QUICK)
    assert len(motion) == 16 and record["timing"]["missing at the end (m)"] > 20
    assert any("at the last moment" in note for note in record["notes"])
    ways = [Path.through(p) for p in ([[0, 0], [0, 1], [0, 0.2]], [[0, 0], [1, 1], [1, 0], [0, 1]])]
    for motion, record in design_all(ways, 1.2, model=model, **QUICK):
        assert motion.positions().isfinite().all()
        far = record["error (cm)"]["largest"] > 5
        assert far == any("from the drawn line, at" in note for note in record["notes"])


def test_it_begins_with_what_a_motion_ends_with(model):
    clip = gaits.make(seconds=2, speed=1.2)
    motion, record = motionlab.design(CORNER, model=model, start=clip, **QUICK)
    assert record["start"] == "a motion" and motion.positions().isfinite().all()
    assert motion.root_positions[0, [0, 2]].tolist() == pytest.approx([1, 1], abs=1e-4)
    other, _ = motionlab.design(CORNER, model=model, start=clip[:20], **QUICK)
    assert len(other) != len(motion) or not torch.equal(other.rotations, motion.rotations)
    with pytest.raises(EncodingError, match="resample"):
        motionlab.design(CORNER, model=model, start=gaits.make(seconds=1, fps=60), **QUICK)


def test_a_refiner_moves_the_body_and_not_its_way(model):
    torch.manual_seed(0)
    refiner = Refiner(model.encoding, model.normalizer, width=8).eval().requires_grad_(False)
    for weights in refiner.parameters():
        torch.nn.init.normal_(weights, std=0.3)
    plain, record = motionlab.design(CORNER, model=model, **QUICK)
    refined, of_refined = motionlab.design(CORNER, model=model, refiner=refiner, **QUICK)
    assert not torch.allclose(refined.rotations, plain.rotations, atol=1e-3)
    ground = [motion.root_positions[:, [0, 2]] for motion in (refined, plain)]
    torch.testing.assert_close(*ground)
    assert of_refined["error (cm)"] == pytest.approx(record["error (cm)"], abs=1e-3)
    locked, _ = motionlab.design(CORNER, model=model, refiner=refiner, lock=True, **QUICK)
    torch.testing.assert_close(locked.root_positions[:, [0, 2]], ground[0])


def test_what_is_watched_is_the_motion_where_it_stands(model):
    shown, done = [], []

    def watch(motion, share):
        shown.append(motion)
        done.append(share)

    motion, _ = motionlab.design(CORNER, model=model, watch=watch, **QUICK)
    points = torch.cat([some.positions() for some in shown])
    torch.testing.assert_close(points, motion.positions(), atol=1e-4, rtol=0)
    assert len(shown) > 1 and done == sorted(done) and done[-1] == 1
    contacts = torch.cat([some.contacts for some in shown])
    assert torch.equal(contacts, motion.contacts)
    ways, numbers = [Path.through([[0, 0], [0, 0.5]]), Path.through(CORNER)], []
    design_all(ways, model=model, watch=lambda number, *_: numbers.append(number), **QUICK)
    assert set(numbers) == {0, 1} and numbers.count(1) > numbers.count(0)


def test_who_watches_may_leave_off(model):
    def watch(motion, share):
        raise KeyboardInterrupt

    motion, record = motionlab.design(CORNER, model=model, watch=watch, **QUICK)
    assert record["interrupted"] and len(motion) == 1 + 34
    assert "interrupted" in record["notes"][0]


def test_a_window_longer_than_the_path_and_a_lock(model):
    motion, record = motionlab.design([[0, 0], [0.3, 0]], model=model, lock=True, **QUICK)
    assert 2 <= len(motion) < 34 and motion.positions().isfinite().all()
    assert record["error (cm)"]["rms of the stride's mean"] is None


@pytest.mark.parametrize(
    ("arguments", "said"),
    [({"points": [[0, 0]]}, "two places"), ({"points": [[0, 0], [math.nan, 1]]}, "Place 2"),
     ({"speed": 0}, "0.1 or more"), ({"speed": math.nan}, "0.1 or more"),
     ({"speed": 1.2, "times": [0, 1, 2]}, "leave the speed out"), ({"start": "fly"}, "there is none"),
     ({"times": [0, 2, 1]}, "must rise"), ({"model": "aclstm-martial"}, "LstmGmm on JointAngles"),
     ({"refiner": torch.nn.Linear(1, 1)}, "refiner is Linear")],
)  # fmt: skip
def test_what_can_not_be_asked(model, arguments, said):
    with pytest.raises(MotionLabError, match=said) as error:
        motionlab.design(**{"points": CORNER, "model": model} | QUICK | arguments)
    of_the_path = said in ("two places", "Place 2", "must rise")
    assert error.type is (WayError if of_the_path else SolverError)


# -- motionlab design -----------------------------------------------------------------------------


@pytest.fixture
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def designed(shipped, *more):
    return main(["design", "path.csv", "--model", str(shipped), "--steps", "1", *more])


def test_a_table_becomes_a_file(here, shipped, capsys):
    (here / "path.csv").write_text("\ufeffx, z\n1,1\n1,2.5\n\n", encoding="utf-8")
    assert designed(shipped, "--out", "walk.bvh", "--speed", "1.3") == 0
    said = capsys.readouterr().out
    assert said.startswith("walk.bvh: 1.") and "cm from the path" in said
    root = motionlab.read_bvh("walk.bvh").root_positions
    assert root[0, [0, 2]].tolist() == pytest.approx([1, 1], abs=1e-3)
    (here / "path.csv").write_text("t,x,z\n0,0,0\n1,0,1\n")
    assert designed(shipped, "--out", "walk.glb", "--lock-feet", "--root-motion", "ground") == 0
    assert motionlab.read_gltf("walk.glb").seconds == pytest.approx(1, abs=0.05)


def test_on_a_larger_rig_the_path_is_where_it_was(here, shipped, capsys):
    """Longer legs make longer steps, of which fewer are taken. (Ten steps of the search: what a barely
    trained network dreams can crouch so low that longer legs find no place under it.)"""
    (here / "path.csv").write_text("x,z\n1,1\n1,2.5\n")
    motionlab.write_bvh(gaits.make(seconds=0.2, speed=1.2), "rig.bvh")
    rig = ["--skeleton", "rig.bvh", "--rig-units", "0.012", "--no-rig-axes"]  # as tall as 1.92 m
    assert designed(shipped, "--out", "tall.bvh", *rig, "--steps", "10") == 0
    assert "of its own size (1.20" in capsys.readouterr().out
    hips = motionlab.read_bvh("tall.bvh").root_positions
    assert hips[0, [0, 2]].tolist() == pytest.approx([1, 1], abs=0.02)
    assert designed(shipped, "--out", "usual.bvh", "--steps", "10") == 0
    usual = motionlab.read_bvh("usual.bvh").root_positions
    assert abs(hips[-1, 2] - usual[-1, 2]) < 0.3 and hips[:, 1].mean() > 1.15 * usual[:, 1].mean()


def test_on_a_larger_rig_what_was_missed_is_told_in_its_own_metres(here, shipped, model, capsys):
    (here / "path.csv").write_text("x,z\n0,3\n0,6\n3,6\n")
    motionlab.write_bvh(gaits.make(seconds=0.2, speed=1.2), "rig.bvh")
    rig = ["--skeleton", "rig.bvh", "--rig-units", "0.012", "--no-rig-axes"]
    assert designed(shipped, "--out", "fast.bvh", "--speed", "20", *rig) == 0
    said = capsys.readouterr().out
    assert "note: 20 m/s is faster" in said
    assert f"; {1.2 * fastest_of(model):.1f} m/s was asked" in said


def test_a_record_enlarged_keeps_times_and_counts(model):
    _, record = motionlab.design(CORNER, speed=20, model=model, **QUICK)
    twice = enlarged(record, 2.0)
    assert twice["path (m)"] == 2 * record["path (m)"]
    assert twice["error (cm)"]["rms"] == 2 * record["error (cm)"]["rms"]
    place = record["largest error"]["place (m)"]
    assert twice["largest error"]["place (m)"] == pytest.approx([2 * x for x in place])
    assert twice["largest error"]["seconds"] == record["largest error"]["seconds"]
    assert twice["timing"]["asked (m/s)"] == 40
    assert twice["timing"]["asked (s)"] == record["timing"]["asked (s)"]
    assert twice["evaluations"] == record["evaluations"]
    assert any(note.startswith("40 m/s is faster") for note in twice["notes"])


BAD = [
    ("1,2\n3,4\n", "line 1: '1,2'; the header must be x,z or t,x,z"),
    ("", "line 1: 'nothing'"),
    ("x,y,z\n1,2,3\n", "the header must be"),
    ("x,z\n1,2\n3\n", "line 3: '3'; 2 numbers"),
    ("x,z\n1,2\n3,four\n", "line 3: '3,four'"),
    ("x,z\n1,2\n", "two places"),
    ("x,z\n1,2\n1,nan\n", "Place 2"),
    ("t,x,z\n1,0,0\n0,1,1\n", "must rise"),
]


@pytest.mark.parametrize(("text", "said"), BAD, ids=[said[:20] for _, said in BAD])
def test_tables_that_are_none(here, shipped, capsys, text, said):
    (here / "path.csv").write_text(text)
    assert designed(shipped, "--out", "walk.bvh") == 1
    error = capsys.readouterr().err
    assert said in error and "path.csv" in error and "Traceback" not in error
    assert not (here / "walk.bvh").exists()


def test_files_that_are_none(here, shipped, capsys):
    assert designed(shipped, "--out", "walk.bvh") == 1
    assert "can't be read" in capsys.readouterr().err
    assert designed(shipped, "--out", "walk.txt") == 1
    assert ".bvh or .glb" in capsys.readouterr().err
