"""Options whose value is one of a few words, and the order in which a command's options are shown."""

from __future__ import annotations

import difflib
from collections.abc import Callable, Iterable
from typing import Annotated

from tyro.conf import arg

from ..errors import MotionLabError
from ..io.root_motion import KINDS

WAYS = (*reversed(KINDS), "none")
RootMotion = Annotated[str | None, arg(metavar="|".join(WAYS))]


def chosen(option: str, said: str, known: Iterable[str]) -> str:
    """The one of these words that was said, in capitals or not.

    Raises
    ------
    MotionLabError : it is none of them; the message lists them in their order, the nearest first.
    """
    words = {word.lower(): word for word in known}
    if said.lower() in words:
        return words[said.lower()]
    near = difflib.get_close_matches(said.lower(), words, 1)
    meant = f"did you mean {words[near[0]]}? " if near else ""
    raise MotionLabError(f"{option} {said}: {meant}There are {', '.join(words.values())}.")


def way_of(said: str | None, usual: str | None = None) -> str | None:
    """What becomes of way and heading, as `write_bvh` takes it; usual : where nothing was said."""
    if said is None:
        return usual
    word = chosen("--root-motion", said, WAYS)
    return None if word == "none" else word


def shown_first(*names: str) -> Callable[[type], type]:
    """Of a command's options these come first in its help, whichever of its classes has them."""

    def sort(command: type) -> type:
        fields = command.__dataclass_fields__
        command.__dataclass_fields__ = {
            name: fields[name] for name in (*names, *(n for n in fields if n not in names))
        }
        return command

    return sort
