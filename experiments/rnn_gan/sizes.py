"""W10: is the generator smaller than what it was trained on?

python -m experiments.rnn_gan.sizes [--model lstm-gmm]
"""

from __future__ import annotations

import argparse
import lzma
import time

import numpy as np
import torch

import motionlab
from motionlab.datasets.registry import choose
from motionlab.training import Prepared
from motionlab.weights import find

from ..common import record

PAPER = {"weights": 41e6, "data": 133e6}  # "Mb" in section 6, taken for megabytes


def main(arguments: list[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--model", default="lstm-gmm")
    parser.add_argument("--data", default="locomotion")
    parser.add_argument("--output", default="results/sizes.json")
    chosen = parser.parse_args(arguments)
    begin = time.perf_counter()
    model, path = motionlab.load(chosen.model), find(chosen.model)
    data = Prepared.find(chosen.data).without_contacts()
    used = {f"{c.source}/{c.name}": c for c in choose(chosen.data) if c.split != "test"}
    rows = torch.cat(
        [
            clip for name, clip in zip(data.names, data.features.split(data.lengths.tolist()),
                                       strict=True) if name in used
        ]
    )[:, data.normalizer.kept]  # fmt: skip
    numbers = sum(tensor.numel() for tensor in model.parameters())
    result = {
        "weights": record.about_weights(model, path),
        "parameters": numbers,
        "weights (bytes)": {"half": path.stat().st_size, "float32": 4 * numbers},
        "data (bytes)": {
            "BVH files": sum(clip.bytes for clip in used.values()),
            "float32 features": rows.numel() * 4,
            "8 bit features, compressed": quantised(rows.numpy()),
        },
        "clips": len(used),
        "frames": len(rows),
        "minutes": len(rows) / data.encoding.fps / 60,
        "paper (bytes)": PAPER,
    }
    record.write(record.provenance(begin, 0, data) | result, chosen.output)


def quantised(rows: np.ndarray) -> int:
    """Bytes of features (frames, dim) as 8 bit numbers, each channel from its least to its greatest
    value, channel after channel as differences in time, by xz; with the range of each channel."""
    low, high = rows.min(0), rows.max(0)
    steps = np.round((rows - low) / (high - low) * 255).astype(np.uint8)
    change = np.diff(steps, axis=0, prepend=steps[:1] * 0)  # wraps round, which can be undone
    packed = lzma.compress(np.ascontiguousarray(change.T).tobytes(), preset=9)
    return len(packed) + low.nbytes + high.nbytes


if __name__ == "__main__":
    record.run(main)
