"""The generator of RNN-GAN: an LSTM that answers "what comes next?" with a mixture of Gaussians.

Wang, Chai and Xia (2021), *Combining Recurrent Neural Networks and Adversarial Training for Human
Motion Synthesis and Control*, section 4.1.
"""

from __future__ import annotations

import math
from numbers import Real
from typing import NamedTuple

import torch
from torch import Tensor, nn

from ..encodings import Encoding, Normalizer
from ..errors import ModelError
from .answers import NO_SHARE, log_density, split
from .checks import check_memory, check_noise, checked_features, checked_start
from .noise import noise_to_draw, normal
from .recurrent import Recurrent
from .sampler import PRECISIONS, Chance, choose, unroll
from .state import State
from .through import through

# Smallest standard deviations, in normalised units. A contact is 0 or 1: a Gaussian around such a
# value could be made as narrow, and its density as high, as one likes. With 0.1 a contact that the
# network was sure of and got wrong costs about 200 nats.
_FLOOR, _CONTACT_FLOOR = 0.01, 0.1
BRIEF = 8  # frames that `through` reads in less time than torch's LSTM needs to begin


class Mixture(NamedTuple):
    """Gaussians with diagonal covariance (eq. 6) over the next frame, in normalised units."""

    log_weights: Tensor  # (..., M), logarithm of weights that sum to 1
    means: Tensor  # (..., M, kept)
    stds: Tensor  # (..., M, kept)

    def log_prob(self, values: Tensor) -> Tensor:
        """Logarithm of the density (...) at values (..., kept).

        The sum over components is a log-sum-exp: densities of 70 channels under- and overflow.
        """
        values, means, stds = torch.broadcast_tensors(values[..., None, :], self.means, self.stds)
        return _LogProb.apply(values, self.log_weights.expand(means.shape[:-1]), means, stds)

    def sample(
        self,
        generator: torch.Generator | None = None,
        temperature: float = 1.0,
        component_temperature: float = 1.0,
    ) -> Tensor:
        """One draw (..., kept): first a component, then a point from its Gaussian.

        Parameters
        ----------
        generator : source of chance.
        temperature : factor on the standard deviations.
        component_temperature : divides the logarithms of the weights; towards 0 the likeliest
            component always wins.
        """
        mean, std = self.choose(generator, component_temperature)
        return mean + temperature * std * normal(std, generator)

    def choose(
        self, generator: torch.Generator | None = None, component_temperature: float = 1.0
    ) -> tuple[Tensor, Tensor]:
        """Mean and deviations (..., kept) of a component; arguments as of `sample`."""
        chosen = choose(self.log_weights / component_temperature, generator)  # (...)
        chosen = chosen[..., None, None].expand(*chosen.shape, 1, self.means.shape[-1])
        return self.means.gather(-2, chosen)[..., 0, :], self.stds.gather(-2, chosen)[..., 0, :]


class _LogProb(torch.autograd.Function):
    """Its slope is written out for one reason: components that are far away have none.

    Theirs would be a number so small that processors take a hundred times as long to multiply it.
    """

    @staticmethod
    def forward(ctx, values, log_weights, means, stds):
        far = (values - means) / stds  # (..., M, kept)
        each = -(far.square() / 2 + stds.log() + math.log(2 * math.pi) / 2).sum(-1)  # (..., M)
        joint = log_weights + each
        total = joint.logsumexp(-1)
        ctx.save_for_backward(far, stds, (joint - total[..., None]).exp())
        return total

    @staticmethod
    @torch.autograd.function.once_differentiable
    def backward(ctx, slope):
        far, stds, shares = ctx.saved_tensors
        shares = slope[..., None] * shares.masked_fill(shares < NO_SHARE, 0)
        to_means = shares[..., None] * far / stds
        return -to_means, shares, to_means, to_means * far - shares[..., None] / stds


class LstmGmm(Recurrent):
    """FC - FC - LSTM - LSTM - FC (RNN-GAN, fig. 3): the distribution of the next frame.

    Why a distribution? From one pose a person may go on in many ways. A network that must name one
    frame answers with the average of them, and the average of a left and a right step is standing
    still. A mixture of M Gaussians says "this, or that, and by so much", and whoever samples from
    it gets one of the ways, another one each time.

    Why an LSTM? One frame tells neither how fast the body moves nor where in the stride it is; the
    two LSTM layers carry along what has been seen.

    Features go in and come out in raw units. Inside they are normalised; likelihoods and noise are
    in normalised units.

    Parameters
    ----------
    encoding : what a row of features means.
    normalizer : fitted on the training split.
    width : of each hidden layer (the paper's is not known).
    components : M, Gaussians in the mixture.
    skip : share of the present frame that goes straight into the means, from 0 to 1. With 0, the
        paper's way, the network has to copy the body through its memory before it can move it, and
        is long in learning to. With 1 it learns fast, but nothing pulls a motion back that has left
        the data: each frame may be a little further off, without end.
    """

    settings = ("width", "components", "skip")

    def __init__(
        self,
        encoding: Encoding,
        normalizer: Normalizer,
        width: int = 512,
        components: int = 5,
        skip: float = 0.0,
    ) -> None:
        super().__init__(encoding, normalizer, width)
        if not isinstance(skip, Real) or not 0 <= skip <= 1:
            raise ModelError(f"skip is {skip!r}; it must be a share, from 0 to 1.")
        self.components = components
        # What is left for the network to say is about so large; it counts in this unit, so that it
        # need not learn first how small its words are to be.
        self.skip, self.reach = skip, max(1 - skip, 0.1)
        self.enter = nn.Sequential(
            nn.Linear(self.kept, width), nn.ReLU(), nn.Linear(width, width), nn.ReLU()
        )
        self.lstm = nn.LSTM(width, width, num_layers=2, batch_first=True)
        self.leave = nn.Linear(width, components * (1 + 2 * self.kept))
        floor = torch.full((encoding.dim,), _FLOOR)
        if "contacts" in encoding.slices:
            floor[encoding.slices["contacts"]] = _CONTACT_FLOOR
        self.register_buffer("floor", floor[normalizer.kept])

    # -- likelihood of whole clips ----------------------------------------------------------------

    def forward(self, features: Tensor, noise: Tensor | None = None) -> Mixture:
        """What may follow each frame of features (batch, frames, dim), starting from no memory.

        noise : like features; added to what the network sees, in normalised units.
        """
        features = checked_features(self, features)
        return self.read(features, self.zero_state(len(features)), noise)[0]

    def log_prob(self, features: Tensor, noise: Tensor | None = None) -> Tensor:
        """Log-likelihood (batch, frames - 1) of each frame but the first, given those before it.

        That is the density of the model's own distribution: of what `generate` draws at temperatures
        of 1, with neither noise on the inputs nor a memory of the noise. Motion that was drawn in
        another way has a likelihood here as recorded motion has: how well the model would have
        foretold it. It is not the density that it was drawn from; see `generate`.
        """
        features = checked_features(self, features)
        if features.shape[1] < 2:
            raise ModelError("log_prob needs at least 2 frames: the first one is given.")
        before = None if noise is None else noise[:, :-1]
        inputs, outputs, _ = self._heard(features[:, :-1], self.zero_state(len(features)), before)
        ahead = self.normalizer(features[:, 1:]) - self.skip * inputs
        return log_density(self._said(outputs), ahead, self.components, self.reach, self.floor)

    def loss(self, features: Tensor, noise: Tensor | None = None) -> Tensor:
        """Mean negative log-likelihood a frame (eq. 8), in nats."""
        return -self.log_prob(features, noise).mean()

    def read(
        self, features: Tensor, state: State, noise: Tensor | None = None
    ) -> tuple[Mixture, State]:
        """What may follow each frame of features (batch, frames, dim) that go on from a state.

        And the state after the last of them. noise : as of `forward`. Nothing is checked: this is
        what others are made of.
        """
        inputs, outputs, after = self._heard(features, state, noise)
        return self._mixture(outputs, inputs), after

    def _heard(
        self, features: Tensor, state: State, noise: Tensor | None
    ) -> tuple[Tensor, Tensor, State]:
        """What the network saw (batch, frames, kept), its answers (..., width), the state after."""
        if noise is not None:
            features = features + noise * self.normalizer.std
        inputs = self.normalizer(features)
        memory = (
            state.hidden.transpose(0, 1).contiguous(),
            state.cell.transpose(0, 1).contiguous(),
        )
        graded = torch.is_grad_enabled()
        learns = graded and any(w.requires_grad for w in self.lstm.parameters())
        # torch's own brings all weights into an order of its own each time, for a few frames in vain
        if (graded or inputs.shape[1] <= BRIEF) and not learns:
            frames_first = inputs.transpose(0, 1).contiguous()
            outputs, hidden, cell = through(self.lstm, self.enter(frames_first), *memory)
            outputs = outputs.transpose(0, 1).contiguous()
        else:
            outputs, (hidden, cell) = self.lstm(self.enter(inputs), memory)
        after = State(features[:, -1], hidden.transpose(0, 1), cell.transpose(0, 1), state.noise)
        return inputs, outputs, after

    def _said(self, outputs: Tensor) -> Tensor:
        """Numbers of any size (..., M (1 + 2 kept)) of answers (..., width): weights, means, deviations."""
        # densities need more digits than half precision has
        with torch.autocast(outputs.device.type, enabled=False):
            return self.leave(outputs.to(self.leave.weight.dtype))

    def _mixture(self, outputs: Tensor, inputs: Tensor) -> Mixture:
        """Answers (..., width) to weights, means and deviations (eq. 7).

        inputs : (..., kept), the present frame, of which the means keep a share.
        """
        weights, means, log_stds = split(self._said(outputs), self.components)
        means = self.skip * inputs[..., None, :] + self.reach * means
        return Mixture(weights.log_softmax(-1), means, self.reach * log_stds.exp() + self.floor)

    # -- one frame after the other ----------------------------------------------------------------

    def _seen(self, features: Tensor) -> State:
        return self.read(features, self.zero_state(len(features)), None)[1]

    def predict(self, state: State) -> Mixture:
        """What may follow the frames that a state has seen: (batch, M, ...)."""
        return self._mixture(state.hidden[:, -1], self.normalizer(state.frame))

    def step(self, x: Tensor, state: State, noise: Tensor | None = None) -> tuple[Mixture, State]:
        """See one frame more, x (batch, dim): what may follow it, and the state after it."""
        noise = None if noise is None else noise[:, None]
        mixture, state = self.read(x[:, None], state, noise)
        return Mixture(*(part[:, 0] for part in mixture)), state

    def generate(
        self,
        n: int,
        start: State,
        *,
        generator: torch.Generator | None = None,
        temperature: float = 1.0,
        component_temperature: float = 1.0,
        noise: float = 0.0,
        memory: float = 0.0,
        precision: str = "full",
    ) -> Tensor:
        """Motion that goes on from a state: n frames (batch, n, dim), each fed back to get the next.

        Differentiable, and so it remembers every step. In ``torch.no_grad()`` it is faster (see
        sampler.py) and draws the same motion. A character that leaves all bounds ends in NaN.

        **A tremble or a whim.** A frame is drawn as z = μ + T σ ε from the Gaussian of one component.
        The paper's ε is white, new in each frame: all the chance there is goes into trembling. With a
        `memory` ρ it is ε_t = ρ ε_{t-1} + √(1 - ρ²) n_t, with white n_t: as large at any one moment,
        but slow, so that it adds up to a step, a turn, a change of pace. Two things stay white. The
        choice of the component: which way to go on is a question with M answers, asked anew each
        frame with the weights that were learned, and ε goes over from one component to the next. And
        the noise on the inputs, which stands for errors that the network was taught to mend.

        Such motion is no sample of the model's own distribution. By itself each ε_t is standard
        normal, but given the frames before it is not: they tell ε_{t-1}, so the next frame lies
        around μ + ρ T σ ε_{t-1}, with deviations of √(1 - ρ²) T σ. And what the network has seen
        depends on the noise there was, so that over all motions, too, a frame and its memory go
        together otherwise than under the model. `log_prob` of it is therefore not the density that
        it was drawn from (nor is it at another temperature than 1).

        Parameters
        ----------
        n : frames.
        start : from `observe`; the batch is as large as it. Brought to the model's device and
            precision. If it holds noise, as those from `go_on` do, a memory goes on from that; if
            not, as those of observed frames and of shipped weights, from a fresh standard normal.
        generator : source of chance, on the model's device.
        temperature : factor on the standard deviations; 1 is what was learned, less is calmer.
        component_temperature : the same for the choice among the M components.
        noise : standard deviation of what is added to the network's inputs, in normalised units
            (the d of section 5.1; 0.05 in training).
        memory : ρ of the Gaussians' noise, from 0, the paper's white noise, to less than 1.
        precision : of the weights. "full" is theirs. "int8" draws faster, one character or
            hundreds: nearly the same distribution, another motion (it rounds what is multiplied,
            too). "half" draws one or a few of a wide network faster, and of weights that were
            stored in half precision it loses nothing. For one to four characters small layers stay
            in full, which is faster. Both only in ``torch.no_grad()``, on x86 processors.

        Raises
        ------
        ModelError : n is not a whole number above zero, a temperature is not above zero, the noise
            is negative, the memory is not from 0 to less than 1, the state is another model's or
            holds a NaN, the generator is on another device, or the precision is none of the three
            or not possible here.
        """
        chance = Chance(generator, temperature, component_temperature, noise, memory)
        return self._drawn(n, start, chance, precision, onward=False)[0]

    def go_on(
        self, n: int, state: State, *, precision: str = "full", **chance: float
    ) -> tuple[Tensor, State]:
        """`generate`, and the state (batch) after the last frame, for motion that is made in pieces.

        Pieces of any length are what is generated at once, exactly, if the generator goes on as well.
        The state takes along the noise of the last frame, whatever the memory was. So from one piece
        to the next `memory` may change, like everything else in `chance`: arguments of `generate`.
        Raises what that raises. Leave out characters that ended in NaN: ``state[alive]``.
        """
        return self._drawn(n, state, Chance(**chance), precision, onward=True)

    def _drawn(
        self, n: int, start: State, chance: Chance, precision: str, onward: bool
    ) -> tuple[Tensor, State]:
        """Frames, and the state after them if it is to go `onward`; checks all that it is given."""
        start = checked_start(self, n, start)
        for what in ("temperature", "component_temperature"):
            value = getattr(chance, what)
            if not isinstance(value, Real) or not 0 < value < math.inf:
                raise ModelError(f"generate: {what} is {value!r}; it must be a number above 0.")
        check_noise(chance.noise)
        check_memory(chance.memory)
        if precision not in PRECISIONS:
            raise ModelError(f"generate: precision {precision!r}; it is one of {[*PRECISIONS]}.")
        like, generator = self.normalizer.mean, chance.generator
        if generator is not None and generator.device.type != like.device.type:
            raise ModelError(
                f"generate: the generator is on {generator.device.type}, the model on "
                f"{like.device.type}; use torch.Generator({like.device.type!r})."
            )
        if not torch.is_grad_enabled():
            return unroll(self, n, start, chance, precision, onward)
        if precision != "full":
            raise ModelError("generate: rounded weights have no gradient; use torch.no_grad().")
        return self._loop(n, start, chance, onward)

    def _loop(self, n: int, start: State, chance: Chance, onward: bool) -> tuple[Tensor, State]:
        """The same, for reading and for gradients."""
        generator, temperature, component_temperature, disturbed, memory = chance
        mixture, state, frames = self.predict(start), start, []
        for t in range(n):
            mean, std = mixture.choose(generator, component_temperature)
            noise = noise_to_draw(state.noise, std, memory, generator)
            frame = self.normalizer.inverse(mean + temperature * std * noise)
            frames.append(frame)
            if t < n - 1 or onward:
                disturbance = disturbed * normal(frame, generator) if disturbed else None
                mixture, state = self.step(frame, state._replace(noise=noise), disturbance)
        return torch.stack(frames, dim=1), state
