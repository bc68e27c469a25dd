"""motionlab: recurrent human motion synthesis, rebuilt on real motion capture."""

from .errors import MotionLabError
from .io.bvh import read_bvh, write_bvh
from .io.gltf import write_gltf
from .kinematics import forward_kinematics
from .motion import Motion, concatenate
from .skeleton import Skeleton
from .version import __version__ as __version__

__all__ = [
    "Motion",
    "MotionLabError",
    "Skeleton",
    "concatenate",
    "contacts",
    "datasets",
    "encodings",
    "forward_kinematics",
    "ik",
    "load",
    "metrics",
    "read_bvh",
    "show",
    "viewer",
    "write_bvh",
    "write_gltf",
]


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})  # tab completion finds what is not imported yet


def __getattr__(name: str):
    # Imported when first used: reading a clip needs none of them.
    if name in ("contacts", "datasets", "encodings", "ik", "metrics", "viewer"):
        import importlib

        return importlib.import_module(f".{name}", __name__)
    if name == "show":
        from .viewer import show

        return show
    if name == "load":
        from .weights import load

        return load
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
