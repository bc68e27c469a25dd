"""Whose data are behind weights, and what of theirs holds for what was made of them."""

import hashlib
from dataclasses import replace

import pytest

from motionlab import datasets, weights
from motionlab.training.checkpoints import load_weights, save_weights
from motionlab.training.licence import in_words, licence


def of(data, source, clip=None):
    """The data, as if all clips were of another source, and called after one of its clips."""
    names = (name.partition("/")[2] if clip is None else clip for name in data.names)
    return replace(data, names=tuple(f"{source}/{name}" for name in names))


def test_a_data_set_has_its_licence(gaits):
    found = licence(gaits)
    assert found["commercial"] and not found["own"] and found["base"] is None
    (line,) = found["sources"]
    assert "(`gaits`), 100.0 % of the frames: MIT" in line
    said = in_words(found)
    assert said.startswith("The licences of its data allow") and f"* {line}" in said


@pytest.mark.parametrize(("source", "commercial"), [("bandai-actions", False), ("cmu", True)])
def test_one_that_forbids_commercial_use_forbids_it_of_all(gaits, source, commercial):
    clip = datasets.table(source).name[0]
    found = licence(of(gaits, source, f"{clip}_mirrored"))
    assert found["commercial"] == commercial and not found["own"]
    assert datasets.info(source).licence in found["sources"][0]


@pytest.mark.parametrize("source", ["mine", "cmu"])  # a folder may be called as a data set is
def test_of_clips_of_ones_own_their_owner_decides(gaits, source):
    found = licence(of(gaits, source))
    assert found["own"] and found["commercial"]
    assert f"(`{source}`), 100.0 % of the frames: as their owner says" in found["sources"][0]
    assert "of clips of your own you decide" in in_words(found)


@pytest.mark.parametrize("name", weights.names())
def test_what_begins_with_shipped_weights_has_the_stricter_licence_of_both(gaits, name):
    file = weights.find(name)
    found = licence(of(gaits, "mine"), file)
    card = file.with_suffix(".md").read_text(encoding="utf-8")
    assert found["commercial"] == ("Not for commercial use" not in card)
    assert found["base"]["name"] == name
    assert found["base"]["sha256"] == hashlib.sha256(file.read_bytes()).hexdigest()
    said = in_words(found)
    assert said.startswith("Not for commercial use") != found["commercial"]
    assert name in said and found["base"]["sha256"] in said and "(`mine`)" in said
    its = [line for line in card.splitlines() if line.startswith("* ")]
    assert its and all(line in said for line in its)


def test_it_goes_on_from_training_to_training(gaits, train, smoke, tmp_path):
    start = weights.find("lstm-gmm-contacts")
    train(tmp_path / "one", smoke(updates=1, decay=0), start=start)
    train(tmp_path / "two", smoke(updates=1, decay=0), start=tmp_path / "one" / "best.safetensors")
    found = licence(gaits, tmp_path / "two" / "best.safetensors")
    chain = []
    while found is not None:
        assert not found["commercial"] or found["base"] is None
        chain.append(found["base"] and found["base"]["name"])
        found = found["base"] and found["base"]["licence"]
    assert chain == ["two/best.safetensors", "one/best.safetensors", "lstm-gmm-contacts", None]


def test_of_weights_without_a_card_nothing_is_allowed(gaits, tmp_path):
    copied = tmp_path / "weights.safetensors"
    model, about = load_weights(weights.find("lstm-gmm-permissive"))
    assert licence(gaits, weights.find("lstm-gmm-permissive"))["commercial"]
    about.pop("licence")  # as weights had none that were trained before it was kept in them
    save_weights(copied, model, about)
    found = licence(gaits, copied)
    assert not found["commercial"] and "nothing is known" in in_words(found)
