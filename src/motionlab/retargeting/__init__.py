"""Motion brought to another body: how two rigs draw their axes, and the motion itself."""

from .retarget import retarget

__all__ = ["retarget"]
