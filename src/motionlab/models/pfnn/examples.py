"""From a motion to what a PFNN is to see and to say in each of its frames.

Holden, Komura and Saito (2017), *Phase-Functioned Neural Networks for Character Control*, *System
Input/Output*; what the text leaves open is as in the code that they published.
"""

from __future__ import annotations

import math

import torch
from scipy.ndimage import gaussian_filter1d
from torch import Tensor

from ...encodings import Normalizer
from ...encodings.path import turned
from ...errors import ModelError
from ...feet import contacts, strides
from ...kinematics import yaw_matrix
from ...metrics.gait import facing
from ...motion import Motion
from ...paths import flat, upright
from .layout import Layout, join, size
from .walk import yaw_of

_SMOOTH = 1 / 3  # seconds, deviation of the Gaussian that steadies the way a body faces
_LOUD = 0.1  # what joints count beside the trajectory, in the input
_LEAST = 1e-4  # smallest deviation that is divided by


def examples(layout: Layout, motion: Motion) -> Tensor:
    """Rows (n, 1 + seen + said): the phase in radians, what is seen, what is to be said.

    A row for each frame that has `layout.reach` frames before and behind it and whose phase is
    known: between the first strike of a foot and the last (`feet.strides.phase`), by the motion's
    contacts or, where it has none, `contacts.label`.

    Raises
    ------
    ModelError : another skeleton or rate than the layout's, or a layout with gaits.
    """
    _check(layout, motion)
    body = _Body(layout, motion)
    now = torch.arange(layout.reach, max(layout.reach, len(motion) - layout.reach))
    now = now[(body.phase[now] + body.phase[now + 1]).isfinite()]
    rows = torch.cat(
        [
            (body.phase[now] % (2 * math.pi))[:, None],
            join(layout.seen, body.seen(now)),
            join(layout.said, body.said(now)),
        ],
        dim=-1,
    )
    return rows.float()


class _Body:
    """A motion by its roots: where each is, which way it faces, and the joints as seen from there."""

    def __init__(self, layout: Layout, motion: Motion) -> None:
        import roma  # loads torch's compiler, which takes as long as the rest of torch

        self.layout = layout
        points = motion.positions()[:, : motion.skeleton.joints].double()
        self.places = upright(points[:, 0, [0, 2]])
        self.directions = _steadied(facing(points, motion.skeleton), motion.fps)
        self.yaw = yaw_of(self.directions)
        self.joints = turned(points - self.places[:, None], -self.yaw[:, None])
        # in the step to a frame: the published code trains with those in the step from it, yet adds
        # them to the frame before, which at 30 frames a second is centimetres off
        self.velocities = turned(points.diff(dim=0, prepend=points[:1]), -self.yaw[:, None])
        seen_from_root = yaw_matrix(-self.yaw)[:, None] @ motion.orientations().double()
        self.rotations = roma.rotmat_to_rotvec(seen_from_root) / 2
        down = contacts.label(motion) if motion.contacts is None else motion.contacts
        self.contacts, self.phase = down.double(), strides.phase(down, motion.fps)

    def seen(self, now: Tensor) -> dict[str, Tensor]:
        """Parts of what is seen in some frames (n,)."""
        its, count = self.layout, len(now)
        around = now[:, None] + torch.arange(-its.reach, its.reach, its.stride)
        return self._trajectory(around, now) | {
            "gaits": torch.zeros(count, *its.seen["gaits"]),
            "joints": self.joints[now - 1], "velocities": self.velocities[now - 1],
            "grounds": torch.zeros(count, *its.seen["grounds"]),
        }  # fmt: skip

    def said(self, now: Tensor) -> dict[str, Tensor]:
        """Parts of what is to be said in some frames (n,)."""
        its, after = self.layout, now + 1
        ahead = after[:, None] + torch.arange(0, its.reach, its.stride)
        turn = self.yaw[now] - self.yaw[after]
        return self._trajectory(ahead, after) | {
            "step": flat(turned(self.places[after] - self.places[now], -self.yaw[now])),
            "turn": torch.atan2(turn.sin(), turn.cos())[:, None],
            "phase": ((self.phase[after] - self.phase[now]) / (2 * math.pi))[:, None],
            "contacts": self.contacts[now],
            "joints": self.joints[now], "velocities": self.velocities[now],
            "rotations": self.rotations[now],
        }  # fmt: skip

    def _trajectory(self, frames: Tensor, roots: Tensor) -> dict[str, Tensor]:
        """Places and directions (n, 2, N) of frames (n, N) as seen from the roots of others (n,)."""
        back = -self.yaw[roots, None]
        places = turned(self.places[frames] - self.places[roots, None], back)
        return {
            "places": flat(places).mT,
            "directions": flat(turned(self.directions[frames], back)).mT,
        }


def normalizers(layout: Layout, rows: Tensor) -> tuple[Normalizer, Normalizer]:
    """Of what is seen and what is said in rows of `examples`.

    Numbers of a kind share a deviation, so that a joint that moves little is not blown up; joints
    are seen ten times smaller than the trajectory, which is to be obeyed.
    """
    _, seen, said = rows.split([1, size(layout.seen), size(layout.said)], dim=-1)
    return _normalizer(layout.seen, seen, {"joints": _LOUD, "velocities": _LOUD}), _normalizer(
        layout.said, said, {}
    )


def _normalizer(parts: dict, rows: Tensor, loud: dict[str, float]) -> Normalizer:
    std, mean = torch.std_mean(rows.double(), dim=0, correction=0)
    normalizer = Normalizer(len(mean))
    normalizer.mean.copy_(mean)
    pieces = zip(parts, std.split([size({name: parts[name]}) for name in parts]), strict=True)
    shared = [piece.mean().expand_as(piece) / loud.get(name, 1.0) for name, piece in pieces]
    normalizer.std.copy_(torch.cat(shared).nan_to_num(1.0).clamp(min=_LEAST))
    return normalizer


def _steadied(yaw: Tensor, fps: float) -> Tensor:
    """Directions (frames, 3) of yaws (frames,), without the swing of hips and shoulders."""
    ways = torch.stack([yaw.sin(), yaw.cos()], dim=-1)
    smooth = gaussian_filter1d(ways.numpy(), _SMOOTH * fps, axis=0, mode="nearest")
    return torch.nn.functional.normalize(upright(torch.from_numpy(smooth)), dim=-1)


def _check(layout: Layout, motion: Motion) -> None:
    if not motion.skeleton.matches(layout.skeleton):
        raise ModelError(
            f"{motion!r} has another skeleton than the layout: "
            f"{layout.skeleton.difference(motion.skeleton)}; bring it there with "
            "motion.retarget(layout.skeleton)."
        )
    if abs(motion.fps - layout.fps) > 1e-4 * layout.fps:
        raise ModelError(
            f"{motion!r} has another rate than the layout; give motion.resample({layout.fps:g})."
        )
    if layout.gaits:
        raise ModelError("Nobody knows the gaits of a motion; make a layout with gaits=0.")
