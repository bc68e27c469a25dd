"""How much noise on what it sees of itself suits a dancer: the choice, on validation clips.

    python -m experiments.aclstm.noise

A dancer without noise has one future, and a few minutes of data have few: it ends in a loop. With
noise it no longer repeats itself exactly. A minute and a half of dance from twenty moments of the
validation clips, at several levels; dancers ship with the least at which none loops.
`rollouts.py` tells what it does on held-out clips.
"""

from __future__ import annotations

import argparse
import hashlib
import time
from collections.abc import Sequence

import motionlab
from motionlab import weights

from ..common import record
from . import dances
from .rollouts import ELASTIC, real_of, told

LEVELS = (0.0, 0.1, 0.2, 0.3)  # standard deviation, in normalised units


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--starts", type=int, default=20)
    parser.add_argument("--seconds", type=float, default=90.0)
    parser.add_argument("--output", default="results/dances_noise.json")
    chosen = parser.parse_args(arguments)
    begin, found, hashes, shas = time.perf_counter(), {}, {}, {}
    for name in (name for name in weights.names() if name.startswith("aclstm-")):
        style, model = name.partition("-")[2], motionlab.load(name)
        seen = dances.seeds(style, chosen.starts, model.fps, "val").seen
        hashes[style] = dances.of(style).hash
        shas[name] = hashlib.sha256(weights.find(name).read_bytes()).hexdigest()
        frames, real = round(chosen.seconds * model.fps), real_of(style, model.fps)
        found[name] = {
            f"{noise:g}": _short(told(model, real, seen, frames, noise)) for noise in LEVELS
        }
        print(name, found[name], flush=True)
    facts = record.provenance(begin, 0, dances.of("indian"), data_hashes=hashes)
    result = {
        "starts": chosen.starts, "seconds": chosen.seconds, "weights, sha256": shas,
        "dancers": found,
    }  # fmt: skip
    record.write(facts | result, chosen.output)


def _short(its: dict) -> dict:
    return {
        "alive": its["alive"], "alive if bones may stretch": its[ELASTIC]["alive"],
        "in a loop": its["cycles"]["in a loop"],
        "same end as another": its["cycles"]["same end as another"],
        "change over real": its[ELASTIC]["change"]["whole"],
        "acceleration over real": its.get("acceleration over real, first minute"),
    }  # fmt: skip


if __name__ == "__main__":
    record.run(main)
