"""A character who is steered while he walks: by keys, by a stick on the screen, by a gamepad.

viewer.steer(model, LiveControl, refiner=refiner)
"""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from typing import Any

from torch import nn

from ..pictures.palette import check_color
from . import steer_kernel, steer_page
from .steer_settings import Look, check_look


def steer(
    model: nn.Module,
    control: Callable | None = None,
    *,
    refiner: nn.Module | None = None,
    others: Sequence[tuple[nn.Module, nn.Module | None]] = (),
    beside: Sequence[int] = (),
    speed: float = 1.2,
    futures: int = 8,
    color: str = "RNN",
    caption: str | None = None,
    height: int = 420,
    at_once: bool = False,
) -> Any:
    """A character who goes where arrow keys, a stick or a gamepad lead him, and what can be seen of how.

    In a built page the network runs in the reader's browser, steered as by `LiveControl`: guided
    samples of the next five frames, of which the best is kept, refined, and its feet locked. In a
    running kernel `control` does it, and the page asks for each window as it needs it. What is asked
    and done stands below the picture, and as arrows on the ground; how late a wish is seen is told
    there. A line can be drawn, and he goes along it. What was done can be saved as .bvh or .glb.

    Keys steer while the picture has the focus, or something below it that has no use for them. Where
    the network knows no contacts, or the skeleton's rest pose does not stand, feet are not locked.

    Parameters
    ----------
    model : an `LstmGmm` on `JointAngles`, as `motionlab.load` gives it.
    control : `solvers.live_control.LiveControl`, or what takes the same. Needed in a kernel.
    refiner : a `Refiner` of what the model makes. What is shown is refined unless that is ticked off.
    others : (model, refiner) of more networks, of which the reader of a page takes one.
    beside : futures (K) of characters who are steered by the same keys, as (1, 16); none: one.
    speed : m/s that the keys ask for at first.
    futures : K at first, 1 to 16.
    color : a method's name or a colour.
    caption : a text below the figure.
    height : of the picture, pixels.
    at_once : load a page's network as soon as it is in sight, and let him walk on until somebody steers;
        else when its reader asks for it. Who saves data or wants little motion is asked in any case.

    Raises
    ------
    ViewerError : a model that can't be steered, a refiner of other features, one without starts, no
        control in a kernel.
    """
    look = Look(speed, futures, height, check_color(color))
    check_look(look, beside)
    if os.environ.get("MOTIONLAB_VIEWER") == "page":
        return steer_page.page_figure([(model, refiner), *others], beside, look, caption, at_once)
    return steer_kernel.widget(model, control, refiner, beside, look, caption)
