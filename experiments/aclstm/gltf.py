"""Z8: a dance of a shipped dancer as a glTF file with a body, and what the Khronos validator says.

    python -m experiments.aclstm.gltf [--model aclstm-martial]

Needs node, and the player's packages (npm ci, in web/).
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import time
from collections.abc import Sequence
from pathlib import Path

import torch

import motionlab
from motionlab import io, metrics
from motionlab.weights import find

from ..common import record
from . import dances

VALIDATOR = Path(__file__).parents[2] / "tests" / "io" / "gltf_in_node.mjs"
ERROR = 0  # the validator's number of the severity


@torch.no_grad()
def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument(
        "--model", default="aclstm-martial", help="shipped name, or file of weights"
    )
    parser.add_argument("--seconds", type=float, default=20.0)
    parser.add_argument("--file", default="runs/dances/dance.glb", help="where to write the dance")
    parser.add_argument("--output", default="results/dances_gltf.json")
    chosen = parser.parse_args(arguments)
    begin = time.perf_counter()
    model, weights = motionlab.load(chosen.model), find(chosen.model)
    features = model.generate(round(chosen.seconds * model.fps), model.starts[0])[0]
    motion = model.encoding.to_motion(features, name="dance")
    away = metrics.mean_joint_error(motion.positions(), model.encoding.positions(features))
    Path(chosen.file).parent.mkdir(parents=True, exist_ok=True)
    io.write_gltf(motion, chosen.file, color="acLSTM")
    messages = validated(Path(chosen.file))
    result = {
        "weights": record.about_weights(model, weights),
        "frames": len(motion), "joints": motion.skeleton.joints,
        "bytes": Path(chosen.file).stat().st_size,
        "from the network's points, mean (cm)": float(away.mean()),
        "errors": sum(message["severity"] == ERROR for message in messages),
        "warnings": sum(message["severity"] != ERROR for message in messages),
        "messages": [message["message"] for message in messages[:10]],
    }  # fmt: skip
    facts = record.provenance(begin, 0, dances.of("martial"))
    record.write(facts | result, chosen.output)


def validated(path: Path) -> list[dict]:
    """Errors and warnings of the Khronos glTF validator."""
    ran = subprocess.run(["node", VALIDATOR, path], capture_output=True, text=True)
    if ran.returncode:
        said = f"the validator did not run; `npm ci` in web/. {ran.stderr[-500:]}"
        sys.exit(f"{record.script()[-1]}: {said}")
    return next(iter(json.loads(ran.stdout).values()))


if __name__ == "__main__":
    record.run(main)
