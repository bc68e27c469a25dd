"""What all curves and diagrams of the book share: one style, a few colours, the checks of what is drawn."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence, Sized
from functools import wraps
from numbers import Real
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure

from ...errors import ViewerError
from ...motion import Motion
from . import palette

STYLE = Path(__file__).with_name("style.mplstyle")
# viridis without its ends, which vanish on a black or a white page
SPEED = ListedColormap(plt.get_cmap("viridis")(np.linspace(0.3, 0.92, 128)))
# blue below zero, red above, and the page's own colour at zero
AROUND_ZERO = ListedColormap(
    [(0.30, 0.53, 0.85, abs(x) ** 0.7) if x < 0 else (0.87, 0.36, 0.22, x**0.7)
     for x in np.linspace(-1, 1, 256)]
)  # fmt: skip
DASHES = ("-", "--", ":", "-.")  # of lines that have one colour
SHAPES = ("o", "s", "^", "D", "v", "P")  # of clouds: muted colours alone look alike
MARKED = 40  # values of a line that each get a mark; more would hide the line
DOT = 45  # the least area of a mark, in square points
INK = "#808080"  # as the style's text: 4:1 on white and on black


def styled(draw):
    """Draw in the book's style; the figure is returned, not also shown by pyplot."""

    @wraps(draw)
    def drawn(*args, **kwargs) -> Figure:
        with plt.style.context(STYLE):
            figure = draw(*args, **kwargs)
        plt.close(figure)
        return figure

    return drawn


def check_motion(plot: str, motion: Motion, frames: int = 1) -> None:
    if not isinstance(motion, Motion):
        raise ViewerError(f"{plot}: needs a Motion, not {motion!r}.")
    if len(motion) < frames:
        raise ViewerError(f"{plot}: {motion!r} is too short; it needs {frames} frames or more.")


def check_named(plot: str, named: Sized) -> None:
    if len(named) == 0:
        raise ViewerError(
            f"{plot}: there is nothing to draw; give one name and its values or more."
        )


def check_rate(plot: str, fps: float) -> None:
    if not isinstance(fps, Real) or not 0 < fps < np.inf:
        raise ViewerError(f"{plot}: fps is {fps!r}; it must be a positive number.")


def line_looks(kinds: Sequence[str]) -> list[dict[str, str]]:
    """Colour and dashes of lines in their order: one colour a kind, other dashes for each further line of it.

    kinds : what each line shows, such as the method; where colours run out, dashes tell them apart, too.
    """
    order, drawn, looks = list(dict.fromkeys(kinds)), Counter(), []
    for kind in kinds:
        color = palette.color(kind, order.index(kind))
        looks.append({"color": color, "ls": DASHES[drawn[color] % len(DASHES)]})
        drawn[color] += 1
    return looks
