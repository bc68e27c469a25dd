"""How much of what is in the data set "everything": results/everything.json.

    python -m experiments.data.everything_table

Minutes and clips by kind of motion, by source and by split, as loaded at 30 frames a second; and how
much of each kind is free for commercial use. Needs the table of clips only, not the clips.
"""

from __future__ import annotations

import platform
import time
from collections.abc import Iterable

import motionlab
from motionlab.datasets import registry, splits
from motionlab.datasets.registry import Clip

from ..common import record

RESULT = "results/everything.json"
# Kinds of motion, by the actions that the table of clips knows.
KINDS = {
    "locomotion": ("walk", "run", "dash", "side-step", "turn", "mixed"),
    "dance": ("dance",),
    "martial arts": ("martial-arts", "kick", "punch", "slash"),
    "gestures": ("bow", "bye", "byebye", "call", "guide", "respond"),
    "basketball": ("basketball",),
    "jumps": ("jump", "skip"),
    "other": ("box", "crouch", "push", "stand"),
}


def main() -> None:
    begin = time.perf_counter()
    clips = registry.members("everything")
    by_kind: dict[str, list[Clip]] = {kind: [] for kind in KINDS}
    for clip in clips:
        by_kind[kind_of(clip)].append(clip)
    sources = {
        name: amount(clip for clip in clips if clip.source == name)
        | {"licence": source.licence, "commercial": source.commercial}
        for name, source in registry.sources().items()
    }
    result = {
        "command": " ".join(record.command()),
        "code_version": motionlab.__version__,
        "data_hash": splits.digest([(c.source, c.where, c.split) for c in clips]),
        "machine": platform.platform(),
        "seconds": round(time.perf_counter() - begin, 1),
        "all": amount(clips),
        "kinds": {kind: amount(its) for kind, its in by_kind.items()},
        "sources": sources,
    }
    record.write(result, RESULT)


def kind_of(clip: Clip) -> str:
    """Its kind, by how its action begins: "dance-short" is a dance."""
    for kind, actions in KINDS.items():
        if clip.action.startswith(actions):
            return kind
    raise ValueError(f"{clip.name}: no kind has the action {clip.action!r}; add it to KINDS.")


def amount(clips: Iterable[Clip]) -> dict:
    """Clips and minutes, in all and by split, and minutes that are free for commercial use."""
    clips = list(clips)
    minutes = lambda some: sum(clip.seconds for clip in some) / 60
    return {
        "clips": len(clips),
        "minutes": minutes(clips),
        **{f"minutes, {s}": minutes([c for c in clips if c.split == s]) for s in splits.SPLITS},
        "minutes, free for commercial use": minutes([c for c in clips if c.commercial]),
    }


if __name__ == "__main__":
    record.run(main)
