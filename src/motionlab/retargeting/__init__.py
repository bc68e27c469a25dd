"""Motion brought to another body: whose joint is which, how rigs draw their axes, the motion itself."""

from .retarget import retarget

__all__ = ["retarget"]
