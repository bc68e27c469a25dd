"""What was made of a model's weights, kept for as long as it lives and they do not change."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar
from weakref import WeakKeyDictionary

from torch import Tensor, nn

Made = TypeVar("Made")

_kept: WeakKeyDictionary[nn.Module, dict[str, tuple[list, list, object]]] = WeakKeyDictionary()


def made_of(model: nn.Module, name: str, make: Callable[[], Made]) -> Made:
    """What `make` makes of a model, or made of it when it had the weights that it has now.

    name : of what is made; a model may have several. Changes through ``weight.data`` leave no trace,
    and weights that were made in inference mode leave none of any change: of these it is made anew.
    """
    slots, versions, made = _kept.setdefault(model, {}).get(name, ([], [], None))
    if not slots or not _same(slots, versions):
        slots, made = _slots(model), make()
        tensors = [thing for _, _, thing in slots if isinstance(thing, Tensor)]
        if any(tensor.is_inference() for tensor in tensors):
            return made
        # an alias of each holds its numbers, so that no others come to lie where they were
        versions = [
            (tensor, tensor.detach(), tensor.data_ptr(), tensor._version) for tensor in tensors
        ]
        _kept[model][name] = slots, versions, made
    return made


def _slots(model: nn.Module) -> list[tuple[dict, str, object]]:
    """Where a model holds its parts and numbers, and what is there: `parameters` takes its time."""
    return [
        (held, name, thing)
        for module in model.modules()
        for held in (module._modules, module._parameters, module._buffers)
        for name, thing in held.items()
    ]


def _same(slots: list, versions: list) -> bool:
    return all(held.get(name) is thing for held, name, thing in slots) and all(
        tensor.data_ptr() == place and tensor._version == version
        for tensor, _, place, version in versions
    )
