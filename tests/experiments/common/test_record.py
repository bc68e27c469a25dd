"""The command that a result and a card name: one that can be typed, on any machine."""

import sys
from importlib.machinery import ModuleSpec
from types import ModuleType, SimpleNamespace

import pytest

from experiments.common import record
from experiments.shipping import cards
from motionlab import MotionLabError


@pytest.fixture
def run(monkeypatch):
    """As if python had been started so: with the name of a module, or with a file."""

    def start(name, *arguments):
        main = ModuleType("__main__")
        main.__spec__ = None if name.endswith(".py") else ModuleSpec(name, None)
        file = name if name.endswith(".py") else f"/somewhere/{name.replace('.', '/')}.py"
        monkeypatch.setitem(sys.modules, "__main__", main)
        monkeypatch.setattr(sys, "argv", [file, *arguments])

    return start


def test_a_module_is_told_by_its_name(run):
    run("experiments.rnn_gan.samples", "--model", "lstm-gmm")
    data = SimpleNamespace(hash="0")
    told = record.provenance(0.0, 0, data)["command"]
    assert told == "python -m experiments.rnn_gan.samples --model lstm-gmm"


def test_a_file_is_told_by_its_path(run):
    run("some/script.py", "7")
    assert record.command() == ["python", "some/script.py", "7"]


def test_a_card_tells_the_module_too_and_keeps_words_together(run):
    run("experiments.shipping.weights", "tiny", "--remark", "It has seen little.")
    made = cards._made_by({"command": "motionlab train tiny"})
    told = "python -m experiments.shipping.weights tiny --remark 'It has seen little.'"
    assert f"| and | `{told}` |" in made


def test_what_is_refused_is_a_sentence_after_the_modules_name(run):
    run("experiments.rnn_gan.samples")

    def refused():
        raise MotionLabError("There is no such model.")

    with pytest.raises(SystemExit, match=r"^experiments\.rnn_gan\.samples: There is no such"):
        record.run(refused)
