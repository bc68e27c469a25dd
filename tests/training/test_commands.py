"""`motionlab prepare` and `motionlab train`."""

import json
import re

import pytest
from other_axes import redrawn

import motionlab
from motionlab import write_bvh
from motionlab.__main__ import main
from motionlab.datasets import gaits
from motionlab.training import checkpoints, judging


@pytest.fixture
def here(tmp_path, monkeypatch):
    """An empty working directory."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


SMOKE = ["--preset", "smoke", "--data", "gaits", "--accelerator", "cpu", "--updates", "12"]


def test_train_prepares_trains_and_goes_on(here, capsys):
    assert main(["train", "lstm-gmm", *SMOKE]) == 0
    assert "12 updates; best of validation" in capsys.readouterr().out
    folder = here / "runs" / "lstm-gmm-smoke"
    assert (here / "runs" / "gaits.npz").exists()
    curve = json.loads((folder / "curve.json").read_text())
    assert [point["update"] for point in curve] == [10, 12]
    model, about = checkpoints.load_weights(folder / "best.safetensors")
    assert about["name"] == "lstm-gmm" and "contacts" not in model.encoding.slices
    assert main(["train", "lstm-gmm", *SMOKE]) == 0
    assert json.loads((folder / "curve.json").read_text()) == curve
    # another preset in the same folder, and weights of another kind
    assert main(["train", "lstm-gmm", *SMOKE, "--seed", "3"]) == 1
    assert "other seed" in capsys.readouterr().err
    start = ["--from", str(folder / "best.safetensors")]
    assert main(["train", "lstm-gmm-contacts", *SMOKE, *start]) == 1
    assert "features of another kind" in capsys.readouterr().err
    assert main(["train", "lstm-gmm", *SMOKE, *start, "--out", "tuned"]) == 0
    # what a training leaves can be used as it is
    tuned = motionlab.load(here / "tuned" / "best.safetensors")
    assert len(tuned.starts.frame) == len(tuned.start_names) > 3
    assert tuned.card.startswith("# lstm-gmm\n") and "which learned from" in tuned.card
    assert 0.1 <= tuned.sampling["temperature"] <= 1
    assert main(["sample", "tuned/best.safetensors", "--seconds", "1", "--out", "a.bvh"]) == 0
    assert f"from {tuned.start_names[0]!r}" in capsys.readouterr().out


def test_what_makes_no_motion_of_its_own_is_trained_and_says_so(here, capsys):
    assert main(["train", "pfnn", *SMOKE]) == 0
    said = capsys.readouterr().out
    assert "12 updates; best of validation" in said and "their card is best.md" in said
    folder = "runs/pfnn-smoke"
    assert motionlab.load(f"{folder}/best.safetensors").card.startswith("# pfnn\n")
    assert main(["sample", f"{folder}/best.safetensors", "--out", "a.bvh"]) == 1
    assert "is led along a path" in capsys.readouterr().err
    assert main(["train", "strnn-temporal", *SMOKE]) == 0
    assert "12 updates; best of validation" in capsys.readouterr().out
    folder = "runs/strnn-temporal-smoke"
    assert motionlab.load(f"{folder}/best.safetensors").card.startswith("# strnn-temporal\n")
    assert main(["sample", f"{folder}/best.safetensors", "--out", "a.bvh"]) == 1
    assert "goes on from frames" in capsys.readouterr().err
    assert main(["train", "strnn", *SMOKE]) == 1  # too few for its three stages
    assert "alone" in capsys.readouterr().err


def test_permissive_weights_are_trained_on_what_is_free(here, monkeypatch, gaits):
    asked = []

    def prepare(source, progress=False, *, permissive=False, **reading):
        asked.append((source, permissive))
        return gaits

    monkeypatch.setattr("motionlab.training.prepared.prepare", prepare)
    smoke = ["--preset", "smoke", "--accelerator", "cpu", "--updates", "2"]
    assert main(["train", "lstm-gmm-permissive", *smoke]) == 0
    assert asked == [("locomotion", True)]
    assert [path.name for path in (here / "runs").glob("*.npz")] == ["locomotion-permissive.npz"]
    model = motionlab.load(here / "runs" / "lstm-gmm-permissive-smoke" / "best.safetensors")
    assert "contacts" in model.encoding.slices
    monkeypatch.setattr(judging, "UPDATES", 5)
    weights = "runs/lstm-gmm-permissive-smoke/best.safetensors"
    assert main(["train", "refiner-permissive", *smoke, "--from", weights]) == 0
    assert [path.name for path in (here / "runs").glob("*.npz")] == ["locomotion-permissive.npz"]
    assert main(["train", "lstm-gmm-contacts", *smoke]) == 0
    assert asked[1:] == [("locomotion", False)]


def test_a_refiner_is_trained_judged_and_used(here, capsys, monkeypatch):
    monkeypatch.setattr(judging, "UPDATES", 5)
    assert main(["train", "lstm-gmm-contacts", *SMOKE, "--out", "g"]) == 0
    play = ["train", "refiner-contacts", "--preset", "smoke", "--data", "gaits", "--accelerator",
            "cpu", "--from", "g/best.safetensors", "--updates", "4"]  # fmt: skip
    assert main([*play, "--out", "r"]) == 0
    assert "the best is of step 4" in capsys.readouterr().out
    assert main([*play, "--out", "r"]) == 0  # nothing left to do but to choose
    sample = ["sample", "g/best.safetensors", "--seconds", "1", "--out"]
    assert main([*sample, "raw.bvh"]) == 0
    assert main([*sample, "refined.bvh", "--refiner", "r/best.safetensors", "--lock-feet"]) == 0
    raw, refined = (motionlab.read_bvh(here / f"{n}.bvh") for n in ("raw", "refined"))
    assert not raw.rotations.equal(refined.rotations)
    assert "another generator" not in capsys.readouterr().out
    other = ["sample", "lstm-gmm-contacts", *sample[2:], "b.bvh"]
    assert main([*other, "--refiner", "r/best.safetensors"]) == 0
    assert "learned to correct motion of another generator" in capsys.readouterr().out
    for wrong, said in [
        ([*sample, "a.bvh", "--refiner", "g/best.safetensors"], "is no refiner, but LstmGmm"),
        ([*sample, "a.bvh", "--refiner", "none"], "no such file"),
        (["sample", "lstm-gmm", "--seconds", "1", "--out", "a.bvh", "--refiner",
          "r/best.safetensors"], "features of another kind"),
        (["sample", "r/best.safetensors", "--out", "a.bvh"], "corrects motion and makes none"),
        (["evaluate", "r/best.safetensors"], "corrects motion and makes none"),
        ([*play[:-3], "r/best.safetensors"], "corrects motion and makes none"),
        (["train", "lstm-gmm-contacts", *SMOKE, "--from", "r/best.safetensors", "--out", "b"],
         "is a refiner"),
        ([*play, "--learning-rate", "0.1"], "has two"),
        (["train", "mvae"], "refiner-contacts"),
    ]:  # fmt: skip
        assert main(wrong) == 1, wrong
        assert said in capsys.readouterr().err
    assert not (here / "a.bvh").exists()


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["prepare", "amass"], "is not a folder"),
        (["train", "lstm-gmm", "--data", "none.npz"], "no such file"),
        (["train", "lstm-gmm", *SMOKE, "--learning-rate", "-1"], "learning_rate"),
        (["train", "lstm-gmm", *SMOKE, "--from", "none.safetensors"], "no such file"),
        (["sample", "aclstm-martial", "--refine", "--out", "a.bvh"], "has no refiner"),
    ],
)
def test_bad_arguments_are_answered(here, capsys, arguments, said):
    assert main(arguments) == 1
    printed = capsys.readouterr().err
    assert said in printed and "Traceback" not in printed


def test_a_folder_of_one_clip_is_too_little(here, capsys):
    (here / "mine").mkdir()
    write_bvh(gaits.make(seconds=2), here / "mine" / "walk.bvh")
    assert main(["train", "lstm-gmm", "--data", "mine"]) == 1
    said = capsys.readouterr().err
    assert "mine: has 1 clips, the longest of 2.0 s" in said and "Give more" in said
    assert not (here / "runs").exists()


def test_one_recording_of_another_rig_fine_tunes_what_ships(here, capsys):
    """From a folder, with how it is read, to a sample from a start that is called by what it does."""
    (here / "mine").mkdir()
    speed = lambda time: 1.3 * (time > 3) * (time < 60)
    write_bvh(
        redrawn(gaits.make(seconds=70, speed=speed), 4), here / "mine" / "take.bvh", units="m"
    )
    train = ["train", "lstm-gmm-contacts", "--preset", "smoke", "--updates", "2", "--accelerator",
             "cpu", "--from", "lstm-gmm-contacts", "--data", "mine", "--out", "tuned"]  # fmt: skip
    with pytest.warns(UserWarning) as caught:
        assert main([*train, "--units", "m"]) == 0
    stance, split = sorted((str(w.message) for w in caught), key=lambda said: "by time" in said)
    assert "learned once, where a person stands: take, " in stance and "split by time" in split
    model, shipped = (
        motionlab.load(name) for name in ("tuned/best.safetensors", "lstm-gmm-contacts")
    )
    assert len(model.starts.frame) == len(set(model.start_names)) > 1
    assert all(
        re.match("(walk|run|stand|backwards|sidestep|turn)", name) for name in model.start_names
    )
    for said in (shipped.hash, "`lstm-gmm-contacts`", "Not for commercial use", "(`mine`), 100.0 %",
                 "CC BY-NC 4.0", model.start_names[0]):  # fmt: skip
        assert said in model.card, said
    assert not model.about["licence"]["commercial"]
    capsys.readouterr()
    sample = ["sample", "tuned/best.safetensors", "--seconds", "1", "--out", "a.bvh", "--start"]
    assert main([*sample, "?"]) == 1
    said = capsys.readouterr().err
    assert all(name in said for name in model.start_names)
    assert main([*sample, model.start_names[-1]]) == 0


def test_prepare_into_what_cannot_be_written(here, capsys):
    (here / "file").write_text("in the way")
    assert main(["prepare", "gaits", "--out", "file/gaits.npz"]) == 1
    assert "can't be written" in capsys.readouterr().err
