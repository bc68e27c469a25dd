"""Acclaim skeletons and motions as text, made by code: a body of CMU's bones, and any other."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass


@dataclass(frozen=True)
class Bone:
    """A bone of an .asf file; `parent` is a name."""

    name: str
    parent: str
    direction: tuple[float, float, float]
    length: float
    axis: tuple[float, float, float] = (0.0, 0.0, 0.0)
    axes: str = "XYZ"
    dof: tuple[str, ...] = ()


_TRUNK = ("rx", "ry", "rz")


def _side(side: str) -> list[Bone]:
    s = 1 if side == "l" else -1
    down, out = (s * 0.34202, -0.939693, 0), (s, 0, 0)
    return [
        Bone(f"{side}hipjoint", "root", (s * 0.64, -0.72, 0.27), 2.5),
        Bone(f"{side}femur", f"{side}hipjoint", down, 7.4, (0, 0, s * 20), dof=_TRUNK),
        Bone(f"{side}tibia", f"{side}femur", down, 7.7, (0, 0, s * 20), dof=("rx",)),
        Bone(f"{side}foot", f"{side}tibia", (0, -0.22, 0.975), 2.2, (-90, 0, s * 20), dof=("rx", "rz")),
        Bone(f"{side}toes", f"{side}foot", (0, 0, 1), 1.1, (-90, 0, s * 20), dof=("rx",)),
    ] + [
        Bone(f"{side}clavicle", "thorax", (s * 0.9, 0.4, -0.17), 3.4, dof=("ry", "rz")),
        Bone(f"{side}humerus", f"{side}clavicle", out, 5.6, (180, s * -30, s * -90), dof=_TRUNK),
        Bone(f"{side}radius", f"{side}humerus", out, 3.6, (180, s * -30, s * -90), dof=("rx",)),
        Bone(f"{side}wrist", f"{side}radius", out, 1.8, (0, s * 90, s * 90), dof=("ry",)),
        Bone(f"{side}hand", f"{side}wrist", out, 0.6, (0, s * 90, s * 90), dof=("rx", "rz")),
        Bone(f"{side}fingers", f"{side}hand", out, 0.5, (0, s * 90, s * 90), dof=("rx",)),
        Bone(f"{side}thumb", f"{side}wrist", (s * 0.707, 0, 0.707), 0.7, (-90, s * 45, 0), dof=("rx", "rz")),
    ]  # fmt: skip


_MIDDLE = ("lowerback", "upperback", "thorax", "lowerneck", "upperneck", "head")
PERSON = [
    Bone(name, parent, (0, 1, 0), 1.9, dof=_TRUNK)
    for name, parent in zip(_MIDDLE, ("root", *_MIDDLE), strict=False)
] + [bone for side in "lr" for bone in _side(side)]  # fmt: skip


def asf(
    bones: Sequence[Bone] = PERSON,
    *,
    length: float | None = 0.45,
    angle: str = "deg",
    order: str = "TX TY TZ RX RY RZ",
    position: str = "0 0 0",
    orientation: str = "0 0 0",
    root_axes: str = "XYZ",
) -> str:
    """The skeleton file."""
    lines = ["# AST/ASF file", "# --------", ":version 1.10", ":name VICON", ":units", "  mass 1.0"]
    lines += [] if length is None else [f"  length {length!r}"]
    lines += [f"  angle {angle}", ":documentation", "   begin of a text, which is end-less"]
    lines += [":root", f"   order {order}", f"   axis {root_axes}", f"   position {position}",
              f"   orientation {orientation}", ":bonedata"]  # fmt: skip
    for number, bone in enumerate(bones, 1):
        lines += ["  begin", f"     id {number}", f"     name {bone.name}"]
        lines += [f"     direction {' '.join(map(repr, bone.direction))}  ",
                  f"     length {bone.length!r}",
                  f"     axis {' '.join(map(repr, bone.axis))}  {bone.axes}"]  # fmt: skip
        if bone.dof:
            lines += [f"    dof {' '.join(bone.dof)}", "    limits (-160.0 20.0)"]
            lines += ["           (-70.0 70.0)"] * (len(bone.dof) - 1)
        lines.append("  end")
    lines += [":hierarchy", "  begin"]
    for parent in dict.fromkeys(bone.parent for bone in bones):
        lines.append(f"    {parent} {' '.join(b.name for b in bones if b.parent == parent)}")
    return "\n".join([*lines, "  end", ""])


def amc(
    frames: Sequence[dict[str, Sequence[float]]],
    head: Sequence[str] = ("#!OML:ASF F:\\VICON\\rory3.ASF", ":FULLY-SPECIFIED", ":DEGREES"),
    numbers: Sequence[int] | None = None,
) -> str:
    """The motion file: of each frame the values of each bone."""
    lines = list(head)
    for number, frame in zip(numbers or range(1, len(frames) + 1), frames, strict=True):
        lines.append(str(number))
        lines += [" ".join([name, *map(repr, values)]) for name, values in frame.items()]
    return "\n".join([*lines, ""])


def sway(frames: int, bones: Sequence[Bone] = PERSON) -> list[dict[str, list[float]]]:
    """Values in degrees by which every bone sways about rest, and the root goes along."""
    found = []
    for t in range(frames):
        frame = {"root": [0.1 * t, 16.5, 0.2 * t, *(5 * math.sin(t / 9 + i) for i in range(3))]}
        for i, bone in enumerate(bones):
            if bone.dof:
                frame[bone.name] = [20 * math.sin(t / 7 + i + k) for k in range(len(bone.dof))]
        found.append(frame)
    return found
