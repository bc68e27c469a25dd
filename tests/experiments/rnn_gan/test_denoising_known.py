"""The line under which a motion is not known, and attempts that are judged by their rule."""

import json
import math
from pathlib import Path

import pytest

from experiments.rnn_gan import denoising_attempts as attempts
from experiments.rnn_gan import denoising_known as known
from motionlab.solvers import denoise_known

RESULTS = Path(__file__).parents[3] / "results"


def case(likelihood, ratio, angle=0.08, where="own body", kind="walking"):
    return known.Case(where, kind, "mid", angle, likelihood, ratio, 1.0)


def test_the_line_parts_what_is_helped_from_what_is_harmed():
    found = [case(50, 0.7), case(45, 0.8), case(30, 1.4), case(20, 2.0)]
    line = known.fitted(found)
    assert [known.known(its, line) for its in found] == [True, True, False, False]
    height = line[0] + line[1] * math.log(0.08)
    assert height == pytest.approx(37.5, abs=0.1)  # in the middle of the gap


def test_the_line_may_rise_with_the_noise():
    """Likelihoods that part the clips otherwise at each level ask for a slope."""
    levels = {0.04: 40, 0.08: 45, 0.16: 50}
    found = [
        case(height + off, ratio, angle)
        for angle, height in levels.items()
        for off, ratio in ((2, 0.7), (-2, 1.5))
    ]
    line = known.fitted(found)
    assert all(known.known(its, line) == (its.ratio < 1) for its in found)
    assert line[1] == pytest.approx(5 / math.log(2), abs=2)


def test_harm_counts_twice():
    """Two clips as likely as each other: what one gains does not make up for the other."""
    found = [case(40, 0.8), case(40, 1.2)]
    assert not any(known.known(its, known.fitted(found)) for its in found)
    found = [case(40, 0.5), case(40, 1.2)]
    assert all(known.known(its, known.fitted(found)) for its in found)


def test_what_is_told_is_what_was_taken():
    found = [case(50, 0.5), case(10, 2.0), case(50, 0.8, where="a rig")]
    told = known.told(found, (30.0, 0.0))
    own = told["own body, walking"]
    assert own["clips"] == 2 and own["cleaned by the network"] == 1
    assert own["error over the line's"] == pytest.approx(0.5**0.5)
    assert own["always"] == pytest.approx(1.0) and own["worst"] == pytest.approx(0.5)
    assert told["other rigs, walking"]["clips"] == 1


def test_the_line_in_use_is_the_one_that_was_fitted():
    path = RESULTS / "denoising_known.json"
    if not path.is_file():
        pytest.skip("results/denoising_known.json is not made yet")
    found = json.loads(path.read_text())
    assert found["split"] == "val"
    assert found["at one"] == pytest.approx(denoise_known.AT_ONE, abs=0.06)
    assert found["slope"] == pytest.approx(denoise_known.SLOPE, abs=0.06)
    rigs = found["other rigs"]
    assert rigs["at one"] == pytest.approx(denoise_known.RIGS_AT_ONE, abs=0.06)
    assert rigs["slope"] == pytest.approx(denoise_known.RIGS_SLOPE, abs=0.06)
    rigs_cases = [known.Case(**its) for its in found["cases"] if its["where"] != "own body"]
    assert known.fitted(rigs_cases) == pytest.approx((rigs["at one"], rigs["slope"]), abs=0.06)


def rows(error=2.0, hit=8.0, skate=10.0):
    each = {attempts.ERROR: error, attempts.HIT: hit, attempts.SKATE: skate}
    return {kind: dict.fromkeys(attempts.NOISES, each) for kind in attempts.GAITS}


@pytest.mark.parametrize(
    ("helps", "found"),
    [
        (True, rows(hit=7.0)),
        (False, rows(hit=7.8)),
        (False, rows(hit=7.0, error=2.1)),
        (True, rows(hit=7.0, error=2.02)),
    ],
)
def test_an_attempt_is_judged_by_its_own_number_and_all_errors(helps, found):
    attempt = attempts.ATTEMPTS["gap: six rounds"]
    said = attempts.judged(attempt, found, rows())
    assert said["helps"] == helps
    assert attempts.judged(attempts.ATTEMPTS[attempts.BEFORE], rows(), rows()) == {}
