"""`motionlab train`: from prepared motion, or a name, to weights."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from tyro.conf import OmitArgPrefixes, Positional, arg

from ..errors import MotionLabError
from .folder import Folder
from .sample import check_generates

if TYPE_CHECKING:
    from ..training import Preset
    from ..training.games import GamePreset


@dataclass
class Train:
    """Train a model; started again, it goes on where it was stopped."""

    model: Positional[str]
    """lstm-gmm, lstm-gmm-contacts, lstm-gmm-permissive (with contacts, on the clips that are free
    for commercial use); pfnn; strnn, and its ablations, such as strnn-temporal;
    conv-autoencoder, its rival; refiner, refiner-contacts, refiner-permissive of the first three;
    or METHOD-STYLE, such as
    aclstm-indian: one of the methods aclstm, lstm-3lr, scheduled, erd, seq2seq on one of the
    styles martial, indian, hybrid, walking."""
    preset: Literal["smoke", "table", "ship", "paper"] = "table"
    """How long and how large; see motionlab.training.presets, and games for refiners."""
    data: Annotated[str | None, arg(metavar="NAME|FOLDER|FILE")] = None
    """Data set, folder of motion files, or what `prepare` wrote; locomotion or the style if left out."""
    start: Annotated[str | None, arg(name="from", metavar="NAME|WEIGHTS")] = None
    """Weights to begin with, for fine-tuning; of a refiner: the generator that it is to refine."""
    out: Path | None = None
    """Folder to write to; runs/MODEL-PRESET if left out."""
    updates: int | None = None
    """Other number of updates (of a refiner: steps) than the preset's, also for a training under
    way."""
    learning_rate: float | None = None
    """Other learning rate than the preset's; not for refiners, which have two."""
    seed: int | None = None
    """Other seed than the preset's."""
    accelerator: str = "auto"
    """cpu, cuda, mps."""
    devices: int = 1
    """Processes, one a device."""
    nodes: int = 1
    """Machines."""
    folder: OmitArgPrefixes[Folder] = field(default_factory=Folder)

    def run(self) -> None:
        from ..training import GAMES, PRESETS

        out = self.out or Path("runs") / f"{self.model}-{self.preset}"
        if self.model in GAMES:
            self._play(GAMES[self.model][self.preset], out)
        elif self.model in PRESETS:
            self._learn(PRESETS[self.model][self.preset], out)
        else:
            known = ", ".join([*PRESETS, *GAMES])
            raise MotionLabError(f"There is no model {self.model!r} to train; there are {known}.")

    @property
    def _free(self) -> bool:
        """Whether to leave out what is not free for commercial use."""
        return self.data is None and self.model.endswith("-permissive")

    def _learn(self, preset: Preset, out: Path) -> None:
        import torch

        from ..training import Prepared, build
        from ..weights import find

        try:
            from ..training.finish import finish
            from ..training.loop import train
        except ModuleNotFoundError as error:
            raise MotionLabError(
                f"Training needs {error.name}: pip install 'motionlab[train]'."
            ) from error
        chosen = {key: getattr(self, key) for key in ("updates", "learning_rate", "seed")}
        preset = replace(preset, **{key: its for key, its in chosen.items() if its is not None})
        walks = self.model.startswith(
            ("pfnn", "lstm-gmm", "strnn", "conv-autoencoder", "bidirectional")
        )
        style = "locomotion" if walks else self.model.rpartition("-")[2]
        data = Prepared.find(self.data or style, self._free, **self.folder.reading())
        if self.model == "lstm-gmm":
            data = data.without_contacts()
        start = find(self.start) if self.start else None
        model = build(data, preset, start)
        curve = train(
            model, data, preset, out, name=self.model, start=start,
            accelerator=self.accelerator, devices=self.devices, nodes=self.nodes, progress=True,
        )  # fmt: skip
        if torch.distributed.is_initialized() and torch.distributed.get_rank():
            return  # one process is enough for what is left
        sampling = finish(out / preset.weights, data)
        best = min(curve, key=lambda point: point["val"])
        print(f"{out}: {curve[-1]['update']} updates; best of validation {best['val']:.3f} at "
              f"update {best['update']}; weights in {preset.weights}"
              + "".join(f"; {key} {value:g}" for key, value in sampling.items())
              + f"; their card is {Path(preset.weights).with_suffix('.md')}")  # fmt: skip

    def _play(self, preset: GamePreset, out: Path) -> None:
        from ..training import Prepared
        from ..training.adversarial import train_game
        from ..training.finish import write_card
        from ..training.judging import Judge, choose
        from ..weights import find, load

        if self.learning_rate is not None or (self.devices, self.nodes) != (1, 1):
            raise MotionLabError(
                "A refiner has no --learning-rate (it has two; see its preset), and learns on one "
                "device."
            )
        chosen = {"steps": self.updates, "seed": self.seed}
        preset = replace(preset, **{key: its for key, its in chosen.items() if its is not None})
        start = find(self.start or self.model.replace("refiner", "lstm-gmm"))
        generator = load(start)
        check_generates(generator, self.start or self.model)
        data = Prepared.find(self.data or "locomotion", self._free, **self.folder.reading())
        sampling = preset.sampling(generator.sampling)
        judge = Judge(
            generator, data, sampling=sampling
        )  # says now what it would say after the game
        device = None if self.accelerator == "auto" else self.accelerator
        train_game(
            generator, data, preset, out, name=self.model, start=start, device=device, progress=True
        )
        print("which refiner is best? this takes some seconds for each", flush=True)
        best = choose(out, judge, preset.weights)
        write_card(out / preset.weights)
        print(f"{out}: the best is of step {best['step']}; weights in {preset.weights}; foot skate "
              f"{best['foot skate (cm/s)']:.1f} cm/s, jerk {best['jerk (m/s³)']:.0f} m/s³, a "
              f"critic is right in {best['critic']:.0%}, roots moved {100 * best['root (m)']:.1f} cm")  # fmt: skip
