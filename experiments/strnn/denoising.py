"""Noise taken away by an STRNN, beside a convolutional autoencoder, filters, and the best linear guess.

    python -m experiments.strnn.denoising STRNN SC --data runs/everything.npz [--split val]
        [--windows 512] [--output results/strnn_denoising.json]

White noise lies on the coordinates of all joints but the root, in deviations of the training frames; in
two rows on contact bits, too, which are rounded then. Widths of filters, and how often STRNN's windows
overlap, are chosen on validation clips, for each row. Errors are mean squares in deviations, and mean
distances of joints in centimetres.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import NamedTuple

import torch
from scipy.ndimage import gaussian_filter1d
from scipy.signal import savgol_filter
from torch import Tensor, nn

import motionlab
from motionlab.errors import DataError
from motionlab.models import ConvAutoencoder, Strnn
from motionlab.models.wiener import Wiener
from motionlab.training import Prepared
from motionlab.training.strnn import in_body_frame
from motionlab.training.windows import Windows

from ..common import record

FRAMES = 60  # of a window
# Noise on positions, and on contact bits; the first row is of clean frames.
ROWS = {
    "clean": (0.0, 0.0), "positions 0.1": (0.1, 0.0), "positions 0.2": (0.2, 0.0),
    "positions 0.3": (0.3, 0.0), "positions 0.3, contacts 3": (0.3, 3.0),
    "positions 0.3, contacts 5": (0.3, 5.0),
}  # fmt: skip
GAUSSIANS = (0.5, 0.7, 1.0, 1.3, 1.6, 2.0, 2.5, 3.0, 4.0)  # frames
SAVITZKY = tuple((width, order) for width in (5, 7, 9, 11, 15, 19) for order in (2, 3, 4))
STEPS = (1, 2, 5, 10, 20)
WIENER_FRAMES, WIENER_STEP = 20, 10
CLEAN = 1e-3  # deviations, of noise in channels that have none, so that they can be believed

Method = Callable[[Tensor], Tensor]


class Seen(NamedTuple):
    """Windows (windows, frames, dim) as they are, and with noise."""

    clean: Tensor
    noisy: Tensor


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("strnn", type=Path)
    parser.add_argument("sc", type=Path)
    parser.add_argument("--data", default="everything")
    parser.add_argument("--split", default="val", choices=("val", "test"))
    parser.add_argument("--windows", type=int, default=512)
    parser.add_argument("--output", default="results/strnn_denoising.json")
    chosen = parser.parse_args(arguments)
    begin = time.perf_counter()
    strnn, sc = network(chosen.strnn, Strnn), network(chosen.sc, ConvAutoencoder)
    data = in_body_frame(Prepared.find(chosen.data)).matching(strnn.encoding)
    rows = {}
    for title, noise in ROWS.items():
        tuning = windows(data, "val", chosen.windows, noise, seed=1)
        judged = windows(data, chosen.split, chosen.windows, noise, seed=2)
        rows[title] = row(data, strnn, sc, tuning, judged)
    result = {
        "split": chosen.split, "windows": chosen.windows, "frames": FRAMES, "rows": rows,
        "weights": {
            "strnn": record.about_weights(strnn, chosen.strnn),
            "sc": record.about_weights(sc, chosen.sc),
        },
    }  # fmt: skip
    record.write(record.provenance(begin, 0, data) | result, chosen.output)


def network(path: Path, kind: type[nn.Module]) -> nn.Module:
    """Weights of one kind; raises DataError for others."""
    model = motionlab.load(path)
    if not isinstance(model, kind):
        raise DataError(f"{path}: is a {type(model).__name__}; a {kind.__name__} is asked for.")
    return model


def windows(
    data: Prepared, split: str, count: int, noise: tuple[float, float], seed: int
) -> Seen:  # fmt: skip
    """Windows of a split, the same for every noise of a seed, and what is seen of them."""
    chance = torch.Generator().manual_seed(seed)
    clean = Windows(data.clips(split), FRAMES).draw(count, chance)
    positions, contacts = noise
    spread = torch.zeros(data.encoding.dim)
    pose, bits = (data.encoding.slices[part] for part in ("pose", "contacts"))
    spread[pose] = positions * data.normalizer.std[pose]
    spread[bits] = contacts  # of bits as they are
    noisy = clean + spread * torch.randn(clean.shape, generator=chance)
    if contacts:
        noisy[..., bits] = (noisy[..., bits] > 0.5).float()
    return Seen(clean, noisy)


def row(
    data: Prepared, strnn: Strnn, sc: ConvAutoencoder, tuning: Seen, judged: Seen
) -> dict[str, dict]:
    """What every method leaves of one noise; filters have nothing to do where there is none."""
    found = {
        "nothing": errors(data, judged.noisy, judged.clean),
        "sc": errors(data, sc.project(judged.noisy), judged.clean),
        "strnn, reconstructed": errors(data, strnn.reconstruct(judged.noisy), judged.clean),
    }
    ways = {f"a window every {step} frames": lambda seen, step=step: strnn.project(seen, step)
            for step in STEPS if step <= strnn.encode}  # fmt: skip
    found["strnn"] = tuned(data, ways, tuning, judged)
    if torch.equal(judged.noisy, judged.clean):
        return found
    found["gaussian"] = tuned(data, gaussians(data), tuning, judged)
    found["savitzky-golay"] = tuned(data, savitzky(data), tuning, judged)
    off = (tuning.noisy - tuning.clean) / data.normalizer.std
    spread = off.square().mean((0, 1)).sqrt().clamp(min=CLEAN)
    wiener = Wiener.fit(data.encoding, data.normalizer, data.clips("train"), spread,
                        WIENER_FRAMES, step=WIENER_STEP)  # fmt: skip
    found["wiener"] = errors(data, wiener.project(judged.noisy), judged.clean)
    return found


def tuned(data: Prepared, ways: dict[str, Method], tuning: Seen, judged: Seen) -> dict:
    """The way that is best on validation clips, judged."""
    error = {
        name: errors(data, way(tuning.noisy), tuning.clean)["squared error"]
        for name, way in ways.items()
    }
    best = min(error, key=error.get)
    return errors(data, ways[best](judged.noisy), judged.clean) | {"chosen": best}


def errors(data: Prepared, found: Tensor, clean: Tensor) -> dict[str, float]:
    """Of joints relative to the root, (windows, frames, dim) each."""
    pose = data.encoding.slices["pose"]
    off = (data.normalizer.std.reciprocal() * (found - clean))[..., pose]
    apart = (found - clean)[..., pose].unflatten(-1, (-1, 3)).norm(dim=-1)
    return {
        "squared error": float(off.square().mean()),
        "mean joint error (cm)": float(100 * apart.mean()),
    }


def gaussians(data: Prepared) -> dict[str, Method]:
    """Gaussian filters over time, on what noise lies on."""
    run = lambda sigma: lambda frames: gaussian_filter1d(frames, sigma, axis=1, mode="nearest")
    return {f"{sigma:g} frames": over_time(data, run(sigma)) for sigma in GAUSSIANS}


def savitzky(data: Prepared) -> dict[str, Method]:
    """Savitzky-Golay filters over time."""
    run = lambda width, order: lambda frames: savgol_filter(frames, width, order, axis=1)
    return {
        f"{width} frames, order {order}": over_time(data, run(width, order))
        for width, order in SAVITZKY
        if order < width
    }


def over_time(data: Prepared, run: Callable) -> Method:
    """A filter of arrays (windows, frames, channels) as a method that leaves other channels alone."""
    pose = data.encoding.slices["pose"]

    def method(seen: Tensor) -> Tensor:
        found = seen.clone()
        found[..., pose] = torch.from_numpy(run(seen[..., pose].numpy())).to(seen)
        return found

    return method


if __name__ == "__main__":
    record.run(main)
