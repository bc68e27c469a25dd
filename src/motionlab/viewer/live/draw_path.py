"""Draw a path with mouse or finger, and somebody walks along it.

viewer.draw_path(model, motionlab.design)
"""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from typing import Any

from torch import nn

from . import draw_path_kernel, draw_path_page


def draw_path(
    model: nn.Module,
    design: Callable | None = None,
    *,
    solved: Sequence[Sequence] = (),
    speed: float = 1.2,
    color: str = "RNN",
    caption: str | None = None,
    height: int = 380,
    refiner: nn.Module | None = None,
) -> Any:
    """A board on which a line is drawn, and a character who walks along it.

    In a running kernel `design` searches for the walk, and each window is shown when it is solved.
    In a built page the network is led along by guided sampling, which keeps less well to the line. How
    far from it the hips were is printed beside, as root mean square in cm after the first second. What
    walked can be saved as .bvh or .glb.

    Parameters
    ----------
    model : an `LstmGmm` on `JointAngles`, as `motionlab.load` gives it.
    design : `motionlab.design`, or what takes the same: points, speed, start, model, seed= and watch=.
        Needed in a kernel.
    solved : paths that were solved beforehand, (name, points, motion) or (name, points, motion, record)
        each, motion and record as `motionlab.design` gives them. The reader picks one, sees it walked,
        and lets it be walked anew beside it, at the record's speed and from its start. Points are
        (n, 2) metres or a `paths.Path`.
    speed : m/s at first.
    color : a method's name or a colour, of who walks.
    caption : a text below the figure.
    height : of the moving picture, pixels.
    refiner : a `Refiner` of what the model makes. Who walks is refined unless the reader ticks that off;
        in a kernel `design` gets it as refiner=.

    Raises
    ------
    ViewerError : a model that can't be led, a refiner of other features, one without starts, solved paths that are none or are not
        at the model's rate, or no design in a kernel.
    """
    if os.environ.get("MOTIONLAB_VIEWER") == "page":
        return draw_path_page.page_figure(model, solved, speed, color, caption, height, refiner)
    return draw_path_kernel.widget(model, design, solved, speed, color, caption, height, refiner)
