"""What became of a motion: what a program sees, or wrote, beside what it was given."""

from __future__ import annotations

import itertools
import json
import re
import struct
import warnings
from dataclasses import dataclass, replace
from pathlib import Path

import roma
import torch
from torch import Tensor

from motionlab import Motion, io

_SCALES = (1.0, 100.0, 0.01, 1000.0, 0.001)
_LIKE = 0.02  # how far bones may be from a unit's ratio and still be in that unit


@dataclass(frozen=True)
class Seen:
    """Points by name over time, as a program has them.

    Attributes
    ----------
    fps, start : rate, and time of the first frame in seconds.
    positions : (frames, points, 3), in the program's unit and axes.
    turns : (frames, points, 3, 3) world orientations, or None.
    offsets : each joint against its parent at rest, (points, 3), or None.
    ends : number of end sites.
    orders : rotation order of each point, or None.
    """

    names: tuple[str, ...]
    fps: float
    positions: Tensor
    turns: Tensor | None = None
    offsets: Tensor | None = None
    ends: int | None = None
    start: float = 0.0
    orders: tuple[str, ...] | None = None

    @classmethod
    def of(cls, motion: Motion, points: bool = False) -> Seen:
        """A motion's joints, or with `points` its end sites as well, and then nothing but places."""
        body = motion.skeleton
        places = motion.positions().double()
        if points:
            return cls(body.point_names, motion.fps, places, ends=len(body.end_parents))
        return cls(
            body.names,
            motion.fps,
            places[:, : body.joints],
            motion.orientations().double(),
            body.offsets.double(),
            len(body.end_parents),
            orders=body.rotation_orders,
        )


def read(folder: Path) -> Seen:
    """What a script left in its folder: seen.json, back.bvh or back.glb."""
    seen = folder / "seen.json"
    if seen.exists():
        said = json.loads(seen.read_text(encoding="utf-8"))
        turns = said.get("rotations")
        return Seen(
            tuple(said["names"]),
            said["fps"],
            torch.tensor(said["positions"], dtype=torch.float64),
            turns and roma.unitquat_to_rotmat(torch.tensor(turns, dtype=torch.float64)),
            ends=said.get("ends"),
            start=said.get("start", 0.0),
        )
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # the table says what we would warn of
        if (folder / "back.bvh").exists():
            seen = Seen.of(io.read_bvh(folder / "back.bvh", rigid="mean", up="y"))
            step = re.search(
                r"Frame Time:\s*(\S+)", (folder / "back.bvh").read_text(encoding="utf-8")
            )
            return replace(seen, fps=1 / float(step[1]))
        seen = Seen.of(io.read_gltf(folder / "back.glb", rigid="mean"))
        return replace(seen, orders=None, start=first_key(folder / "back.glb"))


def first_key(path: Path) -> float:
    """When a .glb file's animation begins, in seconds."""
    data = path.read_bytes()
    (length,) = struct.unpack_from("<I", data, 12)
    tree = json.loads(data[20 : 20 + length])
    keys = {each["input"] for each in tree["animations"][0]["samplers"]}
    return min(tree["accessors"][key]["min"][0] for key in keys)


def compare(given: Seen, found: Seen) -> dict:
    """What is kept, and how far the rest is off once unit and axes are undone.

    Points are compared frame by frame, and, where rates or first times differ, at the same times as
    well; `pairs` says which of the two is nearer.
    """
    shared = [name for name in given.names if name in found.names]
    result = {
        "joints": [len(given.names), len(shared)],
        "lost": [name for name in given.names if name not in found.names],
        "new": [name for name in found.names if name not in given.names],
        "frames": [len(given.positions), len(found.positions)],
        "fps": [round(given.fps, 4), round(found.fps, 4)],
        "starts at (s)": round(found.start, 5),
        "end sites": [given.ends, found.ends],
    }
    if not shared or not len(found.positions):
        return result
    mine, theirs = ([seen.names.index(name) for name in shared] for seen in (given, found))
    scale = unit(given.positions[:, mine], found.positions[:, theirs])
    tries = {}
    for pairs, (left, right) in paired(given, found).items():
        a, b = given.positions[left][:, mine], found.positions[right][:, theirs] / scale
        turn = axes(a[0], b[0])
        apart = 1000 * (a - b @ turn.T).norm(dim=-1)
        degrees = None
        if found.turns is not None:
            turned = (given.turns[left][:, mine], turn @ found.turns[right][:, theirs] @ turn.T)
            degrees = largest_turn(*turned)
        worst = apart.amax(0)
        frame = left[int(apart.amax(1).argmax())]
        tries[pairs] = {
            "axes": in_words(turn),
            "largest (mm)": float(worst.max()),
            "worst joint": shared[int(worst.argmax())],
            "worst frame": frame,
            "frames off by over 1 mm": int((apart.amax(1) > 1).sum()),
            "largest (deg)": degrees,
        }
    pairs = min(tries, key=lambda each: round(tries[each]["largest (mm)"], 2))
    result |= {"unit": scale, "pairs": pairs} | tries[pairs]
    if given.orders and found.orders:
        kept = [given.orders[i] == found.orders[j] for i, j in zip(mine, theirs, strict=True)]
        result["orders kept"] = sum(kept)
    if found.offsets is not None:
        turn = axes(given.positions[0][mine], found.positions[0][theirs] / scale)
        inner = [i for i in range(len(shared)) if mine[i] and theirs[i]]
        a = given.offsets[[mine[i] for i in inner]]
        b = found.offsets[[theirs[i] for i in inner]] / scale
        result["rest, as it is (mm)"] = float(1000 * (a - b).norm(dim=-1).max())
        result["rest, turned (mm)"] = float(1000 * (a - b @ turn.T).norm(dim=-1).max())
        result["bones (mm)"] = float(1000 * (a.norm(dim=-1) - b.norm(dim=-1)).abs().max())
    return result


def paired(given: Seen, found: Seen) -> dict[str, tuple[list[int], list[int]]]:
    """Frames of both that belong together: by number, and by time to half a thousandth of a second."""
    count = min(len(given.positions), len(found.positions))
    pairs = {"by number": (list(range(count)), list(range(count)))}
    left, right = [], []
    for there in range(len(found.positions)):
        here = (found.start + there / found.fps) * given.fps
        near = round(here)
        if abs(here - near) < 5e-4 * given.fps and 0 <= near < len(given.positions):
            left.append(near)
            right.append(there)
    if left and (left, right) != pairs["by number"]:
        pairs["by time"] = left, right
    return pairs


def unit(given: Tensor, found: Tensor) -> float:
    """How many of the program's units are in a metre, by the spread of points in the first frame; 1 if
    it fits no unit: then it is an error."""
    ratio = float(spread(found) / spread(given))
    return next((each for each in _SCALES if abs(ratio / each - 1) < _LIKE), 1.0)


def spread(positions: Tensor) -> Tensor:
    return (positions[0] - positions[0].mean(0)).norm()


def axes(given: Tensor, found: Tensor) -> Tensor:
    """The one of 48 ways to name axes that lays found points on given ones, (3, 3)."""
    ways = [
        torch.diag(torch.tensor(signs, dtype=torch.float64))[list(order)]
        for order in itertools.permutations(range(3))
        for signs in itertools.product((1.0, -1.0), repeat=3)
    ]
    apart = lambda way: float((given - found @ way.T).norm())
    same, best = torch.eye(3, dtype=torch.float64), min(ways, key=apart)
    return best if apart(best) < apart(same) / 2 else same  # else it is an error, not another axis


def in_words(turn: Tensor) -> str:
    """What our x, y, z are called over there; "mirrored" if no turn brings one to the other."""
    names = []
    for row in turn:
        column = int(row.abs().argmax())
        names.append(("" if row[column] > 0 else "-") + "xyz"[column])
    mirrored = ", mirrored" if torch.linalg.det(turn) < 0 else ""
    return " ".join(names) + mirrored


def largest_turn(given: Tensor, found: Tensor) -> float:
    """Degrees between two turns since the first frame, which no choice of a bone's axes changes."""
    a, b = (turns @ turns[:1].mT for turns in (given, found))
    return float(torch.rad2deg(roma.rotmat_geodesic_distance(a, b).max()))
