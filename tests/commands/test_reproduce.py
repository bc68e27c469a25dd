"""`motionlab reproduce` runs what a claim needs and what is not there yet, in order."""

import shlex
from pathlib import Path

import pytest
import yaml

from motionlab import MotionLabError
from motionlab.commands.reproduce import Reproduce, needed

ROOT = Path(__file__).parents[2]
FILE = Path("experiments", "claims", "claims.yaml")
BOOK = yaml.safe_load((ROOT / FILE).read_text(encoding="utf-8"))
CLAIMS, STEPS = BOOK["claims"], BOOK["steps"]


@pytest.fixture
def clone(tmp_path, monkeypatch):
    """A repository without data, weights or results."""
    (tmp_path / FILE).parent.mkdir(parents=True)
    (tmp_path / FILE).write_text((ROOT / FILE).read_text(encoding="utf-8"), encoding="utf-8")
    monkeypatch.chdir(tmp_path / "experiments")  # a folder within will do
    return tmp_path


def touch(clone, *files):
    for file in files:
        (clone / file).parent.mkdir(parents=True, exist_ok=True)
        (clone / file).write_text("")


def commands(capsys):
    lines = capsys.readouterr().out.splitlines()
    return [line.split("   #")[0] for line in lines]


def test_reproduce_lists_what_is_missing_in_order(clone, capsys):
    touch(clone, "src/motionlab/weights/lstm-gmm.safetensors", "results/sizes.json")
    Reproduce(("W10",), dry_run=True).run()
    assert commands(capsys) == [
        "motionlab prepare locomotion",
        "python -m experiments.rnn_gan.sizes",
        "python -m experiments.claims.verdicts W10",
    ]
    touch(clone, "runs/locomotion.npz")
    Reproduce(("W1", "W8"), dry_run=True).run()
    assert commands(capsys) == [
        "python -m experiments.rnn_gan.samples --model lstm-gmm",
        "python -m experiments.rnn_gan.memory --model lstm-gmm",
        "python -m experiments.rnn_gan.samples --model lstm-gmm --sampling "
        "results/lstm_gmm_memory.json --output results/lstm_gmm_memory_samples.json",
        "python -m experiments.rnn_gan.initial_state --model lstm-gmm",
        "motionlab prepare everything",
        "python -m experiments.rnn_gan.denoising",
        "python -m experiments.claims.verdicts W1 W8",
    ]


def test_reproduce_trains_only_when_asked(clone, capsys):
    with pytest.raises(MotionLabError, match=r"lstm-gmm\.safetensors.*--train"):
        Reproduce(("W10",), dry_run=True).run()
    Reproduce(("W10",), dry_run=True, train=True).run()
    shown = commands(capsys)
    assert shown[0] == "motionlab prepare locomotion"
    assert shown[1] == "motionlab train lstm-gmm --preset ship"
    assert shown[2].startswith("python -m experiments.shipping.weights lstm-gmm ")


def test_a_training_under_way_is_gone_on_with(clone, capsys):
    touch(clone, "runs/locomotion.npz", "runs/lstm-gmm-ship/best.safetensors")
    Reproduce(("W10",), dry_run=True, train=True).run()
    assert commands(capsys)[0] == "motionlab train lstm-gmm --preset ship"


@pytest.mark.parametrize(
    ("names", "said"), [(("W99",), "no claim 'W99'"), (("W1", "W9"), "W9: is open")]
)
def test_reproduce_of_what_is_not_there(clone, names, said):
    without = [{"id": "W9"} if its["id"] == "W9" else its for its in CLAIMS]  # it has no rule
    text = yaml.safe_dump({"claims": without, "steps": STEPS})
    (clone / FILE).write_text(text, encoding="utf-8")
    with pytest.raises(MotionLabError, match=said):
        Reproduce(names, dry_run=True).run()


def test_reproduce_outside_of_a_clone(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(MotionLabError, match="not in a clone"):
        Reproduce(("W1",)).run()


def test_reproduce_runs_commands_in_the_root_and_stops_at_the_first_that_fails(clone, capfd):
    script = "from pathlib import Path; Path('{}').write_text('')"
    steps = [
        {"makes": "a", "command": shlex.join(["python", "-c", script.format("a")])},
        {"makes": "b", "needs": ["a"], "command": "python -c 'raise SystemExit(3)'"},
        {"makes": "results/c.json", "needs": ["b"], "command": "python -c 'raise SystemExit(4)'"},
    ]
    book = {"claims": [{"id": "C1", "result": "c"}], "steps": steps}
    (clone / FILE).write_text(yaml.safe_dump(book), encoding="utf-8")
    with pytest.raises(MotionLabError, match="ended with 3"):
        Reproduce(("C1",)).run()
    assert (clone / "a").exists()
    assert [step["makes"] for step in needed(steps, {"results/c.json"}, clone, False)] == [
        "b",
        "results/c.json",
    ]
