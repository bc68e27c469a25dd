"""How each kind of network goes on from recorded motion, as joints of the one body.

Each function takes a network and gives a `GoOn`: of a `Begun`, a number of frames and a seed it makes
joints (starts, frames, joints, 3), in metres, where the recorded motion left off. From the first frame on
that is no number, all are NaN. Told to be `quiet`, it adds no noise of its own: so it is asked to foretell.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import torch
from torch import Tensor, nn

from motionlab.encodings import RootRelative
from motionlab.feet import contacts
from motionlab.models.floor import ConstantVelocity
from motionlab.paths import Path
from motionlab.solvers import design, lock_feet, path_control
from motionlab.solvers.energy import Before

from .begun import Begun
from .trainings import joints_alone, rows_of

GoOn = Callable[..., Tensor]  # (begun, frames, seed, quiet=False)
STRNN_NOISE, ACLSTM_NOISE = 0.02, 0.1  # as the shipped ones have been found to need
RECENT = 1.0  # seconds that tell a leader how fast he goes, and which way
SLOWEST = 0.2  # m/s that a path is walked at


def angles(
    model: nn.Module, sampling: dict, refiner: nn.Module | None = None, lock: bool = False
) -> GoOn:
    """An LSTM-GMM; refined, and with feet locked by its own labels, if asked for."""

    def go_on(begun: Begun, frames: int, seed: int, quiet: bool = False) -> Tensor:
        seen = begun.rows[..., : model.encoding.dim]
        made = model.generate(
            frames, model.observe(seen, doubt=False), generator=chance(seed), **sampling
        )
        if refiner is not None:
            sound = made.isfinite().flatten(1).all(1)
            made[sound] = refiner(made[sound])
        if not lock:
            return behind(model.encoding, seen, made)
        return torch.stack([locked(model.encoding, *both) for both in zip(seen, made, strict=True)])

    return go_on


def locked(encoding, seen: Tensor, made: Tensor) -> Tensor:
    """Joints (frames, joints, 3) of one motion whose feet are held where it says that they rest."""
    if not bool(made.isfinite().all()):
        return behind(encoding, seen[None], made[None])[0]
    motion = encoding.to_motion(torch.cat([seen, made]))
    held = lock_feet(motion, motion.contacts, floor=None)
    return held.positions()[len(seen) :, : encoding.skeleton.joints]


def around_root(model: nn.Module) -> GoOn:
    """An acLSTM."""

    def go_on(begun: Begun, frames: int, seed: int, quiet: bool = False) -> Tensor:
        seen = rows_of(begun.points)
        made = model.generate(
            frames, model.observe(seen), generator=chance(seed),
            noise=0.0 if quiet else ACLSTM_NOISE,
        )  # fmt: skip
        return behind(model.encoding, seen, made)

    return go_on


def body_frame(model: nn.Module) -> GoOn:
    """A STRNN, in open loop."""

    def go_on(begun: Begun, frames: int, seed: int, quiet: bool = False) -> Tensor:
        seen, starts = [], []
        for rows in begun.rows:
            motion = begun.encoding.to_motion(rows)
            down = contacts.label(motion)
            down[:, [1, 3]] = motion.contacts[:, [1, 3]]
            seen.append(model.encoding.encode(replace(motion, contacts=down)))
            starts.append(model.encoding.start_of(motion))
        seen = torch.stack(seen)
        noise = 0.0 if quiet else STRNN_NOISE
        made = model.extrapolate(seen, frames, noise=noise, generator=chance(seed))
        return behind(model.encoding, seen, made, torch.stack(starts))

    return go_on


def straight_on(begun: Begun, frames: int, seed: int, quiet: bool = False) -> Tensor:
    """Every joint as fast as it was last, around a root that is: nobody trained it."""
    encoding = RootRelative(joints_alone(begun.encoding.skeleton), begun.encoding.fps)
    seen, model = rows_of(begun.points), ConstantVelocity(encoding)
    return behind(encoding, seen, model.generate(frames, model.observe(seen)))


def along_path(model: nn.Module, refiner: nn.Module) -> GoOn:
    """An LSTM-GMM whose root is held to a straight line at the pace it has, refined and locked."""
    encoding = model.encoding

    def go_on(begun: Begun, frames: int, seed: int, quiet: bool = False) -> Tensor:
        seen = begun.rows[..., : encoding.dim]
        places, tables, paths = [], [], []
        speeds, ways = pace(begun)
        for rows, speed, way in zip(seen, speeds.tolist(), ways, strict=True):
            place = encoding.start_of(encoding.to_motion(rows)[-1:])
            # a third more than is asked for: who is late shall not come to the end
            length = max(speed, SLOWEST) * (frames + 30) / encoding.fps * 4 / 3
            path = Path.through(torch.stack([place[:2], place[:2] + length * way.double()]))
            places.append(place)
            paths.append(path)
            tables.append(path.timetable(speed, design.fastest_of(model), encoding.fps))
        before = Before(model.observe(seen, doubt=False), seen[:, -1], torch.stack(places))
        with torch.enable_grad():
            found = path_control.follow(
                model, paths, before, tables, fastest=design.fastest_of(model),
                chance=design.Chance(chance(seed), **model.sampling),
            )  # fmt: skip
        made = []
        for walked in found:
            motion = encoding.to_motion(walked.features, walked.place)
            motion = design.finished(motion, refiner, lock=True)
            made.append(motion.positions()[1 : frames + 1, : encoding.skeleton.joints])
        return torch.stack(made)

    return go_on


# -- what they share ------------------------------------------------------------------------------


def chance(seed: int) -> torch.Generator:
    return torch.Generator().manual_seed(seed)


def pace(begun: Begun) -> tuple[Tensor, Tensor]:
    """Metres a second (starts,) of the last second, and the way (starts, 2) it went, of length 1."""
    root = begun.points[:, :, 0][..., [0, 2]]
    some = round(RECENT * begun.encoding.fps)
    went = root[:, -1] - root[:, -1 - some]
    speed = went.norm(dim=-1) * begun.encoding.fps / some
    return speed, torch.nn.functional.normalize(went, dim=-1)


def behind(encoding, seen: Tensor, made: Tensor, start: Tensor | None = None) -> Tensor:
    """Joints of rows (starts, frames, dim) that follow others; NaN from where they are no numbers."""
    bad = (~made.isfinite().all(-1)).cumsum(-1) > 0
    rows = torch.cat([seen, made.masked_fill(bad[..., None], 0.0)], dim=1)
    points = encoding.positions(rows, start)[:, seen.shape[1] :, : encoding.skeleton.joints]
    return points.masked_fill(bad[..., None, None], torch.nan)
