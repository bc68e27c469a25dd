"""The training loop: it learns, it can be killed, and it notices what does not belong together."""

import hashlib
import json
import os
import random
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import pytest
import torch
from safetensors import safe_open

from motionlab import Skeleton, datasets
from motionlab.encodings import JointAngles, Normalizer
from motionlab.errors import DivergedError, TrainingError
from motionlab.training import PRESETS, Prepared, build, checkpoints, loop, prepared

# Validation loss of the smoke run, nats a frame. Whoever changes it on purpose changes it here. Rows
# are rotations as two columns, which do not depend on the mean pose that is fitted to real data.
GOLDEN = {10: 213.045, 20: 169.675, 30: 91.556, 40: 58.692}

CHILD = """
import sys, torch
from pathlib import Path
torch.set_num_threads(1)
from motionlab.training import PRESETS, Prepared, build, loop
data, preset = Prepared.load(sys.argv[1]), PRESETS["lstm-gmm-contacts"]["smoke"]
model = build(data, preset)
print("ready", flush=True)
loop.train(model, data, preset, sys.argv[2], name="lstm-gmm-contacts", accelerator="cpu")
"""


def content(folder):
    """Tensors and facts of a checkpoint, without the clock."""
    tensors, facts = checkpoints.read_checkpoint(folder / "checkpoint.safetensors")
    curve = [{k: v for k, v in point.items() if k != "seconds"} for point in facts["curve"]]
    return tensors, {**facts, "seconds": None, "curve": curve}


def assert_same(folder, other):
    """Two trainings ended alike, bit for bit: weights, optimiser, curve, chosen weights."""
    (tensors, facts), (others, its_facts) = content(folder), content(other)
    assert facts == its_facts and tensors.keys() == others.keys()
    assert any(name.startswith("optimizer.") for name in tensors)
    assert all(torch.equal(tensors[name], others[name]) for name in tensors)
    best, its_best = (checkpoints.load_weights(f / "best.safetensors")[0] for f in (folder, other))
    for mine, theirs in zip(
        best.state_dict().values(), its_best.state_dict().values(), strict=True
    ):
        assert torch.equal(mine, theirs)


class Stop(Exception):
    """What a test raises where a training is to break off."""


def stop_at(monkeypatch, update):
    """Break off before an update; None: never."""
    draw = loop.draw

    def broken(windows, preset, number):
        if number == update:
            raise Stop
        return draw(windows, preset, number)

    monkeypatch.setattr(loop, "draw", broken)


@pytest.mark.parametrize("name", loop.OPTIMIZERS)
def test_a_step_does_not_depend_on_how_a_gradient_lies_in_memory(name):
    """Adam in one walk (fused) does, on a processor; see findings/."""
    slope, stepped = torch.randn(3, 4, generator=torch.Generator().manual_seed(0)), []
    for lies in (slope, slope.t().contiguous().t()):
        weight = torch.nn.Parameter(torch.zeros(3, 4))
        optimizer = loop.OPTIMIZERS[name]([weight], lr=0.1)
        for _ in range(3):
            weight.grad = lies
            optimizer.step()
        stepped.append(weight.detach())
    assert torch.equal(*stepped)


def test_golden_curve(train, smoke, tmp_path):
    encoding = JointAngles(Skeleton.canonical(), rotation="6d", contacts=True)
    motions = {split: datasets.load("gaits", split) for split in ("train", "val")}
    clips = [encoding.encode(motion) for some in motions.values() for motion in some]
    splits = [split for split, some in motions.items() for _ in some]
    lengths, normalizer = torch.tensor([len(c) for c in clips]), Normalizer.fit(clips[:32])
    names = tuple(f"gaits/{motion.name}" for some in motions.values() for motion in some)
    data = Prepared(torch.cat(clips), lengths, names, tuple(splits), encoding, normalizer, "golden")
    curve = train(tmp_path, smoke(), data=data)
    assert {point["update"]: point["val"] for point in curve} == pytest.approx(GOLDEN, abs=0.02)
    assert json.loads((tmp_path / "curve.json").read_text()) == curve
    model, about = checkpoints.load_weights(tmp_path / "best.safetensors")
    assert about["name"] == "lstm-gmm-contacts" and about["update"] == 40


def test_best_weights_have_the_best_validation(train, smoke, tmp_path, gaits):
    curve = train(tmp_path, smoke(updates=20, decay=0, validate_every=4, shrink=1.35, warmup=0))
    best = min(curve, key=lambda point: point["val"])
    assert best not in (curve[0], curve[-1])  # a rate that grows and grows: down, then up
    model, about = checkpoints.load_weights(tmp_path / "best.safetensors")
    assert about["update"] == best["update"]
    tiles = torch.cat(loop.Windows(gaits.clips("val"), 16).tiles(32))
    with torch.no_grad():
        assert model.loss(tiles).item() == pytest.approx(best["val"], abs=1e-4)


def test_killed_at_random_points_it_ends_the_same(train, smoke, tmp_path, gaits):
    gaits.save(tmp_path / "gaits.npz")
    for _ in range(2):
        with subprocess.Popen(
            [sys.executable, "-c", CHILD, tmp_path / "gaits.npz", tmp_path / "killed"],
            stdout=subprocess.PIPE,
            env={**os.environ, "OMP_NUM_THREADS": "1"},
        ) as child:
            assert child.stdout.readline().strip() == b"ready"
            time.sleep(random.uniform(0.05, 1.0))
            child.kill()  # -9
    train(tmp_path / "killed", smoke())
    train(tmp_path / "undisturbed", smoke())
    assert_same(tmp_path / "killed", tmp_path / "undisturbed")


@pytest.mark.parametrize("update", [0, 4, 10, 15])
def test_broken_off_it_ends_the_same(train, smoke, tmp_path, monkeypatch, update):
    preset = smoke(updates=16, validate_every=5)
    train(tmp_path / "undisturbed", preset)
    with monkeypatch.context() as patch, pytest.raises(Stop):
        stop_at(patch, update)
        train(tmp_path / "broken", preset)
    train(tmp_path / "broken", preset)
    assert_same(tmp_path / "broken", tmp_path / "undisturbed")


@pytest.mark.parametrize("optimizer", ["rmsprop", "sgd", "adadelta"])
def test_other_optimisers_go_on_as_well(train, smoke, tmp_path, monkeypatch, optimizer):
    preset = smoke(updates=12, validate_every=5, optimizer=optimizer)
    train(tmp_path / "undisturbed", preset)
    with monkeypatch.context() as patch, pytest.raises(Stop):
        stop_at(patch, 8)
        train(tmp_path / "broken", preset)
    train(tmp_path / "broken", preset)
    assert_same(tmp_path / "broken", tmp_path / "undisturbed")


def test_a_finished_training_stays_as_it_is(train, smoke, tmp_path):
    preset = smoke(updates=10)
    curve = train(tmp_path, preset)
    before = (tmp_path / "checkpoint.safetensors").read_bytes()
    assert train(tmp_path, preset) == curve
    assert (tmp_path / "checkpoint.safetensors").read_bytes() == before


def test_another_end_can_be_asked_for_on_the_way(train, smoke, tmp_path, monkeypatch):
    with monkeypatch.context() as patch, pytest.raises(Stop):
        stop_at(patch, 12)
        train(tmp_path / "long", smoke(updates=1000, validate_every=5))
    train(tmp_path / "long", smoke(updates=20, validate_every=5))
    train(tmp_path / "short", smoke(updates=20, validate_every=5))
    assert_same(tmp_path / "long", tmp_path / "short")
    with pytest.raises(TrainingError, match="another learning rate"):  # the fall is done
        train(tmp_path / "long", smoke(updates=60, validate_every=5))


@pytest.mark.parametrize(
    ("other", "named"),
    [
        ({"seed": 1}, "seed"),
        ({"batch": 4}, "batch"),
        ({"noise": 0.0, "clip": 1.0}, "noise, clip"),
        ({"width": 24}, "model"),
    ],
)
def test_another_preset_is_noticed(train, smoke, tmp_path, other, named):
    train(tmp_path, smoke(updates=1, decay=0))
    before = (tmp_path / "checkpoint.safetensors").read_bytes()
    with pytest.raises(TrainingError, match=f"other .*{named}"):
        train(tmp_path, smoke(updates=2, decay=0, **other))
    assert (tmp_path / "checkpoint.safetensors").read_bytes() == before


def test_other_data_or_another_model_are_noticed(train, smoke, tmp_path, gaits):
    preset = smoke(updates=1, decay=0)
    train(tmp_path, preset)
    with pytest.raises(TrainingError, match="other data"):
        train(tmp_path, preset, data=replace(gaits, hash="of something else"))
    with pytest.raises(TrainingError, match="other name, model"):
        train(tmp_path, preset, data=gaits.without_contacts(), name="lstm-gmm")


@pytest.mark.parametrize("kept", [0, 100, 5_000])
def test_a_damaged_checkpoint_is_noticed(train, smoke, tmp_path, kept):
    train(tmp_path, smoke(updates=1))
    path = tmp_path / "checkpoint.safetensors"
    path.write_bytes(path.read_bytes()[:kept])
    with pytest.raises(TrainingError, match="damaged"):
        train(tmp_path, smoke(updates=1))


def test_a_loss_that_is_no_number_stops_it(train, smoke, tmp_path, monkeypatch):
    draw = loop.draw

    def poisoned(windows, preset, update):
        batch, extras = draw(windows, preset, update)
        return batch, {"noise": extras["noise"] * (1.0 if update < 12 else torch.nan)}

    monkeypatch.setattr(loop, "draw", poisoned)
    with pytest.raises(DivergedError, match="Update 12: the loss is nan.*lower learning rate"):
        train(tmp_path, smoke())
    tensors, facts = content(tmp_path)
    assert facts["update"] == 10 and all(t.isfinite().all() for t in tensors.values())


def test_killed_after_its_last_checkpoint_nothing_is_missing(train, smoke, tmp_path, monkeypatch):
    save = loop.save_checkpoint

    def killed(path, model, optimizer, facts):
        save(path, model, optimizer, facts)
        if facts["update"] == 10:
            raise Stop

    monkeypatch.setattr(loop, "save_checkpoint", killed)
    with pytest.raises(Stop):
        train(tmp_path, smoke(updates=10, validate_every=5))
    curve = train(tmp_path, smoke(updates=10, validate_every=5))
    assert [point["update"] for point in curve] == [5, 10]
    assert json.loads((tmp_path / "curve.json").read_text()) == curve


@pytest.mark.parametrize("accelerator", ["abacus", "tpu"])
def test_a_machine_that_is_not_there(gaits, smoke, tmp_path, accelerator):
    with pytest.raises(TrainingError, match=f"Can't train on 1 x '{accelerator}'"):
        loop.train(build(gaits, smoke()), gaits, smoke(), tmp_path, name="x",
                   accelerator=accelerator)  # fmt: skip


def test_a_folder_that_cannot_be_written(train, smoke, tmp_path):
    (tmp_path / "file").write_text("in the way")
    with pytest.raises(TrainingError, match="can't be written"):
        train(tmp_path / "file", smoke())


def test_two_processes_share_a_batch(tmp_path, gaits, train, smoke):
    # so little to validate on that one process has nothing to do meanwhile
    splits = tuple("test" if s == "val" else s for s in gaits.splits[:-1]) + ("val",)
    arrays = prepared._arrays(gaits.features, gaits.lengths, gaits.names, splits, gaits.normalizer,
                              gaits.encoding)  # fmt: skip
    few = replace(gaits, splits=splits, hash=prepared._digest(arrays))
    few.save(tmp_path / "gaits.npz")
    command = ["-m", "motionlab", "train", "lstm-gmm-contacts", "--preset", "smoke",
               "--data", "gaits.npz", "--out", "two", "--accelerator", "cpu", "--devices", "2"]  # fmt: skip
    done = subprocess.run(
        [sys.executable, *command],
        cwd=tmp_path, env={**os.environ, "OMP_NUM_THREADS": "1"}, capture_output=True, text=True,
        timeout=300,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    two = json.loads((tmp_path / "two" / "curve.json").read_text())
    one = train(tmp_path / "one", smoke(), data=few)
    for mine, theirs in zip(one, two, strict=True):
        for key in ("update", "train", "val", "norm"):
            assert mine[key] == pytest.approx(theirs[key], rel=1e-3), key


def test_fine_tuning_begins_with_the_weights(train, smoke, tmp_path, gaits):
    train(tmp_path / "first", smoke())
    model = build(gaits, smoke(), tmp_path / "first" / "best.safetensors")
    curve = train(tmp_path / "second", smoke(updates=1, learning_rate=1e-9), model=model)
    first = json.loads((tmp_path / "first" / "curve.json").read_text())
    assert curve[0]["val"] == pytest.approx(min(p["val"] for p in first), abs=1e-3)
    with pytest.raises(TrainingError, match="another kind"):
        build(gaits.without_contacts(), smoke(), tmp_path / "first" / "best.safetensors")


def test_what_a_training_began_with_is_kept_and_must_be_repeated(train, smoke, tmp_path, gaits):
    preset, first = smoke(updates=1, decay=0), tmp_path / "first" / "best.safetensors"
    train(tmp_path / "first", preset)
    assert checkpoints.load_weights(first)[1]["start"] is None
    again = lambda start: train(
        tmp_path / "second", preset, model=build(gaits, preset, start), start=start
    )
    again(first)
    _, about = checkpoints.load_weights(tmp_path / "second" / "best.safetensors")
    assert about["start"] == hashlib.sha256(first.read_bytes()).hexdigest()
    again(first)  # the same weights: goes on
    train(tmp_path / "other", smoke(updates=1, decay=0, seed=1))
    before = (tmp_path / "second" / "checkpoint.safetensors").read_bytes()
    for other in (tmp_path / "other" / "best.safetensors", None):
        with pytest.raises(TrainingError, match="other start .--from.; repeat"):
            again(other)
    assert (tmp_path / "second" / "checkpoint.safetensors").read_bytes() == before
    # a training of a version that did not say began anew
    tensors, facts = checkpoints.read_checkpoint(tmp_path / "first" / "checkpoint.safetensors")
    del facts["start"]
    checkpoints._save(tmp_path / "first" / "checkpoint.safetensors", tensors, facts)
    train(tmp_path / "first", preset)


@pytest.mark.skipif(
    not Path("/proc/self/maps").exists(), reason="nothing tells what is mapped: needs Linux"
)
def test_what_was_read_does_not_hold_its_file(train, smoke, tmp_path):
    """Windows refuses to replace a file that is mapped into memory."""
    train(tmp_path, smoke(updates=1, decay=0))
    kept = [checkpoints.read_checkpoint(tmp_path / loop.CHECKPOINT)]
    kept += [checkpoints.load_weights(tmp_path / smoke().weights)]
    assert str(tmp_path) not in Path("/proc/self/maps").read_text()


def test_weights_are_arrays_with_a_header(train, smoke, tmp_path):
    train(tmp_path, smoke(updates=1))
    with safe_open(tmp_path / "best.safetensors", framework="pt") as file:
        header = json.loads(file.metadata()["motionlab"])
        assert {"normalizer.mean", "lstm.weight_hh_l1"} < set(file.keys())
    assert header["about"]["preset"]["seed"] == PRESETS["lstm-gmm"]["smoke"].seed
    for path, wrong in [("none.safetensors", "no such file"), ("curve.json", "damaged")]:
        with pytest.raises(TrainingError, match=wrong):
            checkpoints.load_weights(tmp_path / path)
    with pytest.raises(TrainingError, match="no weights of a model"):
        checkpoints.load_weights(tmp_path / "checkpoint.safetensors")
    tensors, header = checkpoints.read_checkpoint(tmp_path / "best.safetensors")
    del header["about"]
    checkpoints._save(tmp_path / "mute.safetensors", tensors, header)
    with pytest.raises(TrainingError, match="no weights of a model"):
        checkpoints.load_weights(tmp_path / "mute.safetensors")
