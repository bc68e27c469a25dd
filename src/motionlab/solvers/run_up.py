"""How a character comes to the beginning of a path: walking, at about its speed, the way it leads."""

from __future__ import annotations

import re
from collections.abc import Sequence
from numbers import Integral

import torch
from torch import Tensor

from ..errors import SolverError
from ..metrics import broken
from ..models import LstmGmm, State
from ..models.sampler import Chance
from ..motion import Motion
from ..paths import Curves, Path
from .energy import Before
from .guided import Steering, guided, recently

SECONDS = 1.2  # walked straight ahead before the path begins: a stride
SAMPLES = 6
AVERAGE = 0.8  # seconds that tell which way somebody goes, and how fast
STANDING = 0.3  # m/s
_STEADY = re.compile(r"(walk|run)(?: ([\d.]+) m/s)?$")


def pick_start(model: LstmGmm, start: str | int | None, pace: float) -> int:
    """Which of a model's starts to begin with.

    Parameters
    ----------
    start : its number, or how its name begins, such as "run"; of several, the one whose speed is
        nearest. None: of all that walk or run straight ahead; one that stands, if there is one, for
        a path that begins with a wait.
    pace : m/s that is wanted at first.

    Raises
    ------
    SolverError : there is no such start.
    """
    names = list(getattr(model, "start_names", ()))
    start = str(start) if isinstance(start, Integral) else start
    if start is not None and start.isdecimal() and int(start) < len(names):
        return int(start)
    named = [i for i, name in enumerate(names) if start is not None and name.startswith(start)]
    if start is not None and not (start and named):
        listed = "; ".join(f"{i} {name}" for i, name in enumerate(names))
        raise SolverError(f"start {start!r}: there is none. The model has {listed or 'none'}.")
    speeds = {i: m for i, name in enumerate(names) if (m := _STEADY.match(name)) and m[2]}
    chosen = [i for i in named if i in speeds] or named or [*speeds]
    still = [i for i, name in enumerate(names) if name == "stand"]
    if start is None and pace < STANDING and still:
        return still[0]
    if not chosen:  # starts without speeds in their names
        chosen = [*range(len(model.starts.frame))]
    stepped = model.starts.frame[:, :2].norm(dim=1) * model.fps
    speed = lambda i: float(speeds[i][2]) if i in speeds else float(stepped[i])
    return min(chosen, key=lambda i: abs(speed(i) - pace))


def begin_with(
    model: LstmGmm, start: str | int | Motion | None, paces: Sequence[float]
) -> tuple[State, list[str]]:
    """States (n) that paths at some paces (n) begin with, and what they are called.

    start : as of `pick_start`; or a motion, whose end it is.
    """
    if isinstance(start, Motion):
        state = model.observe(model.encoding.encode(start))
        return state[[0] * len(paces)], [start.name or "a motion"] * len(paces)
    if getattr(model, "starts", None) is None:
        raise SolverError(
            "The model has no starts to begin with; give a motion as start=, or take a model from "
            "motionlab.load."
        )
    chosen = [pick_start(model, start, pace) for pace in paces]
    names = getattr(model, "start_names", ()) or [""] * len(model.starts.frame)
    return model.starts[chosen], [names[i] for i in chosen]


@torch.no_grad()
def run_up(
    model: LstmGmm, begun: State, paths: Sequence[Path], paces: Sequence[float], chance: Chance
) -> Before:
    """The frame before each path's first step, at its beginning, on the way it leads.

    From each state a few characters walk straight ahead for a stride, guided to the pace; the one who
    keeps it best is taken, and put down so that he has been going where the path goes.

    Parameters
    ----------
    model : on `JointAngles`.
    begun : states (n) of the characters.
    paths : (n).
    paces : (n), m/s.
    """
    straight, frames = Curves([Path.through([[0, 0], [0, 100]])]), round(SECONDS * model.fps)
    many = torch.arange(len(paths)).repeat_interleave(SAMPLES)
    state = begun[many]
    nowhere = torch.zeros(len(many), 3, dtype=torch.float64)
    pace = torch.tensor(paces, dtype=torch.float64)[many, None]
    steering = Steering.after(
        straight,
        torch.zeros_like(many),
        model.fps,
        nowhere,
        nowhere[:, 0],
        state.frame[:, None, :3],
    )
    due = pace / model.fps * torch.arange(1, frames + 1)
    s, d = guided(model, Before(state, state.frame, nowhere), steering, due, chance)
    features = model.normalizer.inverse(s)
    _, state = model.read(features, state, d)
    recent = features[:, -round(AVERAGE * model.fps) :, :3].double()
    going, speed, turning = recently(recent, model.fps)
    unlike = (speed - pace[:, 0]).abs() + 0.5 * turning.abs() + 0.5 * going.sin().abs()
    if broken.knows(model.encoding):  # the frame that a path begins with is not searched for
        unlike += (broken.beyond(model.encoding, features[:, -1:])[:, 0] > 0).double()
    best = unlike.nan_to_num(torch.inf).view(len(paths), -1).argmin(1)
    best = best + SAMPLES * torch.arange(len(paths))
    place = beginnings(paths, torch.where(speed < STANDING, 0.0, going)[best])
    return Before(state[best], features[best, -1], place)


def beginnings(paths: Sequence[Path], going: Tensor) -> Tensor:
    """Place (n, 3) at each path's beginning of one who goes `going` (n,) radians off his facing."""
    rows = []
    for path, off in zip(paths, going.tolist(), strict=True):
        ahead = path.places[min(5, len(path.places) - 1)] - path.places[0]
        yaw = torch.atan2(ahead[0], ahead[1]) - off
        rows.append(torch.stack([path.places[0, 0], path.places[0, 1], yaw]))
    return torch.stack(rows)
