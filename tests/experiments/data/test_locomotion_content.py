"""What is counted of clips whose content is known."""

from __future__ import annotations

import pytest

from experiments.data.locomotion_content import content, summary
from motionlab.datasets import gaits
from motionlab.training import prepare


@pytest.fixture(scope="module")
def data():
    return prepare("gaits")


def counted(data, motion) -> dict:
    return content(data, data.encoding.encode(motion))


def test_a_run_runs_and_a_walk_does_not(data):
    run, walk = (counted(data, gaits.make(seconds=4, speed=speed)) for speed in (3.0, 1.3))
    assert run["runs"] == [pytest.approx(run["seconds"])] and run["cut off"] == 1
    assert walk["runs"] == [] and walk["cut off"] == 0
    assert not any(
        walk[what] for what in ("starts", "stops", "walk to run", "run to walk", "turns")
    )


def test_starts_and_stops_and_turns_are_counted(data):
    clips = {motion.name: motion for motion in gaits.load()}
    starts = [counted(data, motion) for name, motion in clips.items() if "start" in name]
    stops = [counted(data, motion) for name, motion in clips.items() if "stop" in name]
    assert starts and all(found["starts"] == 1 and found["stops"] == 0 for found in starts)
    assert stops and all(found["stops"] == 1 and found["starts"] == 0 for found in stops)
    turning = counted(data, gaits.make(seconds=6, speed=1.3, turn_rate=1.0))
    assert turning["turns"] == 1  # one long one
    assert counted(data, gaits.make(seconds=6, speed=1.3, turn_rate=0.5))["turns"] == 0


def test_sums_over_clips(data):
    each = [
        counted(data, gaits.make(seconds=s, speed=v)) for s, v in ((4, 3.0), (8, 1.3), (6, 1.3))
    ]
    total = summary(each)
    assert total["clips"] == 3 and total["minutes"] == pytest.approx(18 / 60, abs=0.01)
    assert total["clip (s)"]["median"] == pytest.approx(6, abs=0.1)
    assert (total["runs"], total["runs cut off"]) == (1, 1)
    assert total["minutes that run"] == pytest.approx(4 / 60, abs=0.01)
