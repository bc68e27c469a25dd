"""The body as a tree of seven parts: STRNN's spatial encoder and decoder.

Wang, Ho, Shum and Zhu (2021), *Spatio-temporal Manifold Learning for Human Motions via Long-horizon
Modeling*, section 4.1.1, equations 2 and 3; parts as in Du, Wang and Wang (2015), *Hierarchical
recurrent neural network for skeleton based action recognition*. Who waves moves one arm. So each part
is summed up by itself, then with the spine, then as half a body, and only then as a whole.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import torch
from torch import Tensor, nn
from torch.nn.functional import linear

from ..encodings import BodyFrame
from ..errors import ModelError

LIMBS = ("left_arm", "right_arm", "left_leg", "right_leg")
HALVES = {"upper": LIMBS[:2], "lower": LIMBS[2:]}
BODY = ("spine", *LIMBS)


def part_channels(encoding: BodyFrame, kept: Sequence[int]) -> dict[str, list[int]]:
    """For each part its channels among those that are kept: body parts first, then root and contacts.

    A limb is what hangs on its first joint: the shoulder (the upper arm where there is none), or the
    upper leg. The root has its position, tilt, velocities and turn rate; the spine all that is left.

    Raises
    ------
    ModelError : another encoding, a skeleton without a joint that a limb begins with, or a part of
        which nothing moves.
    """
    if not isinstance(encoding, BodyFrame):
        raise ModelError(
            f"The spatial network knows parts of BodyFrame features, not {type(encoding).__name__}."
        )
    skeleton, first = encoding.skeleton, {}
    for limb in LIMBS:
        side, kind = limb.split("_")
        roles = ("shoulder", "upper_arm") if kind == "arm" else ("upper_leg",)
        joints = [skeleton.roles[f"{side}_{role}"] for role in roles
                  if f"{side}_{role}" in skeleton.roles]  # fmt: skip
        if not joints:
            raise ModelError(
                f"{skeleton!r} has no joint that reads like {side} {roles[-1].replace('_', ' ')}, "
                f"with which its {side} {kind} begins; say it with "
                f"roles={{'{side}_{roles[-1]}': NAME}}. Joints: {', '.join(skeleton.names)}."
            )
        first[joints[0]] = limb
    owner = ["spine"]
    for joint, parent in list(enumerate(skeleton.parents))[1:]:
        owner.append(first.get(joint, owner[parent]))
    of_channel = [part for part in owner[1:] for _ in "xyz"]
    of_channel += ["root"] * (encoding.slices["root"].stop - encoding.slices["root"].start)
    of_channel += ["contacts"] * (encoding.dim - len(of_channel))
    parts = [*BODY, "root"] + ["contacts"] * ("contacts" in encoding.slices)
    found = {part: [i for i, c in enumerate(kept) if of_channel[c] == part] for part in parts}
    for part, channels in found.items():
        if not channels:
            raise ModelError(
                f"Nothing of the part {part.replace('_', ' ')} moves, or {skeleton!r} has no joint of "
                "it; the spatial network needs all parts (spatial=False does without it)."
            )
    return found


class Grouped(nn.Module):
    """A linear layer in groups: each group of outputs sees some groups of the inputs, and no others.

    Parameters
    ----------
    inputs, outputs : size of each group, in order.
    sees : for each group of outputs, which it sees.
    """

    def __init__(
        self, inputs: Mapping[str, int], outputs: Mapping[str, int],
        sees: Mapping[str, Sequence[str]],
    ) -> None:  # fmt: skip
        super().__init__()
        rows = [
            torch.cat([torch.full((size, n), name in sees[out]) for name, n in inputs.items()], 1)
            for out, size in outputs.items()
        ]
        mask = torch.cat(rows)
        spread = mask.sum(1, keepdim=True) ** -0.5
        self.register_buffer("mask", mask, persistent=False)
        self.weight = nn.Parameter(spread * mask * (2 * torch.rand(mask.shape) - 1))
        self.bias = nn.Parameter(torch.zeros(len(mask)))

    def forward(self, x: Tensor) -> Tensor:
        """Outputs (..., outputs) of x (..., inputs)."""
        return linear(x, self.weight * self.mask, self.bias)


class Level(nn.Module):
    """`Grouped`, batch norm, ELU and dropout; rows (rows, inputs) in, (rows, outputs) out."""

    def __init__(self, inputs, outputs, sees, drop: float) -> None:
        super().__init__()
        self.grouped, self.drop = Grouped(inputs, outputs, sees), drop
        self.norm = nn.BatchNorm1d(sum(outputs.values()))

    def forward(self, rows: Tensor, chance: torch.Generator | None = None) -> Tensor:
        """chance : of what is dropped; None: nothing is."""
        rows = nn.functional.elu(self.norm(self.grouped(rows)))
        if chance is None or not self.drop:
            return rows
        stays = torch.empty_like(rows).bernoulli_(1 - self.drop, generator=chance)
        return rows * stays / (1 - self.drop)


class SpatialEncoder(nn.Module):
    """f of equation 2: a frame's code. Levels of `width` / 8 (a part), / 4 (a limb with the spine),
    / 2 (half a body) and `width` units (the whole, which root and contacts join).

    parts : of `part_channels`.
    dense : layers of the same sizes of which all see all, as those of an ERD: no tree.
    """

    def __init__(
        self, parts: Mapping[str, Sequence[int]], width: int, drop: float, dense: bool = False
    ) -> None:
        super().__init__()
        body, limbs, halves, others = _sizes(parts, width)
        sizes = {name: len(channels) for name, channels in parts.items()}
        self.register_buffer("order", _order(parts), persistent=False)
        self.body = sum(body.values())
        level = _all_see_all if dense else Level
        self.parts = level(sizes, body | others, {name: (name,) for name in sizes}, drop)
        self.limbs = level(body, limbs, {limb: ("spine", limb) for limb in LIMBS}, drop)
        self.halves = level(limbs, halves, HALVES, drop)
        self.whole = Level(halves | others, {"whole": width}, {"whole": (*halves, *others)}, drop)

    def forward(self, frames: Tensor, chance: torch.Generator | None = None) -> Tensor:
        """Codes (..., width) of normalised frames (..., kept)."""
        parts = self.parts(frames[..., self.order].flatten(0, -2), chance)
        halves = self.halves(self.limbs(parts[:, : self.body], chance), chance)
        code = self.whole(torch.cat([halves, parts[:, self.body :]], 1), chance)
        return code.unflatten(0, frames.shape[:-1])


class SpatialDecoder(nn.Module):
    """The inverse of `SpatialEncoder`, equation 3: its mirror image, and a linear layer at its end.

    Each limb says something of the spine, which is made of all four.
    """

    def __init__(
        self, parts: Mapping[str, Sequence[int]], width: int, drop: float, dense: bool = False
    ) -> None:
        super().__init__()
        body, limbs, halves, others = _sizes(parts, width)
        spines = {limb: f"spine at {limb}" for limb in LIMBS}
        parted = {name: body[limb] for limb in LIMBS for name in (limb, spines[limb])}
        half_of = {limb: (half,) for half, both in HALVES.items() for limb in both}
        self.register_buffer("order", _order(parts).argsort(), persistent=False)
        self.halves = sum(halves.values())
        level = _all_see_all if dense else Level
        self.whole = Level({"whole": width}, halves | others,
                           dict.fromkeys([*halves, *others], ("whole",)), drop)  # fmt: skip
        self.limbs = level(halves, limbs, half_of, drop)
        self.parts = level(
            limbs, parted, {name: (name.rpartition(" ")[2],) for name in parted}, drop
        )
        sizes = {name: len(channels) for name, channels in parts.items()}
        sees = {name: (name,) for name in sizes} | {"spine": tuple(spines.values())}
        if dense:
            sees = dict.fromkeys(sizes, tuple(parted | others))
        self.leave = Grouped(parted | others, sizes, sees)

    def forward(self, codes: Tensor, chance: torch.Generator | None = None) -> Tensor:
        """Normalised frames (..., kept) of codes (..., width)."""
        whole = self.whole(codes.flatten(0, -2), chance)
        parted = self.parts(self.limbs(whole[:, : self.halves], chance), chance)
        frames = self.leave(torch.cat([parted, whole[:, self.halves :]], 1))[:, self.order]
        return frames.unflatten(0, codes.shape[:-1])


def _all_see_all(inputs, outputs, sees, drop: float) -> Level:
    """A level without groups."""
    return Level(inputs, outputs, dict.fromkeys(outputs, tuple(inputs)), drop)


def _sizes(parts: Mapping[str, Sequence[int]], width: int) -> tuple[dict[str, int], ...]:
    """Units of body parts, limbs, halves, and of what joins the whole body only."""
    others = [name for name in parts if name not in BODY]
    return (
        dict.fromkeys(BODY, width // 8), dict.fromkeys(LIMBS, width // 4),
        dict.fromkeys(HALVES, width // 2), dict.fromkeys(others, width // 8),
    )  # fmt: skip


def _order(parts: Mapping[str, Sequence[int]]) -> Tensor:
    """All channels, part by part."""
    return torch.tensor([channel for channels in parts.values() for channel in channels])


def residual_layers(size: int, width: int) -> nn.Sequential:
    """The residual network: four layers over a window at once, of which the last says nothing at first."""
    layers: list[nn.Module] = []
    for before in (size, width, width):
        layers += [nn.Linear(before, width), nn.ELU()]
    last = nn.Linear(width, size)
    nn.init.zeros_(last.weight)
    nn.init.zeros_(last.bias)
    return nn.Sequential(*layers, last)
