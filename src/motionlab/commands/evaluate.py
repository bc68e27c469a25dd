"""`motionlab evaluate`: held-out likelihood, and samples beside the data."""

from __future__ import annotations

import json
import platform
import sys
import time
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Annotated, Literal

from tyro.conf import OmitArgPrefixes, Positional, arg

from ..errors import TrainingError
from .folder import Folder
from .sample import check_generates, check_seed, check_writable, given


@dataclass
class Evaluate:
    """Held-out likelihood of a trained model, and its samples beside the data."""

    model: Positional[Annotated[str, arg(metavar="NAME|WEIGHTS")]]
    """Shipped weights, such as lstm-gmm, or a file of your own."""
    data: Annotated[str, arg(metavar="NAME|FOLDER|FILE")] = "locomotion"
    """Data set, folder of motion files, or what `prepare` wrote."""
    split: Literal["val", "test"] = "val"
    """Clips to compare with; choose by val, report test once."""
    starts: int = 20
    """Number of samples, each from another moment of these clips."""
    seconds: float = 20.0
    """How long each is."""
    temperature: float | None = None
    """Factor on the standard deviations; if left out, what suits the weights."""
    component_temperature: float | None = None
    """The same for the choice among the Gaussians."""
    memory: float | None = None
    """How much of its chance a frame keeps from the one before, from 0 to less than 1."""
    noise: float | None = None
    """Standard deviation of the noise on the inputs, in normalised units."""
    seed: int = 0
    """Start of all chance."""
    out: Path | None = None
    """File for the numbers, as JSON."""
    folder: OmitArgPrefixes[Folder] = field(default_factory=Folder)

    def run(self) -> None:
        from ..training import Prepared
        from ..training.checkpoints import write_whole
        from ..training.evaluation import evaluate
        from ..version import __version__
        from ..weights import load

        begin = time.perf_counter()
        check_seed(self.seed)
        if self.out is not None:
            check_writable(self.out)
        model = load(self.model)
        check_generates(model, self.model)
        sampling = model.sampling | given(self, model)
        data = Prepared.find(self.data, **self.folder.reading())
        found = evaluate(
            model, data, self.split, starts=self.starts, seconds=self.seconds, seed=self.seed,
            **sampling,
        )  # fmt: skip
        print(f"{self.model}: {found.log_likelihood} nats a frame, "
              f"{found.log_likelihood.clips} clips of {self.split}\n")  # fmt: skip
        print(f"{'':28} {f'{found.starts} samples':22} {self.split}")
        for metric, real in found.data.items():
            print(f"{metric:28} {found.samples.get(metric, 'none lasted')!s:22} {real}")
        if sampling:
            print("\nsampled with " + ", ".join(f"{k} {v:g}" for k, v in sampling.items()))
        print(f"\nfrozen {found.frozen}, diverged {found.diverged} of {found.starts} within "
              f"{self.seconds:g} s")  # fmt: skip
        if self.out is None:
            return
        result = {
            "command": " ".join(["motionlab", *sys.argv[1:]]),
            "code_version": __version__,
            "weights": model.hash,
            "data_hash": data.hash,
            "seed": self.seed,
            "sampling": sampling,
            "split": self.split,
            "seconds_each": self.seconds,
            **_named(asdict(found)),
            "machine": platform.platform(),
            "seconds": round(time.perf_counter() - begin, 1),
        }
        text = json.dumps(result, indent=1, ensure_ascii=False) + "\n"
        try:
            write_whole(self.out, lambda stream: stream.write(text.encode()))
        except OSError as error:
            raise TrainingError(f"{self.out}: can't be written ({error.strerror}).") from error


def _named(found: dict) -> dict:
    """Intervals as objects with names; JSON would make bare lists of them."""
    return {
        key: value._asdict() if isinstance(value, tuple)
        else _named(value) if isinstance(value, dict) else value
        for key, value in found.items()
    }  # fmt: skip
