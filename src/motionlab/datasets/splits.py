"""Which clips are for training, which for choosing a model, which for judging it.

By clip, once for all sources, and the same on every machine: the order within a group of like clips
is that of a hash of their names. What was performed together, such as the two partners of a dance
or two cuts that share frames, stays together. A take longer than 30 s is cut into parts, so that
each split gets some of it. The result is committed as a column of clips.tsv; mirrored and resampled
copies follow their clip.
"""

from __future__ import annotations

import hashlib
import math
from collections import defaultdict
from collections.abc import Iterable, Sequence
from itertools import pairwise, permutations

from ..errors import DataError

SPLITS = ("train", "val", "test")
# A group of like clips needs this many performances to give one to each split.
SMALLEST = len(SPLITS)
LONG = 30.0  # seconds; a take that is longer can be split by time
GAP = 2.0  # seconds between parts of different splits, so that none begins where another ends
_STRETCH = 60.0  # seconds, about; each stretch of a take gives a part to each split


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


def _rank(key: tuple[str, ...]) -> str:
    return hashlib.sha256("/".join(key).encode()).hexdigest()


def by_time(frames: int, fps: float, name: str) -> list[tuple[int, int, str]]:
    """Parts of one long take, about 80 % train, 10 % val, 10 % test of what the gaps leave.

    Parameters
    ----------
    frames, fps : how long the take is.
    name : of the take; its hash decides in which order the splits come, so that of many takes not
        all ends are for testing.

    Each minute or so gives a part to each split. Every second one is in the reverse order, so that
    parts of one split meet there and need no gap: they become one. Parts of different splits are 2 s
    apart.

    Returns
    -------
    (start, stop, split) of each part, in frames, by time.

    Raises
    ------
    DataError : the take is not longer than 30 s.
    """
    if frames <= LONG * fps:
        raise DataError(
            f"{name}: {frames / fps:.1f} s are too short to be split by time; bring more than "
            f"{LONG:.0f} s, or at least {SMALLEST} takes."
        )
    gap = math.ceil(GAP * fps)
    stretches = max(1, round(frames / fps / _STRETCH))
    orders = list(permutations(SPLITS))
    order = orders[int(_rank((name,)), 16) % len(orders)]
    parts: list[tuple[int, int, str]] = []
    for i, (start, end) in enumerate(
        pairwise(frames * i // stretches for i in range(stretches + 1))
    ):
        free = end - start - (len(SPLITS) - 1) * gap
        lengths = dict.fromkeys(("val", "test"), round(free / 10))
        lengths["train"] = free - sum(lengths.values())
        for split in order[::-1] if i % 2 else order:
            stop = start + lengths[split]
            if parts and parts[-1][2] == split:
                start = parts.pop()[0]
            parts.append((start, stop, split))
            start = stop + gap
    return parts


def digest(rows: Iterable[tuple[str, str, str]]) -> str:
    """Hash of (source, path, split) rows, to be put beside every result that depends on them."""
    lines = sorted("\t".join(row) for row in rows)
    return hashlib.sha256("\n".join(lines).encode()).hexdigest()
