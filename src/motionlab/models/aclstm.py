"""LSTM-3LR, the network of acLSTM: three LSTM layers, and a linear one that names the next frame.

Zhou, Li, Xiao, He, Huang and Li (2018), *Auto-Conditioned Recurrent Networks for Extended Complex
Human Motion Synthesis*, section 3; the network is that of Fragkiadaki et al. (2015). What makes it
an acLSTM is the training alone: which frames of its input are its own.
"""

from __future__ import annotations

import math
from numbers import Integral, Real

import torch
from torch import Tensor, nn

from .. import encodings
from ..encodings import Encoding, Normalizer
from ..errors import ModelError
from .checks import check_normalizer, checked_features, checked_start
from .fed_back import checked_real
from .sampler import PRECISIONS, can_round, normal
from .state import State
from .unrolled import unroll


def auto_condition(frames: int, real: int, fed: int) -> Tensor:
    """Which frames (frames,) of a window are recorded ones: u `real` ones, v `fed` back, and so on.

    Raises ModelError if `real` is not 1 or more, or `fed` not 0 or more.
    """
    if not isinstance(real, Integral) or not isinstance(fed, Integral) or real < 1 or fed < 0:
        raise ModelError(
            f"Auto-conditioning with u = {real!r} recorded and v = {fed!r} fed-back frames: u must "
            "be a whole number from 1, v one from 0."
        )
    return torch.arange(frames) % (real + fed) < real


class AcLstm(nn.Module):
    """Three LSTM layers and a linear one: the next frame itself, no distribution.

    Trained on recorded frames alone (teacher forcing) it has never seen its own mistakes, and when
    it must go on from them, it stops. In auto-conditioned training u recorded frames are followed
    by v frames of its own making, and the loss asks of these, too, what came next in the recording;
    gradients pass through the frames that were fed back.

    Features go in and come out in raw units; inside they are normalised.

    Parameters
    ----------
    encoding : what a row of features means.
    normalizer : fitted on the training split.
    width : of each LSTM layer; 1024 in the paper.
    layers : 3 in the paper.
    staircase : as the published code has it, each layer sees what the layer below said one frame
        before, so that a change of the input needs as many frames as there are layers to come out.
    """

    def __init__(
        self,
        encoding: Encoding,
        normalizer: Normalizer,
        width: int = 1024,
        layers: int = 3,
        staircase: bool = False,
    ) -> None:
        super().__init__()
        check_normalizer(encoding, normalizer)
        self.encoding, self.normalizer = encoding, normalizer
        self.width, self.layers, self.staircase = width, layers, staircase
        self.kept = len(normalizer.kept)
        below = [self.kept] + [width] * (layers - 1)
        # [from below, own h] to the four gates, as torch.nn.LSTM has them: input, forget, new, output
        self.gates = nn.ModuleList(nn.Linear(size + width, 4 * width) for size in below)
        self.leave = nn.Linear(width, self.kept)
        for parameter in self.parameters():
            nn.init.uniform_(parameter, -(width**-0.5), width**-0.5)

    @property
    def fps(self) -> float:
        """Frames per second of the features."""
        return self.encoding.fps

    # -- windows ----------------------------------------------------------------------------------

    def forward(
        self, features: Tensor, noise: Tensor | None = None, real: Tensor | None = None
    ) -> Tensor:
        """The frame after each of features (batch, frames, dim), from no memory; like features.

        Parameters
        ----------
        noise : like features; added to recorded frames where they are input, in normalised units.
        real : (frames,) or (batch, frames) bool; where it is False, the network sees its own output
            instead of the recorded frame. The first must be True.
        """
        features = checked_features(self, features)
        return self.normalizer.inverse(self._run(self._inputs(features, noise), real)[0])

    def loss(
        self, features: Tensor, noise: Tensor | None = None, real: Tensor | None = None
    ) -> Tensor:
        """Mean squared error of a channel (eq. 1 and 2), in normalised units; as `forward`."""
        features = checked_features(self, features)
        if features.shape[1] < 2:
            raise ModelError("loss needs at least 2 frames: the first one is given.")
        outputs, _ = self._run(
            self._inputs(features, noise)[:, :-1], None if real is None else real[..., :-1]
        )
        return (outputs - self.normalizer(features[:, 1:])).square().mean()

    def _inputs(self, features: Tensor, noise: Tensor | None) -> Tensor:
        if noise is not None:
            features = features + noise * self.normalizer.std
        return self.normalizer(features)

    def _run(
        self, inputs: Tensor, real: Tensor | None, state: State | None = None
    ) -> tuple[Tensor, tuple[Tensor, Tensor]]:
        """Outputs (batch, frames, kept) of inputs like them, and hidden and cell after the last."""
        state = state or self.zero_state(len(inputs))
        if real is not None:
            real = checked_real(real, inputs).T
        weights = [(layer.weight, layer.bias) for layer in (*self.gates, self.leave)]
        kind = inputs.device.type
        digits = torch.get_autocast_dtype(kind) if torch.is_autocast_enabled(kind) else inputs.dtype
        *gates, leave = [(w.to(digits), b.to(digits)) for w, b in weights]
        with torch.autocast(kind, enabled=False):
            outputs, hidden, cell = unroll(
                inputs.to(digits).transpose(0, 1), real, state.hidden.to(digits).transpose(0, 1),
                state.cell.transpose(0, 1), gates, leave, self.staircase,
            )  # fmt: skip
        memory = hidden.to(inputs).transpose(0, 1), cell.transpose(0, 1)
        return outputs.to(inputs).transpose(0, 1), memory

    # -- one frame after the other ----------------------------------------------------------------

    def zero_state(self, batch: int = 1) -> State:
        """The state of a network that has seen nothing; its frame is the mean frame."""
        mean = self.normalizer.mean
        memory = mean.new_zeros(batch, self.layers, self.width)
        return State(mean.expand(batch, -1), memory, memory)

    def observe(self, features: Tensor) -> State:
        """The state after features (batch, frames, dim), or (frames, dim) for a batch of one."""
        features = torch.as_tensor(features)
        features = checked_features(self, features[None] if features.ndim == 2 else features)
        return State(features[:, -1], *self._run(self.normalizer(features), None)[1])

    def predict(self, state: State) -> Tensor:
        """The frame (batch, dim) after those that a state has seen."""
        return self.normalizer.inverse(self.leave(state.hidden[:, -1]))

    def step(self, x: Tensor, state: State) -> tuple[Tensor, State]:
        """See one frame more, x (batch, dim): the frame after it, and the state."""
        outputs, memory = self._run(self.normalizer(x)[:, None], None, state)
        return self.normalizer.inverse(outputs[:, 0]), State(x, *memory)

    def generate(
        self,
        n: int,
        start: State,
        *,
        generator: torch.Generator | None = None,
        noise: float = 0.0,
        precision: str = "full",
    ) -> Tensor:
        """Motion that goes on from a state: n frames (batch, n, dim), each fed back to get the next.

        Without noise there is no chance in it: one start has one future.

        Parameters
        ----------
        n : frames.
        start : from `observe`; the batch is as large as it.
        generator : source of chance, for the noise.
        noise : standard deviation of what is added to frames that are fed back, in normalised units.
        precision : of the weights, "full", "half" or "int8"; see `LstmGmm.generate`.

        Raises
        ------
        ModelError : n is not a whole number above zero, the noise is negative, the state is another
            model's or holds a NaN, or the precision is not possible here.
        """
        start = checked_start(self, n, start, (self.layers, self.width))
        if not isinstance(noise, Real) or not 0 <= noise < math.inf:
            raise ModelError(f"generate: noise is {noise!r}; it must be a number, 0 or more.")
        if not torch.is_grad_enabled():
            return self._generate(n, start, generator, noise, precision)
        if precision != "full":
            raise ModelError("generate: rounded weights have no gradient; use torch.no_grad().")
        frame, state = self.predict(start), start
        frames = [frame]
        for _ in range(n - 1):
            if noise:
                frame = frame + noise * normal(frame, generator) * self.normalizer.std
            frame, state = self.step(frame, state)
            frames.append(frame)
        return torch.stack(frames, dim=1)

    def _generate(
        self,
        n: int,
        start: State,
        generator: torch.Generator | None,
        noise: float,
        precision: str,
    ) -> Tensor:
        """`generate` for when no gradient is asked for: nothing is remembered, features stay
        normalised from the first frame to the last."""
        if precision not in PRECISIONS:
            raise ModelError(f"generate: precision {precision!r}; it is one of {[*PRECISIONS]}.")
        if precision != "full" and not can_round(start.hidden):
            raise ModelError(
                f'generate: precision "{precision}" needs a float32 model on an x86 processor.'
            )
        product = PRECISIONS[precision]
        *gates, leave = [product(layer.weight, layer.bias) for layer in (*self.gates, self.leave)]
        hidden, cell = [*start.hidden.unbind(1)], [*start.cell.unbind(1)]
        frames = start.frame.new_empty(len(start.frame), n, self.kept)
        for t in range(n):
            if t:
                below = frames[:, t - 1]
                if noise:
                    disturbance = normal(start.frame, generator)[:, self.normalizer.kept]
                    below = below + noise * disturbance
                for layer, gate in enumerate(gates):
                    above = hidden[layer] if self.staircase else None
                    enter, keep, new, show = gate(torch.cat([below, hidden[layer]], 1)).chunk(4, 1)
                    cell[layer] = keep.sigmoid() * cell[layer] + enter.sigmoid() * new.tanh()
                    hidden[layer] = show.sigmoid() * cell[layer].tanh()
                    below = hidden[layer] if above is None else above
            frames[:, t] = leave(hidden[-1])
        return self.normalizer.inverse(frames)

    # -- what is stored with the weights ----------------------------------------------------------

    def config(self) -> dict:
        """What `from_config` needs to build an untrained copy; fit for JSON."""
        return {
            "encoding": self.encoding.config(),
            "kept": self.kept,
            "width": self.width,
            "layers": self.layers,
            "staircase": self.staircase,
        }

    @classmethod
    def from_config(cls, config: dict) -> AcLstm:
        """A model of the right shapes, to be filled by `load_state_dict`."""
        encoding = encodings.from_config(config["encoding"])
        normalizer = Normalizer(encoding.dim, config["kept"])
        return cls(encoding, normalizer, config["width"], config["layers"], config["staircase"])
