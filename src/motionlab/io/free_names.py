"""Names for what files hold, such as other programs can read and such as are not taken."""

from __future__ import annotations

import re
from collections.abc import Sequence


def alike(name: str, other: str) -> bool:
    """Whether programs to which root and Root are one name take them for one."""
    return name.casefold() == other.casefold()


def free_name(names: Sequence[str], name: str) -> str:
    """A name, with Motion behind it if it is one of these, in capitals or not."""
    while any(alike(name, taken) for taken in names):
        name += "Motion"
    return name


def safe_names(names: Sequence[str], *, ascii_only: bool = False) -> list[str]:
    """Names of letters, digits, - and _, others being _; what becomes alike gets a number.

    ascii_only : as identifiers of USD are: A to Z, digits and _ alone, none of these at first.
    """
    safe: list[str] = []
    for name in names:
        if ascii_only:
            word = re.sub(r"^(?=[0-9])", "_", re.sub(r"[^A-Za-z0-9_]", "_", name))
        else:
            word = re.sub(r"[^\w-]", "_", name)
        count, free = 1, word
        while free in safe:
            count, free = count + 1, f"{word}_{count + 1}"
        safe.append(free)
    return safe
