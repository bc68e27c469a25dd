"""Which clips are for training, which for choosing a model, which for judging it.

By clip, once for all sources, and the same on every machine: the order within a group of like clips
is that of a hash of their names. What was performed together, such as the two partners of a dance
or two cuts that share frames, stays together. The result is committed as a column of clips.tsv;
mirrored and resampled copies follow their clip.
"""

from __future__ import annotations

import hashlib
from collections import defaultdict
from collections.abc import Iterable, Sequence

SPLITS = ("train", "val", "test")
# A group of like clips needs this many performances to give one to each split.
SMALLEST = len(SPLITS)


def assign(clips: Sequence[tuple[str, str, str, str]]) -> list[str]:
    """A split for each clip, about 80 % train, 10 % val, 10 % test.

    Parameters
    ----------
    clips : (source, performance, action, style) of each clip. Clips with the same source and
        performance get the same split.

    Clips of one source, action and style form a group. Groups of fewer than three performances are
    pooled, first over styles, then over actions; every group gives at least one performance to val
    and one to test.
    """
    kind = {(source, performance): (action, style) for source, performance, action, style in clips}
    groups: dict[tuple, list[tuple[str, str]]] = defaultdict(list)
    for key, (action, style) in kind.items():
        groups[key[0], action, style].append(key)
    for level in (2, 1):  # pool over styles, then over actions
        pooled: dict[tuple, list[tuple[str, str]]] = defaultdict(list)
        for group, keys in groups.items():
            pooled[group if len(keys) >= SMALLEST else group[:level]] += keys
        groups = pooled
    split = {}
    for keys in groups.values():
        keys = sorted(keys, key=_rank)
        held_out = max(1, round(len(keys) / 10)) if len(keys) >= SMALLEST else 0
        for i, key in enumerate(keys):
            split[key] = "test" if i < held_out else "val" if i < 2 * held_out else "train"
    return [split[source, performance] for source, performance, *_ in clips]


def _rank(key: tuple[str, str]) -> str:
    return hashlib.sha256("/".join(key).encode()).hexdigest()


def digest(rows: Iterable[tuple[str, str, str]]) -> str:
    """Hash of (source, path, split) rows, to be put beside every result that depends on them."""
    lines = sorted("\t".join(row) for row in rows)
    return hashlib.sha256("\n".join(lines).encode()).hexdigest()
