"""Who survives five minutes of random commands, from validation starts: what was tried, one row each.

    python -m experiments.rnn_gan.steering_attempts [NAME ...] [--seeds 25] [--minutes 5]

The same as the survival of W6 (`steering.survival`), from other starts and by other seeds than those that
are judged. Rule: what is tried is taken in if fewer glide, fall, freeze or go astray than by the row
before it, and none comes apart who did not; else it is left out, and its row stays.

Each row is the code as it is, but for what `ATTEMPTS` says of it.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from pathlib import Path
from unittest.mock import patch

import numpy as np
import torch

import motionlab
from motionlab.solvers.guided import Going
from motionlab.solvers.live_aim import HURRY, SLOWED, Aim
from motionlab.solvers.live_control import LiveControl
from motionlab.solvers.live_frame import Gliding
from motionlab.solvers.live_going import Rows
from motionlab.solvers.run_up import pick_start
from motionlab.training import Prepared

from ..common import record
from .steering import NAME, SURVIVORS, beginnings, survival

SEED = 11  # not the judged one


class AskedGliding(Gliding):
    """Who glides is reminded of the start at the speed that is asked of him, not at his pace."""

    def start_for(self, row: int, going: Going) -> int:
        return pick_start(self.model, None, float(self.asked[row]))


def go_on_told(live: LiveControl, go_on: Callable = LiveControl.go_on) -> list:
    """A window of who knows what is asked when he glides."""
    live.gliding.asked = live.aim.speed
    return go_on(live)


def eased(
    aim: Aim, going: Going | Rows, ahead: float = 0.0, wanted: Callable = Aim.wanted
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """`Aim.wanted`, but who turns gets no faster than `SLOWED`, and the less he is off his way, the more."""
    going = Rows.of(going)
    speed, bend, off = wanted(aim, going, ahead)
    gains = HURRY * (1 - np.abs(off)).clip(0)  # off is in radians
    return np.minimum(speed, np.maximum(going.pace + gains, SLOWED)), bend, off


# of `motionlab.solvers`, what is otherwise in a row than in the code as it is; "before" is of an older code
ATTEMPTS: dict[str, dict[str, float | Callable]] = {
    "facing when slow, rests by pace": {},
    "reminded at the speed that is asked": {
        "live_control.Gliding": AskedGliding,
        "live_control.LiveControl.go_on": go_on_told,
    },
    "who turns gets no faster": {"live_aim.Aim.wanted": eased},
}


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("names", nargs="*", choices=[*ATTEMPTS, []], help="rows; none: all")
    parser.add_argument("--seeds", type=int, default=SURVIVORS // 2)
    parser.add_argument("--minutes", type=float, default=5.0)
    parser.add_argument("--output", type=Path, default=Path("results/steering_attempts.json"))
    chosen = parser.parse_args(arguments)
    torch.set_num_threads(1)
    for name in chosen.names or ATTEMPTS:
        begin = time.perf_counter()
        model = motionlab.load(NAME)
        data = Prepared.find("locomotion").matching(model.encoding)
        with otherwise(ATTEMPTS[name]):
            begun = beginnings(model, data, "walk", "val")
            found = survival(model, begun, chosen.seeds, chosen.minutes, SEED)
        known = json.loads(chosen.output.read_text()) if chosen.output.is_file() else {}
        attempts = known.get("attempts", {}) | {name: found}
        record.write(record.provenance(begin, SEED, data) | {"attempts": attempts}, chosen.output)


def otherwise(changes: dict[str, float | Callable]) -> ExitStack:
    """The solvers with some of their names meaning something else, for as long as it is open."""
    stack = ExitStack()
    for name, value in changes.items():
        stack.enter_context(patch(f"motionlab.solvers.{name}", value))
    return stack


if __name__ == "__main__":
    record.run(main)
