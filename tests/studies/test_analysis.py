"""From files to a report: what is true of the raters is what is said, and who they were."""

from __future__ import annotations

import json
from dataclasses import replace

import pytest

from motionlab.errors import StudyError
from motionlab.studies.analysis import ALL, analyse
from motionlab.studies.answers import LeftOut, read_answers
from motionlab.studies.report import SIMULATED, in_words
from motionlab.studies.simulate import spaced, write_answers

pytest.importorskip("statsmodels")


def answered(built, folder, felt=None, raters=30, **settings):
    write_answers(built.study, folder, felt or spaced(built.study), raters=raters, **settings)
    return read_answers(folder, built.study, simulated=True)


@pytest.mark.parametrize("kind", ["rated", "paired"])
def test_the_order_of_the_methods_is_found(kind, request, tmp_path):
    built = request.getfixturevalue(kind)
    answers, out = answered(built, tmp_path)
    found = analyse(built.study, answers, difference=0.2)
    assert [table.gait for table in found.tables] == ["run", "walk", ALL]
    for table in found.tables:
        good = [row[0] if kind == "rated" else row.strength for row in table.rows]
        assert good == sorted(good)  # as `spaced` has it, in the order of names
        assert table.compared[1].holm < 0.001  # the first against the last
    assert set(found.needed) == {"run", "walk", ALL} and all(n >= 6 for n in found.needed.values())
    assert found.raters + len(out) == 30 and all(left.rule for left in out)


def test_the_sides_of_odd_orders_are_exchanged_back(paired, tmp_path):
    """All raters take the same method wherever it stands."""
    felt = dict(zip(paired.study.methods, (-40.0, 0.0, 40.0), strict=True))
    answers, _ = answered(paired, tmp_path, felt, raters=4, careless=0)
    values = [set(one.values[i.id] for i in paired.study.items if i.clips) for one in answers]
    assert values == [{1, 2}] * 4  # left and right
    found = analyse(paired.study, answers)
    assert [row.share for row in found.tables[-1].rows] == [0, 0.5, 1]
    assert found.agreement == 1
    assert "never won or never lost" in in_words(found, [])


def test_simulated_answers_are_called_so_wherever_they_are_shown(rated, tmp_path):
    answers, out = answered(rated, tmp_path)
    found = analyse(rated.study, answers)
    text = in_words(found, out)
    assert text.startswith(SIMULATED) and text.count(SIMULATED) == 2 and "simulated raters" in text
    assert json.loads(found.to_json())["who"] == "simulated"
    person = replace(answers[0], simulated=False)
    text = in_words(analyse(rated.study, [person]), [])
    assert "imulated" not in text.replace("simulated_", "") and "1 rater: too few" in text
    with pytest.raises(StudyError, match="can't be analysed together"):
        analyse(rated.study, [*answers, person])
    with pytest.raises(StudyError, match="no answers"):
        analyse(rated.study, [])


def test_rules_stand_in_the_report_and_every_file_with_its_reason(rated, tmp_path):
    answers, _ = answered(rated, tmp_path)
    many = [LeftOut(tmp_path / f"{i}.json", "is empty") for i in range(25)]
    text = in_words(
        analyse(rated.study, answers), [*many, LeftOut(tmp_path / "x.json", "slept", True)]
    )
    for rule in rated.study.rules.in_words():
        assert rule in text
    assert "19.json: is empty" in text and "and 5 more" in text
    assert text.endswith("Left out by the rules:\n  x.json: slept")


def test_a_study_of_one_method_has_a_mean_and_nothing_compared(tmp_path):
    from study_cases import sources

    from motionlab.studies.build import build

    built = build(sources(methods=("A",), kinds=("walk",), clips=1))
    answers, _ = answered(built, tmp_path, {"A": 3.0}, careless=0)
    found = analyse(built.study, answers, difference=1)
    (table,) = found.tables
    assert 2 < table.rows[0].mean < 4 and table.compared == () and found.needed == {}
    assert json.loads(found.to_json())["tables"][0]["spread"] is None


def test_simulating_asks_for_every_method(rated, tmp_path):
    with pytest.raises(StudyError, match="each of GAN2, RNN, mocap"):
        write_answers(rated.study, tmp_path, {"GAN2": 3})
    with pytest.raises(StudyError, match="careless"):
        write_answers(rated.study, tmp_path, spaced(rated.study), careless=2)
