"""LSTM-3LR, the network of acLSTM: three LSTM layers, and a linear one that names the next frame.

Zhou, Li, Xiao, He, Huang and Li (2018), *Auto-Conditioned Recurrent Networks for Extended Complex
Human Motion Synthesis*, section 3; the network is that of Fragkiadaki et al. (2015). What makes it
an acLSTM is the training alone: which frames of its input are its own.
"""

from __future__ import annotations

from numbers import Integral

import torch
from torch import Tensor, nn

from ..encodings import Encoding, Normalizer
from ..errors import ModelError
from .next_frame import NextFrame
from .noise import normal
from .sampler import PRECISIONS, can_round
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


class AcLstm(NextFrame):
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

    settings = ("width", "layers", "staircase")

    def __init__(
        self,
        encoding: Encoding,
        normalizer: Normalizer,
        width: int = 1024,
        layers: int = 3,
        staircase: bool = False,
    ) -> None:
        super().__init__(encoding, normalizer, width)
        self.layers, self.staircase = layers, staircase
        below = [self.kept] + [width] * (layers - 1)
        # [from below, own h] to the four gates, as torch.nn.LSTM has them: input, forget, new, output
        self.gates = nn.ModuleList(nn.Linear(size + width, 4 * width) for size in below)
        self.leave = nn.Linear(width, self.kept)
        for parameter in self.parameters():
            nn.init.uniform_(parameter, -(width**-0.5), width**-0.5)

    def _run(
        self, inputs: Tensor, real: Tensor | None, state: State
    ) -> tuple[Tensor, tuple[Tensor, Tensor]]:
        weights = [(layer.weight, layer.bias) for layer in (*self.gates, self.leave)]
        kind = inputs.device.type
        digits = torch.get_autocast_dtype(kind) if torch.is_autocast_enabled(kind) else inputs.dtype
        *gates, leave = [(w.to(digits), b.to(digits)) for w, b in weights]
        with torch.autocast(kind, enabled=False):
            outputs, hidden, cell = unroll(
                inputs.to(digits).transpose(0, 1), None if real is None else real.T,
                state.hidden.to(digits).transpose(0, 1),
                state.cell.transpose(0, 1), gates, leave, self.staircase,
            )  # fmt: skip
        memory = hidden.to(inputs).transpose(0, 1), cell.transpose(0, 1)
        return outputs.to(inputs).transpose(0, 1), memory

    def predict(self, state: State) -> Tensor:
        """The frame (batch, dim) after those that a state has seen."""
        return self.normalizer.inverse(self.leave(state.hidden[:, -1]))

    def generate(
        self,
        n: int,
        start: State,
        *,
        generator: torch.Generator | None = None,
        noise: float = 0.0,
        precision: str = "full",
    ) -> Tensor:
        """`NextFrame.generate`; in ``torch.no_grad()`` faster.

        precision : of the weights, "full", "half" or "int8"; see `LstmGmm.generate`.
        """
        if torch.is_grad_enabled():
            if precision != "full":
                raise ModelError("generate: rounded weights have no gradient; use torch.no_grad().")
            return super().generate(n, start, generator=generator, noise=noise)
        start = self._checked_start(n, start, noise)
        return self._generate(n, start, generator, noise, precision)

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
