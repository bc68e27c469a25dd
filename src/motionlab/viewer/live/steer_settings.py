"""What both forms of a steered character share: what may be set, and what is known of his body."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

from torch import nn

from ...encodings import JointAngles
from ...errors import SkeletonError, ViewerError
from ...feet.contacts import foot_points, rest_heights
from ...feet.lock_stream import LockStream
from ...metrics import broken
from ...roles import SIDES
from ..pictures.palette import CYCLE
from .dream_settings import CONTROLS, REFINED, Control, check_starts
from .network_weights import check_refiner

COMPARED = CYCLE[:3]  # of characters beside the first
CALMER = 0.6  # of the temperature at which a model ships, as of solvers.live_control
SPEED = Control("speed", "Speed (m/s)", "What the arrow keys ask for; with Shift he runs", 0.4, 3.2,
                0.1, 1.2)  # fmt: skip
DIRECTION = Control("direction", "Direction (°)", "The way that is asked: 0 is away from where the "
                    "view begins, 90 to its left", -180, 180, 5, 0)  # fmt: skip
ONWARD = Control("onward", "Keep going", "Without a key he goes on in the direction above, instead "
                 "of standing", 0, 1, 1, 0)  # fmt: skip
DELAY = Control("delay", "Delay (s)", "So much later is all heard that keys, stick, sliders or lines "
                "ask for, as over a slow line", 0, 1, 0.05, 0)  # fmt: skip
HELP = Control("help", "Help", "Off: nothing is asked of the network, and it wanders", 0, 1, 1, 1)
PUSH = Control("push", "Push", "How strongly each step is pushed to what is asked", 0, 1.5, 0.05, 1)
FUTURES = Control("futures", "Futures (K)", "As many samples of the next five frames, of which the "
                  "best is kept", 1, 16, 1, 8)  # fmt: skip
TERMS = {
    "speed": "speed",
    "direction": "direction",
    "feet": "feet and poses",
}  # of the choice among futures
LOCK = Control("lock", "Lock the feet", "Toes in contact are held where they are; that must be known "
               "ahead, so all is seen a sixth of a second later", 0, 1, 1, 1)  # fmt: skip
_KNOWN = {control.name: control for control in CONTROLS}
TEMPERATURE = replace(_KNOWN["temperature"], min=0.02, max=0.62, step=0.004)


@dataclass(frozen=True)
class Look:
    """How a figure begins: speed m/s, futures, height in pixels, colour."""

    speed: float
    futures: int
    height: int
    color: str


def check_model(model: nn.Module) -> None:
    """Raise ViewerError if a model can't be steered."""
    if type(model).__name__ != "LstmGmm" or not isinstance(model.encoding, JointAngles):
        raise ViewerError(
            "steer: an LstmGmm on JointAngles can be steered, such as lstm-gmm-contacts; this is "
            f"{type(model).__name__}."
        )
    check_starts(model)


def check_look(look: Look, beside: Sequence[int] = ()) -> None:
    """Raise ViewerError if a figure can't begin so."""
    if len(beside) not in (0, 2, 3, 4):
        raise ViewerError(
            f"steer: beside has {len(beside)} characters; it may have 2 to 4, or none."
        )
    counted = [(SPEED, look.speed), *((FUTURES, count) for count in (look.futures, *beside))]
    for control, value in counted:
        if not isinstance(value, int | float) or not control.min <= value <= control.max:
            raise ViewerError(
                f"steer: {control.name} is {value!r}; it goes from {control.min:g} to {control.max:g}."
            )
    if not isinstance(look.height, int) or not 120 <= look.height <= 2000:
        raise ViewerError(f"steer: height is {look.height!r}; give pixels, from 120 to 2000.")


def controls_of(model: nn.Module, look: Look, refiner: nn.Module | None) -> list[dict[str, Any]]:
    """All that may be set, with its first value."""
    if refiner is not None:
        check_refiner(model, refiner)
    sampling = getattr(model, "sampling", {})
    values = {
        "speed": look.speed,
        "futures": look.futures,
        "temperature": round(CALMER * sampling.get("temperature", 1.0), 3),
        "memory": sampling.get("memory", 0.0),
        "start": start_of(model),
    }
    chance = [TEMPERATURE, *(_KNOWN[name] for name in ("memory", "start", "seed"))]
    some = [SPEED, DIRECTION, ONWARD, DELAY, HELP, PUSH, FUTURES, *chance]
    if refiner is not None:
        some.append(REFINED)
    if lock_of(model) is not None:
        some.append(LOCK)
    return [
        asdict(control) | {"value": values.get(control.name, control.value)} for control in some
    ]


def choice_of() -> list[dict[str, Any]]:
    """A box to tick for each term by which a page chooses among futures."""
    return [
        asdict(Control(f"term {name}", f"Mind {said}", "Whether the choice among futures minds it; "
                       "the push goes on by itself", 0, 1, 1, 1))
        for name, said in TERMS.items()
    ]  # fmt: skip


def cast_of(beside: Sequence[int], color: str) -> list[dict[str, Any]]:
    """Characters who are steered together: as the page reads them."""
    colors = [color, *(each for each in COMPARED if each != color)]
    return [
        {"label": f"K = {count}", "color": each, "futures": int(count)}
        for count, each in zip(beside, colors, strict=False)
    ]


def start_of(model: nn.Module) -> int:
    """Who is steered stands at first, if the model has such a start."""
    names = list(model.start_names)
    return names.index("stand") if "stand" in names else 0


def lock_of(model: nn.Module) -> dict[str, Any] | None:
    """What web/src/feet/lock_stream.js must know of legs; None where nobody knows when feet are down."""
    encoding = model.encoding
    toes = [encoding.skeleton.roles.get(f"{side}_toes") for side in SIDES]
    if "contacts" not in encoding.slices or None in toes:
        return None
    try:
        return LockStream(encoding.skeleton, encoding.fps).known
    except SkeletonError:  # its rest pose does not stand, and nobody gives an example
        return None


def body_of(model: nn.Module) -> dict[str, Any]:
    """What web/src/steering/ must know of a body: where feet are, how far joints go, how to lock feet."""
    encoding = model.encoding
    known = None
    if broken.knows(encoding):
        first, low, high = broken.ranges(encoding)
        joints = encoding.slices["pose"].start
        known = {"first": first, "joints": joints, "low": low.tolist(), "high": high.tolist()}
    return {
        "feet": foot_points(encoding.skeleton),
        "low": rest_heights(encoding.skeleton)[[1, 3]].tolist(),
        "ranges": known,
        "lock": lock_of(model),
    }
