"""A steered character in a running kernel: `LiveControl` makes a window whenever the page needs one.

The page asks, and says with it what is wished; so nothing runs ahead of it, a tab that nobody sees costs
nothing, and what is asked counts from the next window on.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import anywidget
import torch
import traitlets
from torch import nn

from ...errors import MotionLabError, ViewerError
from ...kinematics import heading
from ...metrics import broken
from ...motion import Motion, concatenate
from ...paths import Path
from .dream_settings import Control, name_of, sampled_tracks
from .network_figure import live_of
from .network_weights import WeightsScript, encoding_of
from .player import STATIC, bundle_path
from .steer_page import KEPT
from .steer_settings import Look, cast_of, check_model, controls_of, start_of

TERMS = {  # of solvers.live_control's gradient, by name
    "prior": "the network's own likelihood",
    "speed": "speed",
    "direction": "direction",
    "contact": "toes in contact stay",
    "resting": "slow feet rest",
    "poses": "joints keep their range",
}
GRADIENT = Control("gradient", "A gradient, too", "The paper's way: from the best future down the "
                   "slope of all terms below; slower", 0, 1, 1, 0)  # fmt: skip
FEWEST = 1e-3  # temperature
NEAR = 1.0  # metres from a line's beginning from where on it is followed, as web/src/steering/steered.js has it


class SteerWidget(anywidget.AnyWidget):
    """Characters who are steered by hand; web/src/steering/ is the other side.

    The page sends {do: "begin" | "go", run, settings, wish: {speed, direction or line}}. It is told {run,
    characters: [{rows, places, asked, done, late, record}], seconds} for each window, or {run, failed}.
    """

    _esm = STATIC / "widget.js"

    kind = traitlets.Unicode("steer").tag(sync=True)
    content = traitlets.Dict().tag(sync=True)
    caption = traitlets.Unicode("").tag(sync=True)

    def __init__(
        self,
        model: nn.Module,
        control: Callable,
        refiner: nn.Module | None,
        beside: Sequence[int],
        **traits: Any,
    ):
        bundle_path()
        super().__init__(**traits)
        self._made = model, control, refiner, tuple(beside)
        self._live: list[Any] = []
        self._lines: list[Any] = []  # that each of them goes along, if one
        self._wishes: list[Any] = []  # of the page, that each of them heard last
        self.on_msg(lambda _widget, message, _buffers: self._asked(message))

    @property
    def live(self) -> list[Any]:
        """The controls of the characters, to look into or to ask by hand, as for a `target`: that counts
        until keys, a stick or a slider of the page ask for something else."""
        return self._live

    def motion(self, who: int = 0) -> Motion:
        """What a character did, as far as it is seen; `write_bvh` and `write_gltf` save it."""
        return self._live[who].motion()

    def _asked(self, message: dict[str, Any]) -> None:
        tell = lambda **said: self.send({"run": message.get("run"), **said})
        try:
            if message.get("do") == "begin" or not self._live:
                self._begin(message["settings"])
            begin = time.perf_counter()
            characters = self._window(message)
            tell(characters=characters, seconds=time.perf_counter() - begin)
        except MotionLabError as error:
            tell(failed=str(error))
        except Exception as error:  # the page must not wait for ever; the kernel's log has the rest
            tell(failed=f"The kernel ended with {type(error).__name__}: {error}")
            raise

    def _begin(self, settings: dict[str, Any]) -> None:
        """Characters at their start, side by side."""
        model, control, refiner, beside = self._made
        several = beside or (int(settings["futures"]),)
        self._live = [
            control(
                model, int(settings["start"]), futures=futures, seed=int(settings["seed"]),
                refiner=refiner, lock=bool(settings.get("lock")), places=[[-1.5 * k, 0.0, 0.0]],
            )
            for k, futures in enumerate(several)
        ]  # fmt: skip
        self._lines, self._wishes = [None] * len(several), [None] * len(several)

    def _window(self, message: dict[str, Any]) -> list[dict[str, Any]]:
        """The next frames of each of them."""
        settings, wish = message["settings"], message.get("wish") or {}
        made = []
        for k, live in enumerate(self._live):
            live.how = self._how(live, settings, k)
            if wish:
                self._wish(live, wish, k)
            (left,) = live.show(bool(settings.get("refined", 1)), bool(settings.get("lock")))
            motion = None
            while motion is None:  # a lock gives nothing at first
                (motion,) = live.go_on()
            made.append(_shown(live, concatenate([left, motion]) if left else motion))
        return made

    def _wish(self, live: Any, wish: dict[str, Any], k: int) -> None:
        """What is asked of a character: a way, or a line, to whose beginning he goes first."""
        line, heard = wish.get("line"), self._wishes[k]
        self._wishes[k] = wish
        if line is None and wish != heard:
            live.steer(wish.get("speed"), wish.get("direction"))
        elif line is None:  # what a cell asked meanwhile stays
            return
        elif line == self._lines[k]:  # who goes along it goes on
            live.steer(wish.get("speed"))
        else:
            path = Path.through(line)  # raises WayError
            x, z = (path.places[0].double() - live.going.place[0, :2]).tolist()
            if math.hypot(x, z) > NEAR:  # an arc from farther away is a detour
                live.steer(wish.get("speed"), math.atan2(x, z))
                line = None
            else:
                live.steer(wish.get("speed"), path=path)
        self._lines[k] = line

    def _how(self, live: Any, settings: dict[str, Any], k: int) -> Any:
        """What a control does, by what the page's sliders say now."""
        beside = self._made[3]
        chance = live.how.chance._replace(
            temperature=max(float(settings["temperature"]), FEWEST),
            memory=float(settings["memory"]),
        )
        weights = {
            name: 0.0 for name in _terms_of(live.model) if not settings.get(f"term {name}", 1)
        }
        return replace(
            live.how, chance=chance, weights=weights,
            futures=beside[k] if beside else int(settings["futures"]),
            way="gradient" if settings.get("gradient") else "futures",
        )  # fmt: skip


def _terms_of(model: nn.Module) -> list[str]:
    """Terms of the energy that a model's features know of."""
    lacking = set() if "contacts" in model.encoding.slices else {"contact"}
    if not broken.knows(model.encoding):
        lacking.add("poses")
    return [name for name in TERMS if name not in lacking]


def _shown(live: Any, motion: Motion) -> dict[str, Any]:
    """Frames as features, each with the place it stands at: what the page draws and saves."""
    rows = live.model.encoding.encode(motion)
    yaw = heading(motion.rotations[:, 0].double())
    places = torch.cat([motion.root_positions[:, [0, 2]].double(), yaw[:, None]], 1)
    record, going = live.record(), live.going
    return {
        "rows": rows.double().numpy().round(5).tolist(),
        "places": places.numpy().round(5).tolist(),
        "asked": _asked(live),
        "done": [float(going.velocity[0].norm()), float(going.bearing()[0])],
        "late": live.behind.late,
        "record": {"notes": record["notes"]},
    }


def _asked(live: Any) -> dict[str, float]:
    """Speed and way that are asked now; of who goes along a line or to a place, where that leads from here."""
    aim, going = live.aim, live.going
    if int(aim.which[0]) < 0 and not aim.target[0].isfinite().all():
        return {"speed": float(aim.speed[0]), "direction": float(aim.direction[0])}
    speed, _, off = aim.wanted(going)
    way = float(going.bearing()[0]) + float(off[0])
    return {"speed": float(speed[0]), "direction": math.remainder(way, 2 * math.pi)}


def widget(
    model: nn.Module,
    control: Callable | None,
    refiner: nn.Module | None,
    beside: Sequence[int],
    look: Look,
    caption: str | None,
) -> SteerWidget:
    """What `steer` is in a running kernel. Parameters as there."""
    check_model(model)
    if not callable(control):
        raise ViewerError(
            "steer: in a kernel somebody must make the frames; give who does, as in "
            "steer(model, motionlab.solvers.live_control.LiveControl)."
        )
    controls = [
        *(each for each in controls_of(model, look, refiner) if each["name"] not in ("help", "push")),
        vars(GRADIENT),
        *(vars(Control(f"term {name}", f"Term: {TERMS[name]}", "Whether the gradient minds it",
                       0, 1, 1, 1)) for name in _terms_of(model)),
    ]  # fmt: skip
    tracks = sampled_tracks(model, model.starts[[start_of(model)]], 2, seed=0, color=look.color)
    nothing = WeightsScript("", "")
    network = {
        "name": name_of(model),
        "live": live_of(model, nothing, tracks, look.color),
        "encoding": encoding_of(model.encoding),
        "fps": model.fps,
        "starts": list(model.start_names),
        "controls": controls,
        "facts": [],
    }
    content = {"networks": [network], "beside": cast_of(beside, look.color), "height": look.height,
               "kept": KEPT, "restarts": ["start", "seed"]}  # fmt: skip
    return SteerWidget(model, control, refiner, beside, content=content, caption=caption or "")
