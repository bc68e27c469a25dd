"""Look at motion: a player in the notebook and in the page, stills, film strips, videos, scenes."""

from importlib import import_module

from .live.draw_path import draw_path
from .live.dream import dream
from .live.feeding import feeding
from .live.knobs import knobs
from .live.player import Player, bundle_path
from .live.pose_map import pose_map
from .live.show import show
from .live.steer import steer
from .pictures import palette

# Drawn by libraries that take their time to load: imported when first used.
_LATER = {
    **dict.fromkeys(("still", "filmstrip", "stack", "video"), ".pictures.stills"),
    "method_table": ".pictures.method_table",
    "scene": ".live.scene3d",
    "diagram": ".pictures.diagram",
}
__all__ = [
    "Player",
    "bundle_path",
    "diagram",
    "draw_path",
    "dream",
    "feeding",
    "filmstrip",
    "knobs",
    "method_table",
    "palette",
    "plots",
    "pose_map",
    "scene",
    "show",
    "stack",
    "steer",
    "still",
    "video",
]


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})  # tab completion finds what is not imported yet


def __getattr__(name: str):
    if name in _LATER:
        return getattr(import_module(_LATER[name], __name__), name)
    if name == "plots":
        return import_module(".pictures.plots", __name__)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
