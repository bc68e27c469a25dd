"""What was found of a reference, kept for as long as it lives and does not change.

A thousand clips of one rig ask one reference how their joints' axes lie, and to find that is a good
part of what it costs to bring a short clip to another body.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING
from weakref import WeakKeyDictionary

from torch import Tensor

if TYPE_CHECKING:
    from ..motion import Motion

_kept: WeakKeyDictionary[Motion, dict[tuple, dict[str, Tensor]]] = WeakKeyDictionary()


def kept(
    reference: Motion, what: tuple, find: Callable[[], dict[str, Tensor]]
) -> dict[str, Tensor]:
    """What `find` finds of a reference, or found when its numbers were what they are now.

    what : all that it depends on besides the reference. Tensors made in inference mode leave no trace
    of a change: of these it is found anew.
    """
    numbers = reference.root_positions, reference.rotations
    if any(its.is_inference() for its in numbers):
        return find()
    known = _kept.setdefault(reference, {})
    asked = what, *(its._version for its in numbers)
    if asked not in known:
        known[asked] = find()
    return dict(known[asked])
