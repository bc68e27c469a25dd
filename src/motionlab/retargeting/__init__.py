"""Motion brought to another body: how two rigs draw their axes, and the motion itself."""

from .onto_rig import onto_rig
from .retarget import retarget

__all__ = ["onto_rig", "retarget"]
