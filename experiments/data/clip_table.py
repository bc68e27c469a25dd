"""Make src/motionlab/datasets/clips.tsv, the table of all clips, from a manifest and the files.

    MOTIONLAB_DATA=folder python -m experiments.data.clip_table

The folder holds MANIFEST.tsv (source, path, sha256, bytes, url) and one zip a source. Everything
that is known about single clips is decided here: true frame rates, frames to leave out, what a
clip shows, which clips belong to one performance, and the splits.
"""

from __future__ import annotations

import csv
import os
import re
import zipfile
from collections import Counter, defaultdict
from pathlib import Path

import numpy as np
import torch
from tqdm import tqdm

from motionlab import Motion
from motionlab.datasets import splits
from motionlab.datasets.registry import clip_name, sources
from motionlab.io.bvh import parse_bvh

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
CMU = {"02_01": "walk", "05_01": "walk", "06_01": "walk", "05": "dance", "06": "basketball"}


def fps(source: str, path: str) -> int:
    if source.startswith("bandai") or source == "accad":
        return 30
    return 60 if "/salsa/" in path else 120


def skip(source: str, path: str) -> int:
    """Frames in front that are calibration."""
    if source == "aclstm-cmu":
        return 8  # the T-pose, and what a smoothing filter made of its neighbours
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
    return next(action for action, words in ACCAD.items() if re.search(words, stem)), "normal"


def performances(clips: list[tuple[str, str]], motions: dict[tuple[str, str], Motion]) -> dict:
    """Clips to the first clip of the same performance, for clips that have company.

    The two partners of a salsa were recorded together; some Bandai clips are cut from the same
    take, which shows in poses that they share to the last digit.
    """
    first: dict = {}
    for source, path in clips:
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
    for key in clips:
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
    return {key: earliest(key) for key in clips if key in first}


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
        about = sources()[source]
        with zipfile.ZipFile(folder / f"{source}.zip") as archive:
            for row in tqdm(rows, desc=source):
                path = row["path"]
                assert row["url"] == about.url + path, row["url"]
                motion = parse_bvh(archive.read(path), path, units=about.units, up="y")
                motions[source, path] = motion[skip(source, path) :]
    first = performances(list(motions), motions)
    table = []
    for row in manifest:
        key = source, path = row["source"], row["path"]
        action, style = kind(source, path)
        table.append(
            {
                **{name: row[name] for name in ("source", "path", "sha256", "bytes")},
                "frames": len(motions[key]),
                "fps": fps(source, path),
                "skip": skip(source, path),
                "action": action,
                "style": style,
                "performance": clip_name(first[key][1]) if key in first else "",
            }
        )
    keys = [(r["source"], r["performance"] or clip_name(r["path"]), r["action"], r["style"])
            for r in table]  # fmt: skip
    for row, split in zip(table, splits.assign(keys), strict=True):
        row["split"] = split
    with open(TABLE, "w", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, list(table[0]), delimiter="\t", lineterminator="\n")
        writer.writeheader()
        writer.writerows(table)
    print(f"{len(table)} clips, {TABLE.stat().st_size / 1000:.0f} kB")
    print("splits", splits.digest((r["source"], r["path"], r["split"]) for r in table))


if __name__ == "__main__":
    main()
