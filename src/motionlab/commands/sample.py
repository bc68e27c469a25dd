"""`motionlab sample`: motion out of shipped or own weights, as BVH or GLB."""

from __future__ import annotations

import inspect
import math
import os
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from tyro.conf import Positional, arg

from ..errors import MotionLabError, TrainingError
from .choices import RootMotion, way_of
from .clips import check_no_fbx
from .programs import ANY
from .rig import Rig, brought_onto

if TYPE_CHECKING:
    from torch import nn

    from ..motion import Motion

LONG, MOST = 30_000, 1_000_000  # frames, of all characters: some ten seconds of work; of memory


@dataclass(kw_only=True)
class Sample(Rig):
    """Motion out of a trained model, as BVH or GLB: it goes on from a start as it likes."""

    model: Positional[Annotated[str, arg(metavar="NAME|WEIGHTS")]]
    """Shipped weights, such as lstm-gmm, or a file of your own."""
    out: Path
    """File to write; with several characters walk.bvh becomes walk_1.bvh, walk_2.bvh, ..."""
    seconds: float = 10.0
    """How long."""
    start: Annotated[str | None, arg(metavar="INDEX|NAME")] = None
    """Start by number or by how its name begins; if left out, each character gets another one."""
    temperature: float | None = None
    """Factor on the standard deviations; if left out, what suits the weights."""
    component_temperature: float | None = None
    """The same for the choice among the Gaussians."""
    memory: float | None = None
    """How much of its chance a frame keeps from the one before, from 0, the paper's, to less than 1:
    with 0.9 samples differ more, and tremble less."""
    noise: float | None = None
    """Standard deviation of the noise on the inputs, in normalised units."""
    seed: int = 0
    """Start of all chance."""
    characters: int = 1
    """How many, each with a chance of its own."""
    refine: bool = False
    """Let the shipped refiner correct it, so that feet slide less."""
    refiner: Annotated[str | None, arg(metavar="NAME|WEIGHTS")] = None
    """Let this one correct it: weights of your own."""
    lock_feet: Annotated[bool, arg(name="lock-feet")] = False
    """Hold toes still while they are in contact: as the network says, or else while they are slow."""
    skeleton: Annotated[str | None, arg(metavar="RIG|canonical")] = None
    """Bring the motion to this rig: a file in which a person stands, at rest or in a frame."""
    root_motion: RootMotion = None
    """ground: a root joint on the floor carries way and heading, as game engines want; in-place:
    these are left out; none, as if left out: they stay with the body."""

    def run(self) -> None:
        import torch

        from ..weights import load

        root_motion = way_of(self.root_motion)
        rig = None if self.skeleton is None else self.find_rig(self.skeleton)
        model = load(self.model)
        check_generates(model, self.model)
        refiner = None
        if self.refine or self.refiner is not None:
            refiner = refiner_of(model, self.model, self.refiner)
        paths, frames = self._paths(), self._frames(model.fps)
        chosen = self._starts(model.start_names)
        check_seed(self.seed)
        for path in paths:
            check_writable(path)
        sampling = model.sampling | given(self, model)
        if "temperature" not in sampling and hasattr(model, "components"):
            print("These weights have no temperature of their own, so it is 1, as learned. If the "
                  "body shakes, take less: --temperature 0.3", flush=True)  # fmt: skip
        if frames * len(paths) >= LONG:
            print(f"{frames * len(paths)} frames; this takes a while", flush=True)
        with torch.no_grad():
            features = model.generate(
                frames, model.starts[chosen],
                generator=torch.Generator().manual_seed(self.seed), **sampling,
            )  # fmt: skip
            if refiner is not None:
                features = refiner(features)
        motions = [
            model.encoding.to_motion(each, name=path.stem, source=self.model)
            for each, path in zip(features, paths, strict=True)
        ]
        if self.lock_feet:
            motions = [locked(motion) for motion in motions]
        for motion, path, start in zip(motions, paths, chosen, strict=True):
            said = []
            if self.skeleton is not None:
                motion, said = brought_onto(motion, rig)
            said += self.write(motion, path, root_motion)
            about = f"{motion.seconds:.1f} s from {model.start_names[start]!r}"
            print(f"{path}: {'; '.join([about, *said])}")

    def _frames(self, fps: float) -> int:
        if not 0 < self.seconds < math.inf:
            raise MotionLabError(f"--seconds {self.seconds}: must be a number above 0.")
        if not (frames := round(self.seconds * fps)):
            raise MotionLabError(
                f"--seconds {self.seconds}: is no frame yet; one lasts {1 / fps:.3f} seconds."
            )
        if frames * self.characters > MOST:
            raise MotionLabError(
                f"--seconds {self.seconds:g}: at most {MOST / fps:.0f} seconds at once, of all "
                "characters together; ask for several files, each with another --seed."
            )
        return frames

    def _paths(self) -> list[Path]:
        if not 1 <= self.characters <= 1000:
            raise MotionLabError(f"--characters {self.characters}: must be 1 to 1000.")
        if self.out.suffix.lower() not in ANY.endings:
            check_no_fbx(self.out)
            raise MotionLabError(
                f"--out {self.out}: the name must end in {' or '.join(ANY.endings)}."
            )
        if self.characters == 1:
            paths = [self.out]
        else:
            numbers = range(1, self.characters + 1)
            paths = [self.out.with_stem(f"{self.out.stem}_{number}") for number in numbers]
        return paths

    def _starts(self, names: tuple[str, ...]) -> list[int]:
        """Index of the start of each character."""
        if self.start is None:
            return [number % len(names) for number in range(self.characters)]
        if self.start.isdecimal() and int(self.start) < len(names):
            return [int(self.start)] * self.characters
        found = [i for i, name in enumerate(names) if name.startswith(self.start)]
        if self.start and found:
            return [found[0]] * self.characters
        listed = "; ".join(f"{i} {name}" for i, name in enumerate(names))
        raise MotionLabError(f"--start {self.start}: there is none. {self.model} has {listed}.")


def locked(motion: Motion) -> Motion:
    """The motion with its toes held still on the level where they rest."""
    from ..feet.contacts import label
    from ..feet.lock import lock_feet

    found = label(motion) if motion.contacts is None else motion.contacts
    return lock_feet(motion, found, floor=None)


def refiner_of(model: nn.Module, called: str, named: str | None = None) -> nn.Module:
    """What corrects motion of a model: the refiner that is named, or the shipped one that suits it.

    Raises
    ------
    MotionLabError : it is no refiner, or refines features of another kind.
    """
    from ..models import Refiner
    from ..weights import load, names

    its = called.replace("lstm-gmm", "refiner")  # as shipped weights are called
    if its == called or its not in names():
        its = "refiner-contacts" if "contacts" in model.encoding.slices else "refiner"
    name = named or its
    refiner = load(name)
    if not isinstance(refiner, Refiner):
        raise MotionLabError(f"--refiner {name}: is no refiner, but {type(refiner).__name__}.")
    if refiner.encoding.config() != model.encoding.config():
        if named is None:
            raise MotionLabError(
                f"{called} has no refiner: those that ship correct what lstm-gmm, lstm-gmm-contacts "
                "and lstm-gmm-permissive make. Leave --refine out."
            )
        raise MotionLabError(
            f"{name} refines features of another kind than {called}'s: with contacts or "
            "without, as angles or not, of another body or frame rate."
        )
    made_for = refiner.about.get("generator_hash")
    if made_for not in (None, model.hash):
        print(f"{name} learned to correct motion of another generator than {called}; it may "
              "help less, and its licence holds as well", flush=True)  # fmt: skip
    return refiner


def check_generates(model: nn.Module, name: str) -> None:
    """Raise MotionLabError for weights that make no motion of their own."""
    if hasattr(model, "layout"):
        raise MotionLabError(
            f"{name}: is a PFNN, which makes no motion of its own; it is led along a path: "
            f"motionlab.models.pfnn.follow(motionlab.load({name!r}), [points], speed=1.2)."
        )
    if hasattr(model, "extrapolate"):
        raise MotionLabError(
            f"{name}: is an STRNN, which goes on from frames and not from a state: "
            f"motionlab.load({name!r}).extrapolate(features, 300)."
        )
    if hasattr(model, "project"):
        raise MotionLabError(
            f"{name}: is a {type(model).__name__}, which says motion again and makes none: "
            f"motionlab.load({name!r}).project(features)."
        )
    if not hasattr(model, "generate"):
        raise MotionLabError(
            f"{name}: is a {type(model).__name__.lower()}, which corrects motion and makes none; name "
            f"a generator, and it as `motionlab sample lstm-gmm --refiner {name}`."
        )


def given(command: object, model: nn.Module) -> dict[str, float]:
    """Arguments of the model's `generate` that the command line names.

    Raises MotionLabError if it has one of them not.
    """
    keys = ("temperature", "component_temperature", "memory", "noise")
    named = {key: getattr(command, key) for key in keys if getattr(command, key) is not None}
    for key in named.keys() - inspect.signature(model.generate).parameters.keys():
        raise MotionLabError(
            f"--{key.replace('_', '-')}: {type(model).__name__} has none, since it draws from no "
            "Gaussians; leave it out. It has --noise."
        )
    return named


def check_seed(seed: int) -> None:
    """Raise TrainingError for what no generator of chance takes."""
    if not 0 <= seed < 2**32:
        raise TrainingError(f"--seed {seed}: must be a whole number from 0 to {2**32 - 1}.")


def check_writable(path: Path) -> None:
    """Before long work: raise TrainingError if no file can be made there."""
    if path.is_dir():
        raise TrainingError(f"{path}: is a folder; name a file.")
    try:
        with tempfile.TemporaryFile(dir=os.fspath(path.parent)):
            pass
    except OSError as error:
        raise TrainingError(f"{path.parent}: can't be written to ({error.strerror}).") from error
