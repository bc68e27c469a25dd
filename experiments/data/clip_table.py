"""Make src/motionlab/datasets/clips.tsv, the table of all clips, from a manifest and the files.

    MOTIONLAB_DATA=folder python -m experiments.data.clip_table

The folder holds MANIFEST.tsv (source, path, sha256, bytes, url) and one zip a source. Everything
that is known about single clips is decided here: true frame rates, frames to leave out, what a
clip shows, which clips belong to one performance, and the splits. Which of them are locomotion
stands in locomotion.tsv.
"""

from __future__ import annotations

import csv
import os
import re
import sys
import zipfile
from collections import Counter, defaultdict
from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import torch
from tqdm import tqdm

from motionlab import Motion
from motionlab.datasets import loader, registry, splits
from motionlab.datasets.registry import Clip, File, clip_name, sources

TABLE = Path(__file__).parents[2] / "src/motionlab/datasets/clips.tsv"

# What the clips of `accad` show: the first word that the name contains decides. Kept coarse, so
# that every action has clips to hold out.
ACCAD = {
    "box": r"Box",
    "crouch": r"Crouch|Crawl|Lie",
    "skip": r"Skip",
    "jump": r"Hop|Leap|Jump",
    "side-step": r"SideStep",
    "walk-back": r"WalkBack",
    "run-back": r"RunBack",
    "walk-turn": r"WalkT(oT)?[ur]",  # WalkTurn, WalkToTurn, WalkTrun
    "run-turn": r"RunTurn",
    "run": r"Run",
    "walk": r"Walk",
    "stand": r"Stand|Sway|SwingArms|LookAround",
}
# Of the takes of `o3de-motionmatching`, likewise.
O3DE = {
    "crouch": r"Crouch",
    "jump": r"Jump",
    "push": r"Push",
    "turn": r"TurnOnSpot",
    "run-turn": r"(Run|Jog)PivotTurn",
    "walk-turn": r"Walk\w*Turn",
    "run": r"Run|Jog",
    "walk": r"Walk",
    "mixed": r"Acceleration|Circles|FreeRoaming|MixedLocomotion|OutofRange|Snake",
}
# What is used of takes, in seconds; all of those that are not listed. Left out are standing and
# waiting at the beginning and the end, hands at the head (the markers are put right), a leap, and
# the end of Jumps1, where the floor lies 20 to 30 cm too low.
LONG = ("o3de-motionmatching", "virvig-jl")
USED = {
    "Acceleration1": [(0, 49.5)],
    "FreeRoaming2": [(0, 119)],
    "Jog1": [(0, 64)],
    "JogPivotTurn1": [(0, 37)],
    "Jumps1": [(0, 36)],
    "OutofRange1": [(0, 31)],
    "Run1": [(0, 45.5)],
    "RunPivotTurn1": [(0, 34.5)],
    "Snake1": [(2.5, 89.5)],
    "TurnOnSpot1": [(0, 66.5), (70, 84)],
    "Walk1": [(0, 83.5)],
    "Walk2": [(0, 87)],
    "WalkStopTurn1": [(0, 67.5)],
    "WalkStopTurnPivot1": [(0, 58)],
    "WalkTurns1": [(0, 32), (51, 91.5)],
    "JL_mm_run": [(1.5, 84)],
}
# Of the clips of `cmu-amc`; what is not listed is "walk".
AMC = {
    "run": "02_03 09_01 09_02 09_03 09_04 09_05 09_06 09_07 09_08 09_09 09_11 127_03 127_04 127_06 "
    "127_07 127_08 127_13 127_14 127_16 127_17 127_18 127_19 127_20 16_08 16_35 16_36 16_45 16_46 "
    "16_55 16_56 16_57 35_17",
    "run-turn": "127_09 127_10 127_11 127_12 127_15 16_37 16_38 16_39 16_40 16_41 16_42 16_43 16_44 "
    "16_48 16_49 16_50 16_51 16_52 16_53 16_54",
    "walk-turn": "16_11 16_12 16_13 16_14 16_17 16_18 16_19 16_20 16_23 16_24 16_25 16_26 16_27 "
    "16_28 16_29 16_30",
    "crouch": "127_05 17_03",
    "jump": "49_04 49_05",
}
GLITCHES = {"16_15": 2, "16_23": 3, "16_28": 6}  # frames in front in which an arm jumps
CMU = {"02_01": "walk", "05_01": "walk", "06_01": "walk", "05": "dance", "06": "basketball"}


def fps(source: str, path: str) -> int:
    if source.startswith("bandai") or source == "accad":
        return 30
    return 60 if source in LONG or "/salsa/" in path else 120


def skip(source: str, path: str) -> int:
    """Frames in front that are calibration."""
    if source == "aclstm-cmu":
        return 8  # the T-pose, and what a smoothing filter made of its neighbours
    if source == "o3de-motionmatching":
        return 1  # the T-pose
    if source == "cmu-amc":
        return GLITCHES.get(Path(path).stem, 0)
    return int(source == "cmu" and not path.endswith("02_01.bvh"))


def kind(source: str, path: str) -> tuple[str, str]:
    """Action and style."""
    stem, folder = Path(path).stem, Path(path).parent.name
    if source.startswith("bandai"):
        return tuple(re.fullmatch(r"dataset-\d_([a-z-]+)_([a-z-]+)_\d+", stem).groups())
    if source == "aclstm-cmu":
        return ("martial-arts" if folder == "martial" else "dance"), folder
    if source == "cmu":
        action = CMU.get(stem) or CMU[stem[:2]]
        return action, {"dance": "modern"}.get(action, "normal")
    if source == "cmu-amc":
        return next(
            (action for action, its in AMC.items() if stem in its.split()), "walk"
        ), "normal"
    if source == "cmu-131":
        return "dance", "pop"
    if source == "virvig-jl":
        return ("mixed" if stem == "JL_mm_run" else "stand"), "normal"
    actions = O3DE if source == "o3de-motionmatching" else ACCAD
    return next(action for action, words in actions.items() if re.search(words, stem)), "normal"


def performances(motions: dict[tuple[str, str], Motion]) -> dict:
    """Clips to the first clip of the same performance, for clips that have company.

    The two partners of a salsa were recorded together; some Bandai clips are cut from the same
    take, which shows in poses that they share to the last digit.
    """
    first: dict = {}
    for source, path in motions:
        number = Path(path).stem
        if "/salsa/" in path and int(number) > 15:
            partner = path.replace(f"{number}.bvh", f"{int(number) - 15:02d}.bvh")
            first[source, path] = (source, partner)

    def earliest(key: tuple[str, str]) -> tuple[str, str]:
        while key in first:
            key = first[key]
        return key

    owners: dict[bytes, tuple] = {}
    shared: Counter = Counter()
    for key in motions:
        if not key[0].startswith("bandai"):
            continue
        poses = np.round(motions[key].rotations.flatten(1).numpy() * 1000).astype(np.int16)
        for pose in {pose.tobytes() for pose in poses}:
            if pose in owners:
                shared[owners[pose], key] += 1
            owners.setdefault(pose, key)
    for (a, b), frames in sorted(shared.items()):
        if frames >= 3:  # one shared pose is the rest pose
            print(f"{frames} frames in common: {Path(a[1]).stem} and {Path(b[1]).stem}")
            a, b = earliest(a), earliest(b)
            if a != b:
                first[max(a, b)] = min(a, b)
    return {key: earliest(key) for key in motions if key in first}


def stretches(clip: Clip) -> list[tuple[int, int]]:
    """First frame and the one after the last of what is used of a file."""
    seconds = USED.get(clip_name(clip.path), [(0, clip.seconds)])
    return [
        (clip.skip + round(start * clip.fps), clip.skip + round(stop * clip.fps))
        for start, stop in seconds
    ]


def parts(clip: Clip) -> list[Clip]:
    """Long takes in parts, each with its split; other clips as they are."""
    if clip.source not in LONG:
        return [clip]
    found = []
    for start, stop in stretches(clip):
        name = f"{clip_name(clip.path)} {start}"
        long = stop - start > splits.LONG * clip.fps
        its = splits.by_time(stop - start, clip.fps, name) if long else [(0, stop - start, "train")]
        found += [
            replace(clip, skip=start + first, frames=last - first, split=split)
            for first, last, split in its
        ]
    return found


def read(folder: Path, source: str, rows: list[dict]) -> dict[Clip, Motion]:
    """All clips of a source that the manifest lists."""
    motions = {}
    with zipfile.ZipFile(folder / f"{source}.zip") as archive:
        for row in tqdm(rows, desc=source):
            path = row["path"]
            assert row["url"] == sources()[source].address(path), row["url"]
            if path.endswith(".asf"):
                file = File(source, path, row["sha256"], int(row["bytes"]))
                assert file in sources()[source].besides.values(), file
                continue
            clip = Clip(
                source, path, row["sha256"], int(row["bytes"]), sys.maxsize // 2, fps(source, path),
                skip(source, path), *kind(source, path), "", "",
            )  # fmt: skip
            data = [archive.read(file.path) for file in (clip, *clip.besides)]
            motion = loader.parse(clip, *data)
            motions[replace(clip, frames=len(motion))] = motion
    return motions


def main() -> None:
    torch.set_num_threads(1)  # clips are too small to share
    folder = Path(os.environ["MOTIONLAB_DATA"])
    with open(folder / "MANIFEST.tsv", encoding="utf-8", newline="") as file:
        manifest = sorted(
            csv.DictReader(file, delimiter="\t"), key=lambda r: (r["source"], r["path"])
        )
    by_source = defaultdict(list)
    for row in manifest:
        by_source[row["source"]].append(row)
    motions = {}
    for source, rows in by_source.items():
        motions |= read(folder, source, rows)
    first = performances({(clip.source, clip.path): motion for clip, motion in motions.items()})
    table = [
        replace(part, performance=clip_name(first[part.source, part.path][1]))
        if (part.source, part.path) in first
        else part
        for clip in motions
        for part in parts(clip)
    ]
    whole = [clip for clip in table if not clip.split]
    keys = [(c.source, c.performance or c.name, c.action, c.style) for c in whole]
    split_of = dict(zip(whole, splits.assign(keys), strict=True))
    table = [replace(clip, split=split_of.get(clip, clip.split)) for clip in table]
    columns = [field.name for field in fields(Clip) if field.name != "part"]
    with open(TABLE, "w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, delimiter="\t", lineterminator="\n")
        writer.writerow(columns)
        writer.writerows([getattr(clip, name) for name in columns] for clip in table)
    registry.clips.cache_clear()
    print(f"{len(table)} clips, {TABLE.stat().st_size / 1000:.0f} kB")
    print("splits", splits.digest((c.source, c.where, c.split) for c in registry.clips()))


if __name__ == "__main__":
    main()
