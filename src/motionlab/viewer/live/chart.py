"""Lines of one value a frame below a player, with a cursor that follows it; web/src/chart.js draws them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ...errors import ViewerError
from ..pictures import palette

DIGITS = 4  # significant ones that are sent


def chart_of(
    label: str | None, lines: Mapping[str, Sequence[float]] | None, frames: int, log: bool
) -> dict[str, Any] | None:
    """What the player reads of `show`'s chart: names, colours and values, None where there is none.

    Raises
    ------
    ViewerError : no lines, or lines of something else than at most `frames` numbers, some of them finite.
    """
    if lines is None:
        return None
    if not isinstance(lines, Mapping) or not lines:
        raise ViewerError(
            "show: chart is {name: values}, one value a frame, such as {'left toe': heights}."
        )
    sent = []
    for index, (name, values) in enumerate(lines.items()):
        try:
            row = np.asarray(values, dtype=float)
        except (TypeError, ValueError, RuntimeError) as error:
            raise ViewerError(f"show: chart's {name!r} is not numbers: {error}.") from error
        drawn = np.isfinite(row) & (row > 0 if log else True)
        if row.ndim != 1 or not 0 < len(row) <= frames or not drawn.any():
            raise ViewerError(
                f"show: chart's {name!r} has shape {row.shape}, the motion {frames} frames; give one "
                f"value a frame, some of them {'above 0' if log else 'finite'}."
            )
        said = [float(f"{v:.{DIGITS}g}") if ok else None for v, ok in zip(row, drawn, strict=True)]
        sent.append({"name": str(name), "color": palette.color(name, index), "values": said})
    return {"label": label or "", "log": log, "lines": sent}
