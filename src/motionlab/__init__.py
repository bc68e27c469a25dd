"""motionlab: recurrent human motion synthesis, rebuilt on real motion capture."""

from importlib import import_module
from typing import TYPE_CHECKING

from .errors import MotionLabError
from .kinematics import forward_kinematics
from .motion import Motion, concatenate
from .skeleton import Skeleton
from .version import __version__ as __version__

if TYPE_CHECKING:
    from .io import read_amc, read_bvh, read_gltf, write_bvh, write_gltf
    from .solvers.design import design
    from .viewer import show
    from .weights import load

__all__ = [
    "Motion",
    "MotionLabError",
    "Skeleton",
    "concatenate",
    "contacts",
    "datasets",
    "design",
    "encodings",
    "forward_kinematics",
    "ik",
    "io",
    "load",
    "metrics",
    "read_amc",
    "read_bvh",
    "read_gltf",
    "show",
    "viewer",
    "write_bvh",
    "write_gltf",
]
# Imported when first used, so that `import motionlab` takes hardly longer than `import torch`.
_MODULES = ("contacts", "datasets", "encodings", "ik", "io", "metrics", "viewer")
_FUNCTIONS = {
    "design": ".solvers.design",
    "load": ".weights",
    "read_amc": ".io",
    "read_bvh": ".io",
    "read_gltf": ".io",
    "show": ".viewer",
    "write_bvh": ".io",
    "write_gltf": ".io",
}


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})  # tab completion finds what is not imported yet


def __getattr__(name: str):
    if name in _MODULES:
        return import_module(f".{name}", __name__)
    if name in _FUNCTIONS:
        return getattr(import_module(_FUNCTIONS[name], __name__), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
