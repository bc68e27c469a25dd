"""Who survives five minutes of random commands, from validation starts: what was tried, one row each.

    python -m experiments.rnn_gan.steering_attempts NAME [--seeds 50] [--minutes 5]

The same as the survival of W6 (`steering.survival`), from other starts and by other seeds than those that
are judged. Rule: what is tried is taken in if fewer glide, fall, freeze or go astray than by the row
before it, and none comes apart who did not; else it is left out, and its row stays.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Sequence
from pathlib import Path

import torch

import motionlab
from motionlab.training import Prepared

from ..common import record
from .steering import NAME, SURVIVORS, beginnings, survival

SEED = 11  # not the judged one


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("name", help="of what is tried: the code as it is now")
    parser.add_argument("--seeds", type=int, default=SURVIVORS)
    parser.add_argument("--minutes", type=float, default=5.0)
    parser.add_argument("--output", type=Path, default=Path("results/steering_attempts.json"))
    chosen = parser.parse_args(arguments)
    begin = time.perf_counter()
    torch.set_num_threads(1)
    model = motionlab.load(NAME)
    data = Prepared.find("locomotion").matching(model.encoding)
    begun = beginnings(model, data, "walk", "val")
    found = survival(model, begun, chosen.seeds, chosen.minutes, SEED)
    known = json.loads(chosen.output.read_text()) if chosen.output.is_file() else {}
    attempts = known.get("attempts", {}) | {chosen.name: found}
    record.write(record.provenance(begin, SEED, data) | {"attempts": attempts}, chosen.output)


if __name__ == "__main__":
    record.run(main)
