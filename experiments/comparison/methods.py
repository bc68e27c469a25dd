"""The rows of the table: which weights, used how.

Rows "as it ships" have the weights that people get, trained for longer, each as its chapter says; rows "equal
budget" were trained for this table. An acLSTM ships for dancers on other bodies only: it has no such row.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path

from torch import nn

import motionlab
from motionlab.training import Prepared
from motionlab.training.finish import OBSERVED, fit_temperature
from motionlab.weights import find

from . import going_on, led, trainings
from .going_on import GoOn

SHIPS, EQUAL, FLOOR = "as it ships", "equal budget", "nobody trained it"
PFNN = Path("runs/pfnn-ship/best.safetensors")
SAME_AS = "as {}: what is done to its motion takes no part in what comes next"
DEAR = "a search of minutes a start"


@dataclass(frozen=True, eq=False)
class Method:
    """One training of a row, ready to go on from motion.

    files : of its weights. seen : frames that it was trained on, None if that is not known alike.
    few : as many starts as there is time for. without : columns that are left out, and why.
    """

    name: str
    kind: str
    what: str
    go_on: GoOn
    networks: tuple[nn.Module, ...] = ()
    files: tuple[Path, ...] = ()
    seen: int | None = None
    seed: int | None = None
    few: bool = False
    without: dict[str, str] = field(default_factory=dict)

    @property
    def title(self) -> str:
        return self.name if self.kind == FLOOR else f"{self.name}, {self.kind}"

    @property
    def parameters(self) -> int:
        return sum(p.numel() for network in self.networks for p in network.parameters())

    @property
    def bytes(self) -> int:
        return sum(path.stat().st_size for path in self.files)

    @property
    def hash(self) -> str:
        """What tells its weights from others."""
        return "-".join(network.hash[:8] for network in self.networks) or "none"


def shipped(pfnn: Path = PFNN) -> Iterator[Method]:
    """Weights that people get, and ours of the PFNN, which `motionlab train` makes."""
    plain, contact = motionlab.load("lstm-gmm"), motionlab.load("lstm-gmm-contacts")
    refiners = motionlab.load("refiner"), motionlab.load("refiner-contacts")
    strnn = motionlab.load("strnn")
    one, two = (plain, refiners[0]), (contact, refiners[1])
    files = lambda *names: tuple(find(name) for name in names)
    seen = lambda *networks: sum(frames_of(network) for network in networks)
    angles = lambda model, *more: going_on.angles(model, model.sampling, *more)
    yield Method("RNN", SHIPS, "lstm-gmm", angles(plain), (plain,), files("lstm-gmm"), seen(plain))
    yield Method("GAN1", SHIPS, "RNN, refined", angles(*one), one, files("lstm-gmm", "refiner"),
                 seen(*one), without={"alive": SAME_AS.format("RNN")})  # fmt: skip
    both = files("lstm-gmm-contacts", "refiner-contacts")
    yield Method("GAN2", SHIPS, "with contacts, refined", angles(*two), two, both, seen(*two))
    yield Method("GAN2+lock", SHIPS, "and its feet locked", angles(*two, True), two, both,
                 seen(*two), without={"alive": SAME_AS.format("GAN2")})  # fmt: skip
    yield Method("GAN2+lock on a path", SHIPS, "its root held to a straight line, at its pace",
                 going_on.along_path(*two), two, both, seen(*two), few=True,
                 without={"alive": DEAR, "variety": DEAR, "256": DEAR})  # fmt: skip
    yield Method("STRNN", SHIPS, "trained on dances and more besides", going_on.body_frame(strnn),
                 (strnn,), files("strnn"), seen(strnn))  # fmt: skip
    if pfnn.is_file():
        network = motionlab.load(pfnn)
        yield Method("PFNN", SHIPS, "ours, preset ship; led straight on at its pace",
                     led.led(network), (network,), (pfnn,), seen(network))  # fmt: skip
    yield Method("constant velocity", FLOOR, "every joint goes on as it went", going_on.straight_on)


def trained(data: Prepared, seeds: tuple[int, ...] = trainings.SEEDS) -> Iterator[Method]:
    """Those of the table's own trainings that are done, seed by seed."""
    for row in trainings.ROWS:
        for seed in seeds:
            run = trainings.run_of(row.name, seed)
            path = trainings.weights_of(run)
            if path is not None:
                model = motionlab.load(path)
                yield Method(row.name, EQUAL, row.what, goes(row.name, model, data),
                             (model,), (path,), trainings.frames_seen(run.preset), seed)  # fmt: skip


def goes(name: str, model: nn.Module, data: Prepared) -> GoOn:
    """How a network of a row of `trainings` goes on; a mixture's temperature is fitted on validation
    clips, as for those that ship."""
    if name == "RNN":
        clips = data.matching(model.encoding).clips("val")
        long = [clip for clip in clips if len(clip) >= OBSERVED * model.fps]
        fitted = cache(lambda: fit_temperature(model, long, seconds=10.0))
        return lambda begun, frames, seed, quiet=False: going_on.angles(
            model, {"temperature": fitted()}
        )(begun, frames, seed, quiet)
    makers = {"acLSTM": going_on.around_root, "STRNN": going_on.body_frame, "PFNN": led.led}
    return makers[name](model)


def frames_of(network: nn.Module) -> int:
    """Frames that shipped weights were trained on: updates x batch x frames, or those of a game."""
    its = network.about["preset"]
    frames = 1 if "sparsity" in its else its["frames"]
    return its.get("updates", its.get("steps")) * its["batch"] * frames
