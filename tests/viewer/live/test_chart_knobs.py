"""Charts under knobs: in a page and in a kernel the same numbers."""

from __future__ import annotations

import json
import re

import ipywidgets
import pytest

from motionlab.errors import ViewerError
from motionlab.viewer.live.chart_knobs import Bar, chart, chart_knobs

VALUES = {"shift": (0.0, 0.5, 1.0), "on": (False, True)}


def make(shift, on):
    return [Bar("mocap", 3 + shift, 2.5 + shift, 3.5 + shift, 3.0), Bar("a < b", 2, 1.5, 2.5)], (
        f"shift {shift:g}, on {on}"
    )


def settings(**more):
    return {"ends": (1, 5), "unit": "points", "labels": {"shift": "Shift < 1"}, **more}


def test_a_page_holds_every_setting(monkeypatch):
    monkeypatch.setenv("MOTIONLAB_VIEWER", "page")
    page = chart_knobs(make, VALUES, **settings(start={"shift": 0.5}, caption="a < b")).html
    names, made = json.loads(re.search(r"const \[names, made\] = (.*);", page)[1])
    assert names[0] == ["0", "0.5", "1"] and len(made) == 6
    assert made["2,1"][1] == "shift 1, on True" and "mocap 4.00" in made["2,1"][0]
    assert (
        "shift 0.5, on False" in page and "Shift &lt; 1" in page and "<figcaption>a &lt; b" in page
    )
    assert page.count("</script>") == 1


def test_in_a_kernel_it_is_drawn_anew(monkeypatch):
    monkeypatch.delenv("MOTIONLAB_VIEWER", raising=False)
    box = chart_knobs(make, VALUES, **settings())
    drawn, fields, said, needs, *_ = box.children
    assert isinstance(box, ipywidgets.VBox) and "kernel" in needs.value
    assert drawn.value == chart(make(0.0, False)[0], (1, 5), "points")
    fields.children[0].value = 0.3  # any value, not only those of a page
    assert said.value == "shift 0.3, on False" and "mocap 3.30" in drawn.value


def test_a_point_stands_where_its_number_is():
    """From the left end to the right one evenly; what lies outside stands at the end."""
    found = [
        float(re.search(r'<circle cx="([\d.]+)"', chart([Bar("x", v, v, v)], (1, 5), ""))[1])
        for v in (1, 2, 3, 5, 9)
    ]
    assert found[1] - found[0] == pytest.approx((found[3] - found[0]) / 4, abs=0.1)
    assert found[3] == found[4] and found[2] == pytest.approx((found[0] + found[3]) / 2, abs=0.1)
    assert "<path" not in chart([Bar("x", 1, 1, 1)], (1, 5), "")


def test_what_makes_no_chart_is_refused(monkeypatch):
    monkeypatch.setenv("MOTIONLAB_VIEWER", "page")
    with pytest.raises(ViewerError, match="two or more numbers in rising order"):
        chart_knobs(make, {"shift": (1.0,)}, **settings())
    with pytest.raises(ViewerError, match="61 settings are too many"):
        chart_knobs(make, {"shift": tuple(range(61))}, **settings())
