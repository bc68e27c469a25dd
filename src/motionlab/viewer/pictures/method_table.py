"""The table of all methods, as a chapter shows it: results of `experiments.comparison.table`.

    method_table(found, "walk")                 # how the motion is
    method_table(found, "walk", "forecasts")    # how near to what came
    method_table(found, part="cost")            # what it takes

Rows are methods, the last is real against real motion. A star marks what is told apart from real motion: a
value whose interval does not meet that of the floor.
"""

from __future__ import annotations

import html
import re
from collections.abc import Mapping

import pandas as pd

from ...errors import ViewerError

FLOOR = "real against real"
PARTS = ("motion", "forecasts", "cost")
MISSING = "–"
SMALL = '<small style="white-space: nowrap">'
INTERVAL = re.compile(r"<td>(\S+) (\[.*?\])( \*)?</td>")


class MethodTable:
    """Rows of text: `frame` is the DataFrame, `notes` say what is left out, and why. In a page an interval
    stands small below its value."""

    def __init__(self, frame: pd.DataFrame, notes: list[str]) -> None:
        self.frame, self.notes = frame, notes

    def __repr__(self) -> str:
        return "\n".join([self.frame.to_string(), *self.notes])

    def _repr_html_(self) -> str:
        table = self.frame.to_html(border=1)
        table = INTERVAL.sub(r"<td>\1\3<br>" + SMALL + r"\2</small></td>", table)
        said = "<br>".join(map(html.escape, self.notes))
        return f"{table}<p><small>{said}</small></p>" if said else table


def method_table(found: Mapping, gait: str = "walk", part: str = "motion") -> MethodTable:
    """One part of the table in one gait.

    found : what stands in results/comparison.json. part : "motion", "forecasts" or "cost".

    Raises
    ------
    ViewerError : no such part, or no such gait in the result.
    """
    if part not in PARTS:
        raise ViewerError(f"part is {part!r}; it is one of {', '.join(PARTS)}.")
    if gait not in found["floor"]:
        raise ViewerError(f"gait is {gait!r}; the result has {', '.join(found['floor'])}.")
    if part == "cost":
        frame = pd.DataFrame({title: _cost(row, found) for title, row in found["rows"].items()}).T
        return MethodTable(frame, _notes(found, ("256",)))
    errors = lambda name: name.startswith("error")
    names = [name for name in found["columns"] if errors(name) == (part == "forecasts")]
    floor = found["floor"][gait]
    rows = {
        title: {name: _cell(row["gaits"][gait].get(name), floor.get(name)) for name in names}
        for title, row in found["rows"].items()
    }
    rows[FLOOR] = {name: _cell(floor.get(name), None) for name in names}
    short = {name: name.removeprefix("error, ") for name in names}
    frame = pd.DataFrame(rows).T.rename(columns=short)
    return MethodTable(frame, _notes(found, names))


def _cell(cell: Mapping | None, real: Mapping | None) -> str:
    """A value, its interval, and a star if that does not meet the real one's."""
    if cell is None or cell.get("value") is None:
        return MISSING
    text = _number(cell["value"])
    if cell.get("low") is None or cell.get("high") is None:
        return text
    text += f" [{_number(cell['low'])}, {_number(cell['high'])}]"
    if real is None or real.get("low") is None:
        return text
    apart = cell["low"] > real["high"] or cell["high"] < real["low"]
    return f"{text} *" if apart else text


def _number(value: float) -> str:
    return f"{value:.0f}" if abs(value) >= 100 else f"{value:.3g}"


def _cost(row: Mapping, found: Mapping) -> dict[str, str]:
    ratios = row["frames a second, over the reference's"]
    speed = lambda count: MISSING if ratios.get(count) is None else f"{ratios[count]:.3g}"
    million = lambda value: MISSING if not value else f"{value / 1e6:.3g}"
    reference = found["speed"]["reference"]
    return {
        f"frames a second over those of {reference}, 1 character": speed("1"),
        "256 characters": speed("256"),
        "parameters (million)": million(row["parameters"]),
        "weights (MB)": million(row["bytes"]),
        "frames seen in training (million)": million(row["frames seen"]),
        "trainings": str(len(row["seeds"]) or MISSING),
    }  # fmt: skip


def _notes(found: Mapping, names) -> list[str]:
    """What is left out of the rows, and why; a line for all rows of which the same is said."""
    titles: dict[tuple[str, str], list[str]] = {}
    for title, row in found["rows"].items():
        for name, why in row["left out"].items():
            if name in names:
                titles.setdefault((name, why), []).append(title)
    return [
        f"{'; '.join(rows)}, {name if name != '256' else '256 characters'}: {why}."
        for (name, why), rows in titles.items()
    ]
