"""Look at motion: a player in the notebook and in the page, stills, film strips, videos, scenes."""

from importlib import import_module

from . import palette
from .dream import dream
from .feeding import feeding
from .knobs import knobs
from .player import Player, bundle_path
from .show import show

# Drawn by libraries that take their time to load: imported when first used.
_STILLS = ("still", "filmstrip", "stack", "video")
__all__ = [
    "Player",
    "bundle_path",
    "dream",
    "feeding",
    "filmstrip",
    "knobs",
    "palette",
    "plots",
    "scene",
    "show",
    "stack",
    "still",
    "video",
]


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})  # tab completion finds what is not imported yet


def __getattr__(name: str):
    if name in _STILLS:
        return getattr(import_module(".stills", __name__), name)
    if name == "plots":
        return import_module(".plots", __name__)
    if name == "scene":
        return import_module(".scene3d", __name__).scene
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
