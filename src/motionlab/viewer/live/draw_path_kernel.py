"""A path drawn in a running kernel, which searches for the walk: the player shows each window as it comes.

The search runs in a thread of its own, so that the kernel hears when somebody presses stop.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Sequence
from typing import Any

import anywidget
import numpy as np
import traitlets
from torch import nn

from ...errors import MotionLabError, ViewerError
from ...motion import Motion
from ..pictures.palette import check_color
from .draw_path_settings import check_model, content_of, sampled
from .player import STATIC, Track, bundle_path, floor_height, payload

Design = Callable[..., tuple[Motion, dict]]


class PathWidget(anywidget.AnyWidget):
    """A board to draw on, and who walks along what is drawn; web/src/drawing/ is the other side.

    The page sends {do: "walk", id, points, speed, start, seed, refined} and {do: "stop"}. It is told, with
    the same id: {frames, share} after each window, {whole, error, notes, finished} at the end, or {failed}.
    """

    _esm = STATIC / "widget.js"

    kind = traitlets.Unicode("path").tag(sync=True)
    content = traitlets.Dict().tag(sync=True)
    caption = traitlets.Unicode("").tag(sync=True)

    def __init__(
        self,
        model: nn.Module,
        design: Design,
        color: str,
        refiner: nn.Module | None = None,
        **traits: Any,
    ):
        self._stopped = threading.Event()
        bundle_path()
        super().__init__(**traits)
        self._model, self._design, self._color = model, design, color
        self._refiner = refiner
        self._thread: threading.Thread | None = None
        self.on_msg(lambda _widget, message, _buffers: self._asked(message))

    def _asked(self, message: dict[str, Any]) -> None:
        if message.get("do") == "stop":
            self._stopped.set()
        elif message.get("do") == "walk":
            # another line was drawn, or another page of the notebook wants to walk: it is its turn
            self._stopped.set()
            self.join()
            self._stopped.clear()
            self._thread = threading.Thread(target=self._walk, args=(message,), daemon=True)
            self._thread.start()

    def join(self) -> None:
        """Wait until the search has ended."""
        if self._thread is not None:
            self._thread.join()

    def close(self) -> None:
        """The widget is gone: nobody waits for the rest."""
        self._stopped.set()
        super().close()

    def _walk(self, wish: dict[str, Any]) -> None:
        tell = lambda **said: self.send({"id": wish.get("id"), **said})

        def watch(frames: Motion, share: float) -> None:
            tell(frames=self._shown(frames), share=float(share))
            if self._stopped.is_set():
                raise KeyboardInterrupt  # design gives what it has, and says so

        try:
            start = int(wish.get("start", -1))
            motion, record = self._design(
                np.asarray(wish["points"], dtype=np.float64),
                wish["speed"],
                None if start < 0 else str(start),
                self._model,
                seed=int(wish.get("seed", 0)),
                watch=watch,
                **({"refiner": self._refiner} if wish.get("refined") else {}),
            )
        except KeyboardInterrupt:
            tell(failed="Stopped before there was anything to see.")
        except MotionLabError as error:
            tell(failed=str(error))
        except Exception as error:  # the page must not wait for ever; the kernel's log has the rest
            tell(failed=f"The search ended with {type(error).__name__}: {error}")
            raise
        else:
            error = record["error (cm)"]
            found = {"curve": error["rms"], "drawn": error["rms to the drawn line"]}
            told = {"notes": list(record["notes"]), "finished": bool(record["finished"])}
            tell(whole=self._shown(motion), error=found, **told)

    def _shown(self, motion: Motion) -> dict[str, Any]:
        points = motion.positions().detach().cpu()
        feet, name = motion.contacts, f"walk along a line, {motion.name}".rstrip(", ")
        return payload(
            [Track(points, motion.skeleton, "", self._color, feet, name, motion)], motion.fps
        )


def widget(
    model: nn.Module,
    design: Design | None,
    solved: Sequence[Sequence],
    speed: float,
    color: str,
    caption: str | None,
    height: int,
    refiner: nn.Module | None = None,
) -> PathWidget:
    """What `draw_path` is in a running kernel. Parameters as there."""
    check_model(model)
    if not callable(design):
        raise ViewerError(
            "draw_path: in a kernel a walk is searched for; give what does it, as in "
            "draw_path(model, motionlab.design)."
        )
    color = check_color(color)
    floor = float(np.median([floor_height(track) for track in sampled(model, color)]))
    content = content_of(model, solved, speed, height, floor, refiner)
    return PathWidget(model, design, color, refiner, content=content, caption=caption or "")
