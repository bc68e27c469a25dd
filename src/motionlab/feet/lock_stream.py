"""Feet held still while motion comes, some frames behind it.

What `lock` does to a whole motion, to one character's stream whose contacts are known some frames
ahead. What only a whole motion tells is done otherwise: a place is where toes are while a contact
begins, not where they are on average (`holding`), and the body comes down as soon as a contact is
known. `lock` is the plain version, and what the tests hold this one against.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import Any

import numpy as np
import torch
from torch import Tensor

from ..errors import ModelError, SkeletonError
from ..motion import Motion
from ..skeleton import Skeleton
from .contacts import label, stands_on_floor
from .holding import Foot, Rules
from .legs import PARTS, flat_toes, front_at_rest, knee_front, leg_joints, legs_alone
from .lock import BLEND, SETTLE
from .one_leg import Matrix, Vector, knee, needed, plus, toes_up, turn


@dataclass
class _Frame:
    """One frame as it came, and what is to be known of its legs, each left first."""

    root: np.ndarray  # (3,) metres
    rotations: np.ndarray  # (joints, 3, 3), local
    world: np.ndarray  # (leg points, 3, 3)
    at: list[list[Vector]]  # metres: hips, knees, ankles, toes
    fronts: list[Vector]  # which way knees point
    tips: list[Vector]  # metres, from toe joints to the tips of toes
    down: tuple[bool, bool]
    steps: list[float]  # metres that toes came from the frame before
    longest: list[float]  # metres of stretched legs


@dataclass
class LockState:
    """All that a stream knows between two frames; `copy.deepcopy` keeps it."""

    waiting: list[_Frame] = field(default_factory=list)
    feet: tuple[Foot, Foot] = field(default_factory=lambda: (Foot(), Foot()))
    peaks: list[float] = field(default_factory=list)  # metres down, of the last frames
    frames: int = 0  # that came in


_STAYS = np.eye(3).tolist()
_STILL = np.array([[_STAYS] * 2] * 4)  # thighs, shanks, feet and toes that do not turn


class LockStream:
    """Locks feet frame by frame, `ahead` frames behind what it is given.

    Parameters
    ----------
    skeleton : with feet, toes and legs that it names.
    fps : frames per second.
    floor : height of the floor in metres. None: toes are held as high as they come down, and no foot
        is lifted out of a floor.
    blend : seconds over which a foot eases out of a contact. Into one it eases as soon as the
        contact is sure to last.
    ahead : frames that are known ahead; None: a sixth of a second, 5 at 30 frames a second.
    example : a motion of this skeleton. Needed only if its rest pose does not stand on the floor, so
        that only motion tells which way knees point and how high toes are.
    state : of a stream that went before, to go on from; it changes as the stream does.

    Raises
    ------
    ModelError : a rate, floor, blend or number of frames that makes no sense.
    SkeletonError : the skeleton lacks a joint of a leg; or its rest pose does not stand, and there is
        no example.
    """

    def __init__(
        self, skeleton: Skeleton, fps: float, *, floor: float | None = 0.0, blend: float = BLEND,
        ahead: int | None = None, example: Motion | None = None, state: LockState | None = None,
    ) -> None:  # fmt: skip
        ahead = _checked_settings(fps, floor, blend, ahead)
        self.skeleton, self.fps, self.floor, self.ahead = skeleton, float(fps), floor, ahead
        self.state = LockState() if state is None else state
        self._legs, self._kept = legs_alone(skeleton)
        joints = leg_joints(self._legs)
        self._points = np.array([joints[part] for part in PARTS])  # (4, 2)
        self._rest, self._levels = _rest_frames(self._legs), _levels(self._legs)
        toed = (self._points[3] < self._legs.joints) & (self._points[3] != self._points[2])
        self._toed = bool(toed.all())  # toes are joints, not the ends of feet
        self._above = np.array(self._legs.parents)[self._points[: 3 + self._toed]]
        self._places = np.array(self._kept)[self._points[: 3 + self._toed]]
        self._tips = np.stack([_tip(self._legs, toes) for toes in joints["toes"]])[..., None]
        self._front, self._flat = _told(skeleton, example)
        self._rules = Rules(self.fps, ahead, blend)
        self._settle = round(SETTLE * fps)
        most = self._rules.sure
        self._bell = [math.comb(most, k) / 2**most for k in range(most + 1)]

    @property
    def known(self) -> dict[str, Any]:
        """What is known before the first frame, fit for JSON: what web/src/feet/lock_stream.js goes by.

        "joints" of the whole skeleton, for each part of a leg the left and the right one; "fronts" of
        knees, in the frames of thighs; heights "flat" of resting toes; the others are frames.
        """
        kept = np.array(self._kept)
        return {
            "joints": kept[self._points].tolist(),
            "fronts": self._front[..., 0].tolist(),
            "flat": self._flat,
            "ahead": self.ahead,
            "settle": self._settle,
            "rules": vars(self._rules),
        }

    # -- frames in and out --------------------------------------------------------------------

    def push(
        self, root_positions: Tensor, rotations: Tensor, contacts: Tensor
    ) -> tuple[Tensor, Tensor]:
        """Take the next frames, and give those back that are done.

        Parameters
        ----------
        root_positions : (frames, 3) metres, or (3,) for one frame.
        rotations : (frames, joints, 3, 3) or (joints, 3, 3), local.
        contacts : bool (frames, 2) or (2,), left and right toe; or 4, as of a Motion.

        Returns
        -------
        root_positions (n, 3) and rotations (n, joints, 3, 3): the frames that came in `ahead` frames
        ago and have not been given back yet; none at first. Frames one by one give what all give.

        Raises
        ------
        ModelError : frames of another skeleton, NaN, contacts that are not bool or not 2 or 4. Such
            frames are not taken, and the stream can go on without them.
        """
        done = []
        for frame in self._checked(root_positions, rotations, contacts):
            self._take(*frame)
            if len(self.state.waiting) > self.ahead:
                done.append(self._give())
        return self._stacked(done)

    def finish(self) -> tuple[Tensor, Tensor]:
        """The frames that wait, at the end of a stream; what comes then is another one."""
        done = [self._give() for _ in self.state.waiting.copy()]
        self.state = LockState()
        return self._stacked(done)

    def _stacked(self, done: list[tuple[np.ndarray, np.ndarray]]) -> tuple[Tensor, Tensor]:
        if not done:
            return torch.zeros(0, 3), torch.zeros(0, self.skeleton.joints, 3, 3)
        roots, rotations = (np.array(part, dtype=np.float32) for part in zip(*done, strict=True))
        return torch.from_numpy(roots), torch.from_numpy(rotations)

    def _checked(self, root_positions: Tensor, rotations: Tensor, contacts: Tensor) -> zip:
        """The frames one by one; raises ModelError."""
        roots, turns, down = (_array(a) for a in (root_positions, rotations, contacts))
        if roots.ndim == 1:
            roots, turns, down = roots[None], turns[None], down[None]
        joints = self.skeleton.joints
        if roots.shape[1:] != (3,) or turns.shape != (len(roots), joints, 3, 3):
            raise ModelError(
                f"LockStream: root_positions {roots.shape} and rotations {turns.shape} are no frames "
                f"of this skeleton; they must be (frames, 3) and (frames, {joints}, 3, 3)."
            )
        if down.dtype != bool or down.shape not in [(len(roots), 2), (len(roots), 4)]:
            raise ModelError(
                f"LockStream: contacts are {down.dtype} of shape {down.shape}; they must be bool, "
                f"({len(roots)}, 2) for both toes (or 4 with the heels)."
            )
        if not (np.isfinite(roots).all() and np.isfinite(turns).all()):
            whole = np.isfinite(roots).all(1) & np.isfinite(turns).all((1, 2, 3))
            raise ModelError(
                f"LockStream: NaN or infinite in frame {self.state.frames + int(whole.argmin())} of "
                "the stream; give the frame before it once more instead."
            )
        return zip(roots, turns, down.tolist(), strict=True)

    # -- one frame ----------------------------------------------------------------------------

    def _take(self, root: np.ndarray, rotations: np.ndarray, down: list[bool]) -> None:
        """Put a frame into the queue; a copy, as its owner may write the next one over it."""
        root, rotations = root.copy(), rotations.copy()
        points, world = self._kinematics(root, rotations)
        at = points[self._points].tolist()
        fronts = (world[self._points[0]] @ self._front)[..., 0].tolist()
        tips = (world[self._points[3]] @ self._tips)[..., 0].tolist() if self._toed else []
        waiting, sides = self.state.waiting, range(2)
        before = waiting[-1].at[3] if waiting else [[math.inf] * 3] * 2
        steps = [math.dist(at[3][i], before[i]) for i in sides]
        longest = [math.dist(at[1][i], at[0][i]) + math.dist(at[2][i], at[1][i]) for i in sides]
        down = (down[0], down[1]) if len(down) == 2 else (down[1], down[3])
        self.state.frames += 1
        waiting.append(_Frame(root, rotations, world, at, fronts, tips, down, steps, longest))

    def _kinematics(self, root: np.ndarray, rotations: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Points (leg points, 3), and their frames' orientations (leg points, 3, 3) in the world."""
        local = self._rest.copy()
        local[: len(self._kept), :3, :3] = rotations[self._kept]
        local[0, :3, 3] = root
        for members, parents in self._levels:
            local[members] = local[parents] @ local[members]  # in the world from here on
        return local[:, :3, 3], local[:, :3, :3]

    def _give(self) -> tuple[np.ndarray, np.ndarray]:
        """The oldest frame that waits, its feet locked: root position and local rotations."""
        shifts = [self._shifts(i) for i in range(2)]
        down = self._sink(shifts)
        frame = self.state.waiting.pop(0)
        frame.root[1] -= down
        self._bend(frame, [shifts[0][0], shifts[1][0]], down)
        return frame.root, frame.rotations

    def _shifts(self, i: int) -> list[Vector]:
        """How far one foot is to be moved, in this frame and, as it looks, in the next ones."""
        waiting = self.state.waiting
        steps = [frame.steps[i] for frame in waiting] + [math.inf]
        speeds = [min(a, b) * self.fps for a, b in pairwise(steps)]
        toes, down = [f.at[3][i] for f in waiting], [f.down[i] for f in waiting]
        floor, flat = self.floor, self._flat[i]
        height = None if floor is None else floor + flat
        shifts = self.state.feet[i].shifts(self._rules, down, speeds, toes, height)
        if floor is not None:  # no foot goes into it
            for frame, shift in zip(waiting, shifts, strict=False):
                lowest = min(frame.at[3][i][1] - flat, frame.at[2][i][1]) + shift[1]
                shift[1] += max(floor - lowest, 0.0)
        return shifts

    def _sink(self, shifts: list[list[Vector]]) -> float:
        """Metres that the root comes down for both legs to reach their ankles.

        What is needed is known as far ahead as contacts are. The body comes down to the most of what
        was needed lately and will be, under a bell that begins when it is known; feet that ease into
        a contact may be short of their way, those that are held are not.
        """
        sides, feet = range(2), self.state.feet
        ahead = [
            [
                needed(f.at[0][i], f.at[2][i], shifts[i][k], f.longest[i])
                if k >= feet[i].easing
                else 0.0
                for i in sides
            ]
            for k, f in enumerate(self.state.waiting[: self._rules.sure + 1])
        ]
        peaks, most = self.state.peaks, max(map(max, ahead))
        memory = self._settle + len(self._bell)
        peaks = self.state.peaks = [*(peaks or [most] * memory), most][-memory:]
        if not any(peaks):
            return 0.0
        last = len(peaks)
        eased = sum(
            share * max(peaks[last - k - 1 - self._settle : last - k])
            for k, share in enumerate(self._bell)
        )
        return max(eased, *(ahead[0][i] for i in sides if feet[i].place is not None), 0.0)

    def _bend(self, frame: _Frame, shifts: list[Vector], down: float) -> None:
        """Turn the legs of a frame so that they reach their ankles."""
        lifts: list = [None, None]
        if self.floor is not None and self._toed:
            heights = [frame.at[3][i][1] + shifts[i][1] - self.floor for i in range(2)]
            lifts = [toes_up(*both) for both in zip(frame.tips, heights, strict=True)]
        if not down and not any(any(shift) for shift in shifts) and lifts == [None, None]:
            return
        turned = _STILL.copy()  # feet keep the way they point
        if down or any(any(shift) for shift in shifts):
            turned[:2] = list(
                zip(*(self._turns(frame, i, shifts[i], down) for i in range(2)), strict=True)
            )
        for i, lift in enumerate(lifts):
            if lift is not None:
                turned[3, i] = lift
        # each joint in the frame of the one above, which has turned as well
        turned[1:] = turned[:3].swapaxes(-1, -2) @ turned[1:]
        above, own = frame.world[self._above], frame.world[self._points[: len(self._above)]]
        frame.rotations[self._places] = above.swapaxes(-1, -2) @ turned[: len(above)] @ own

    @staticmethod
    def _turns(frame: _Frame, i: int, shift: Vector, down: float) -> tuple[Matrix, Matrix]:
        """Turns of one leg's thigh and shank, in the world."""
        hip, knee_was, ankle, _ = (part[i] for part in frame.at)
        if not down and not any(shift):
            return _STAYS, _STAYS
        thigh, shin = plus(knee_was, -1, hip), plus(ankle, -1, knee_was)
        reach = plus(plus(ankle, 1, shift), -1, hip)
        reach[1] += down
        there = knee(thigh, shin, reach, frame.fronts[i])
        return turn(thigh, there), turn(shin, plus(reach, -1, there))


# -- what is known beforehand -----------------------------------------------------------------------


def _rest_frames(skeleton: Skeleton) -> np.ndarray:
    """Each point's frame at rest in that of its parent (points, 4, 4), turn and offset in one."""
    frames = np.eye(4)[None].repeat(skeleton.points, 0)
    frames[:, :3, 3] = torch.cat([skeleton.offsets, skeleton.end_offsets]).numpy()
    return frames


def _levels(skeleton: Skeleton) -> list[tuple[np.ndarray, np.ndarray]]:
    """Points as far from the root as each other, and their parents."""
    parents, depth = skeleton.point_parents, [0]
    for parent in parents[1:]:
        depth.append(depth[parent] + 1)
    rows = [[p for p in range(len(parents)) if depth[p] == d] for d in range(1, max(depth) + 1)]
    return [(np.array(row), np.array(parents)[row]) for row in rows]


def _tip(skeleton: Skeleton, toes: int) -> np.ndarray:
    """Where the tip of the toes is (3,) in their frame; 0 if they have none."""
    ends = zip(skeleton.end_parents, skeleton.end_offsets, strict=True)
    return next((end.double().numpy() for above, end in ends if above == toes), np.zeros(3))


def _told(skeleton: Skeleton, example: Motion | None) -> tuple[np.ndarray, list[float]]:
    """Which way knees point (2, 3, 1) in the frames of thighs, and how high flat toes are (2,)."""
    legs, kept = legs_alone(skeleton)
    front = front_at_rest(legs)
    if example is not None:
        if not skeleton.matches(example.skeleton):
            raise SkeletonError(
                "LockStream: the example is of another skeleton: "
                f"{skeleton.difference(example.skeleton)}; give a motion of this one."
            )
        motion = replace(example, skeleton=legs, rotations=example.rotations[:, kept])
        points, world = motion.positions(), motion.orientations()
        down = label(example) if example.contacts is None else example.contacts
        flat = flat_toes(legs, points, down[:, [1, 3]])
        front = knee_front(legs, points, world)[0]
    elif front is None or not stands_on_floor(legs):
        raise SkeletonError(
            "LockStream: this skeleton's rest pose does not stand on the floor, so which way its "
            "knees point is not known; give a motion of it, example=motion."
        )
    else:
        flat = flat_toes(legs, torch.zeros(1, legs.points, 3), torch.zeros(1, 2) > 0)
    return front.double().numpy()[..., None], flat.tolist()


def _array(values: object) -> np.ndarray:
    """A tensor's or list's numbers; raises ModelError."""
    try:
        found = values.numpy(force=True) if isinstance(values, Tensor) else np.asarray(values)
    except (TypeError, ValueError) as error:
        raise ModelError(f"LockStream: frames must be arrays of numbers: {error}.") from error
    if found.dtype.kind not in "biuf":
        raise ModelError(f"LockStream: frames must be arrays of numbers, not {found.dtype}.")
    return found


def _checked_settings(fps: float, floor: float | None, blend: float, ahead: int | None) -> int:
    """Frames ahead; raises ModelError."""
    if not 0 < fps < math.inf:
        raise ModelError(f"LockStream: fps is {fps!r}; it must be a positive number.")
    if not 0 <= blend < math.inf or not (floor is None or math.isfinite(floor)):
        raise ModelError(
            f"LockStream: blend {blend} s, floor {floor} m; both must be numbers, blend from 0."
        )
    ahead = max(2, round(fps / 6)) if ahead is None else ahead
    if not isinstance(ahead, int) or ahead < 2:
        raise ModelError(f"LockStream: ahead is {ahead!r}; it must be 2 frames at least.")
    return ahead
