"""Files of answers: what can't be counted is named, and left out."""

from __future__ import annotations

import json

import pytest
from study_cases import sources

from motionlab.errors import StudyError
from motionlab.studies.analysis import analyse
from motionlab.studies.answers import checksum, read_answers, to_text
from motionlab.studies.build import build
from motionlab.studies.simulate import spaced, write_answers


@pytest.fixture
def folder(rated, tmp_path):
    write_answers(rated.study, tmp_path, spaced(rated.study), raters=4, careless=0)
    for file in tmp_path.iterdir():
        change(file, lambda body: body.update(simulated=False))
    return tmp_path


def change(file, how, sealed=True):
    """Let `how` change what a file says, and seal it anew, as who knows how it is made could."""
    whole = json.loads(file.read_text(encoding="utf-8"))
    how(whole["body"])
    file.write_text(to_text(whole["body"]) if sealed else json.dumps(whole), encoding="utf-8")


def why(folder, study):
    kept, out = read_answers(folder, study)
    return {one.file.name for one in kept}, {left.file.name: left.why for left in out}


def test_whole_answers_are_all_there(folder, rated):
    kept, out = read_answers(folder, rated.study)
    assert not out and [one.order for one in kept] == [0, 1, 2, 3]
    assert all(set(one.values) == {item.id for item in rated.study.items} for one in kept)
    assert kept[0].seconds["check1"] == pytest.approx(rated.study.seconds + 2)


def test_the_checksum_is_that_of_the_page():
    """CRC-32 of '123456789' is cbf43926, and of the text that JSON.stringify makes."""
    import zlib

    assert f"{zlib.crc32(b'123456789'):08x}" == "cbf43926"
    body = {"rater": "é\n", "answers": [{"value": 1}], "simulated": False}
    text = '{"rater":"é\\n","answers":[{"value":1}],"simulated":false}'
    assert checksum(body) == f"{zlib.crc32(text.encode()):08x}"


def test_a_file_cut_anywhere_is_left_out(folder, rated):
    file = folder / "simulated_00001.json"
    whole = file.read_bytes()
    for at in [0, 1, 40, *range(100, len(whole), len(whole) // 25), len(whole) - 1]:
        file.write_bytes(whole[:at])
        kept, out = why(folder, rated.study)
        assert len(kept) == 3
        assert out == {
            file.name: "is empty" if at == 0 else "is cut or damaged: it is not whole JSON"
        }


@pytest.mark.parametrize(
    ("how", "said"),
    [
        (lambda b: b.update(hash="0" * 64, study="x"), "belongs to another study, 'x'"),
        (lambda b: b["answers"].pop(), "is not whole: 13 of 14 items"),
        (lambda b: b.update(answers=[]), "is not whole: 0 of 14"),
        (lambda b: b.update(order=99), "has the order 99"),
        (lambda b: b.update(order=True), "has the order True"),
        (lambda b: b.update(order=5), "in another order than its number says"),
        (lambda b: b.update(rater=""), "does not name its rater"),
        (lambda b: b.update(answers={"a": 1}), "no list of answers"),
        (lambda b: b.pop("simulated"), "does not say whether a person"),
        (lambda b: b["answers"][3].update(value=6), "that nobody could give"),
        (lambda b: b["answers"][3].update(value="4"), "that nobody could give"),
        (lambda b: b["answers"][3].update(plays=None), "that nobody could give"),
    ],
)
def test_what_nobody_could_have_saved_is_left_out(folder, rated, how, said):
    change(folder / "simulated_00002.json", how)
    kept, out = why(folder, rated.study)
    assert len(kept) == 3 and said in out["simulated_00002.json"]


def test_what_was_edited_is_left_out(folder, rated):
    for number, how in enumerate(
        [lambda b: b["answers"][0].update(value=5 - b["answers"][0]["value"]), lambda b: b.update(rater="me")]
    ):  # fmt: skip
        change(folder / f"simulated_{number:05d}.json", how, sealed=False)
    kept, out = why(folder, rated.study)
    assert len(kept) == 2 and all("changed after it was saved" in said for said in out.values())


def test_other_files_are_named_and_the_study_is_not(folder, rated):
    (folder / "study.json").write_text(rated.study.to_json(), encoding="utf-8")
    (folder / "study.html").write_text("page")
    (folder / "notes.txt").write_text("no answers")
    (folder / "list.json").write_text("[1, 2]")
    (folder / "binary.json").write_bytes(b"\xff\xfe\x00")
    (folder / "deep.json").write_text("[" * 100_000)
    surrogate = {
        "format": "motionlab-answers",
        "version": 1,
        "checksum": "0",
        "body": {"a": "\ud800"},
    }
    (folder / "letters.json").write_text(json.dumps(surrogate))
    kept, out = why(folder, rated.study)
    assert len(kept) == 4
    assert set(out) == {"notes.txt", "list.json", "binary.json", "deep.json", "letters.json"}
    with pytest.raises(StudyError, match="is no folder"):
        read_answers(folder / "nowhere", rated.study)


def test_a_rater_counts_once_by_what_was_finished_first(folder, rated):
    text = (folder / "simulated_00000.json").read_text(encoding="utf-8")
    (folder / "a copy.json").write_text(text, encoding="utf-8")

    def later(body):
        body["answers"][-1]["answered"] += 1
        body["answers"][0]["value"] = 6 - body["answers"][0]["value"] % 5 - 1

    (folder / "again.json").write_text(text, encoding="utf-8")
    change(folder / "again.json", later)
    kept, out = why(folder, rated.study)
    assert "a copy.json" in kept and len(kept) == 4
    assert out["simulated_00000.json"] == "has the same answers of the same rater as a copy.json"
    assert out["again.json"] == "has other answers of the same rater as a copy.json"


def test_simulated_answers_are_never_people_s(rated, folder):
    change(folder / "simulated_00003.json", lambda body: body.update(simulated=True))
    kept, out = why(folder, rated.study)
    assert len(kept) == 3 and "made by a program" in out["simulated_00003.json"]
    kept, out = read_answers(folder, rated.study, simulated=True)
    assert [one.file.name for one in kept] == ["simulated_00003.json"] and len(out) == 3


def test_the_rules_of_the_study_leave_out_who_did_not_look(folder, rated):
    def check_failed(body):
        for one in body["answers"]:
            if one["item"] == "check1":
                one["value"] = one["value"] % 5 + 1

    def always_three(body):
        for one in body["answers"]:
            if not one["item"].startswith("check"):
                one["value"] = 3

    change(folder / "simulated_00000.json", check_failed)
    change(folder / "simulated_00001.json", always_three)
    change(folder / "simulated_00002.json", lambda b: b["answers"][0].update(plays=0))
    kept, out = read_answers(folder, rated.study)
    assert [one.file.name for one in kept] == ["simulated_00003.json"]
    assert all(left.rule for left in out)
    assert [left.why for left in out] == [
        "1 of 2 attention checks answered otherwise than asked",
        "the same answer, 3, to 12 of 12 clips",
        "1 clips were never played",
    ]


@pytest.mark.slow
def test_ten_thousand_files_are_read(tmp_path):
    study = build(sources(kinds=("walk",), methods=("A", "B"), clips=1), checks=0).study
    files = write_answers(study, tmp_path, {"A": 2.0, "B": 4.0}, raters=10_000, careless=0)
    files[17].write_text("{")
    answers, out = read_answers(tmp_path, study, simulated=True)
    assert len(answers) == 9_999 and [left.file for left in out] == [files[17]]
    found = analyse(study, answers)
    assert found.tables[0].compared[0].holm < 1e-9 and found.raters == 9_999
