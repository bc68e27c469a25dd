"""Lines of one value a frame below the picture of `show`, and where its camera looks."""

from __future__ import annotations

import numpy as np
import pytest
import torch

from motionlab import MotionLabError
from motionlab.datasets import gaits
from motionlab.viewer import palette
from motionlab.viewer.live.show import show


def test_lines_are_sent_with_gaps_where_nothing_is_known():
    walk = gaits.make(seconds=0.1)
    lines = {"RNN": [1.0, np.nan, 1 / 3], "toe": torch.tensor([0.0, 2.0])}
    player = show(walk, chart=lines, chart_label="speed (m/s)", chart_log=True)
    sent = player.payload["chart"]
    assert (sent["label"], sent["log"]) == ("speed (m/s)", True)
    assert sent["lines"][0] == {
        "name": "RNN", "color": palette.color("RNN"), "values": [1.0, None, 0.3333]
    }  # fmt: skip
    assert sent["lines"][1]["values"] == [None, 2.0]
    assert "chart" not in show(walk).payload
    player.close()


def test_lines_named_as_the_motions_belong_to_them():
    walks = [gaits.make(seconds=0.1)] * 2
    named = {"labels": ["a", "b"], "colors": ["acLSTM", "RNN"], "choose": "start"}
    sent = show(walks, **named, chart={"b": [2.0], "a": [1.0]}).payload["chart"]
    assert sent["picks"] and [line["values"] for line in sent["lines"]] == [[1.0], [2.0]]
    assert [line["color"] for line in sent["lines"]] == [
        palette.color(n) for n in ("acLSTM", "RNN")
    ]
    for lines in ({"a": [1.0]}, {"a": [1.0], "c": [1.0]}, {"a": [1.0], "b": [1.0], "c": [1.0]}):
        assert "picks" not in show(walks, **named, chart=lines).payload["chart"]
    named.pop("choose")
    assert "picks" not in show(walks, **named, chart={"a": [1.0], "b": [2.0]}).payload["chart"]


@pytest.mark.parametrize(
    ("named", "says"),
    [
        ({"focus": "toes"}, "'body' or 'feet'"),
        ({"chart": [1.0, 2.0]}, "one value a frame"),
        ({"chart": {"toe": [1.0, 2.0, 3.0]}}, r"'toe' has shape \(3,\)"),
        ({"chart": {"toe": [[1.0], [2.0]]}}, r"shape \(2, 1\)"),
        ({"chart": {"toe": ["a", "b"]}}, "not numbers"),
        ({"chart": {"toe": [-1.0, 0.0]}, "chart_log": True}, "above 0"),
    ],
)
def test_what_can_not_be_drawn_is_refused(named, says):
    with pytest.raises(MotionLabError, match=says):
        show(gaits.make(seconds=0.1)[:2], **named)


def test_the_camera_looks_at_the_feet_if_asked():
    assert show(gaits.make(seconds=0.1), focus="feet").payload["focus"] == "feet"
    assert "focus" not in show(gaits.make(seconds=0.1)).payload
