"""What a network loses when its weights are rounded to a byte each, as a page has them.

python -m experiments.shipping.rounding [--split test]
"""

from __future__ import annotations

import argparse
import time

import torch

import motionlab
from motionlab.training import Prepared
from motionlab.viewer.live.network_weights import as_in_browser, weights_script
from motionlab.weights import find

from ..common import record
from ..rnn_gan.contact_likelihood import a_frame

MODELS = ("lstm-gmm", "lstm-gmm-contacts")


@torch.no_grad()
def main(arguments: list[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--data", default="locomotion")
    parser.add_argument("--split", default="test", choices=("val", "test"))
    parser.add_argument("--output", default="results/rounding.json")
    chosen = parser.parse_args(arguments)
    begin = time.perf_counter()
    data = Prepared.find(chosen.data)
    clips = [clip for clip in data.clips(chosen.split) if len(clip) > 1]
    lengths = [len(clip) - 1 for clip in clips]
    result = {"split": chosen.split, "clips": len(clips), "frames": sum(lengths)}
    for name in MODELS:
        model, path = motionlab.load(name), find(name)
        dim = model.encoding.dim  # contacts come last; one generator has none
        whole, rounded = (
            [float(each.log_prob(clip[None, :, :dim]).sum()) for clip in clips]
            for each in (model, as_in_browser(model))
        )
        change = [b - a for a, b in zip(whole, rounded, strict=True)]
        result[name] = {
            "weights": record.about_weights(model, path),
            "bytes": {
                "half precision": path.stat().st_size,
                "rounded, as a script": len(weights_script(model, name).text),
            },
            "nats a frame": {
                "half precision": a_frame(whole, lengths),
                "rounded": a_frame(rounded, lengths),
                "rounded minus half precision": a_frame(change, lengths),
            },
        }
    record.write(record.provenance(begin, 0, data) | result, chosen.output)


if __name__ == "__main__":
    record.run(main)
