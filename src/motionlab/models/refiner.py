"""The refiner of RNN-GAN, and the discriminator that teaches it what real feet do.

Wang, Chai and Xia (2021), *Combining Recurrent Neural Networks and Adversarial Training for Human
Motion Synthesis and Control*, section 4.2.
"""

from __future__ import annotations

import math

import torch
from torch import Tensor, nn
from torch.nn.functional import softplus

from ..encodings import JointAngles, Normalizer
from ..encodings.path import turned
from ..errors import ModelError
from .checks import as_features, checked_features, checked_state
from .recurrent import Recurrent
from .refiner_step import step
from .state import State

_TOES = slice(0, 2)  # of the end effectors


class Refiner(Recurrent):
    """FC - LSTM - FC, and the motion itself added (eq. 11): what should a frame have been?

    A generator that names one joint angle after the other does not feel where they put the foot. The
    refiner does: it sees, beside the features, where hands, toes and head are and how they move, and
    it corrects the features. It looks at a motion as it comes, frame by frame, never ahead, so that
    it can follow a stream.

    Parameters
    ----------
    encoding : what a row of features means.
    normalizer : of the features, fitted on the training split.
    width : of the hidden layers (the paper's is not known).
    effectors : Normalizer of what `end_effectors` gives, six numbers an end effector; from
        `effector_normalizer`. None: to be filled by `load_state_dict`.
    reach : metres. If given, the network does not correct the root's steps and turns, where errors
        add up without end. It says how far aside and ahead of its place the root should be, in its
        heading, at most so far either way. Not the paper's.
    slow : metres a second. If given, it sees the velocities v of toes as asinh(v / slow), too:
        beside the metres a second of a step, the centimetres of a foot that slides are next to
        nothing. Not the paper's.

    Raises
    ------
    ModelError : the encoding is no `JointAngles`, reach or slow is not above 0, or a normaliser is
        for something else.
    """

    layers = 1
    settings = ("width", "reach", "slow")

    def __init__(
        self,
        encoding: JointAngles,
        normalizer: Normalizer,
        width: int = 256,
        effectors: Normalizer | None = None,
        reach: float | None = None,
        slow: float | None = None,
    ) -> None:
        if not isinstance(encoding, JointAngles):
            raise ModelError(f"A refiner corrects JointAngles, not {type(encoding).__name__}.")
        if reach is not None and not 0 < reach < math.inf:
            raise ModelError(f"reach is {reach!r}; it must be metres above 0, or None.")
        super().__init__(encoding, normalizer, width)
        self.effectors, self.reach = _checked(encoding, effectors), reach
        self.slow = _checked_slow(slow)
        self.enter = nn.Sequential(
            nn.Linear(self.kept + _numbers(self.effectors, slow), width), nn.ReLU()
        )
        self.lstm = nn.LSTM(width, width, batch_first=True)
        self.leave = nn.Linear(width, self.kept)
        self.aside = None if reach is None else nn.Linear(width, 2)
        for layer in filter(None, (self.leave, self.aside)):
            for parameter in layer.parameters():  # at first it leaves every motion as it is
                nn.init.zeros_(parameter)

    def forward(self, features: Tensor) -> Tensor:
        """Refined features, as many as `features` (batch, frames, dim)."""
        return self.refine(features)[0]

    def refine(self, features: Tensor, state: State | None = None) -> tuple[Tensor, State]:
        """Refine a piece of motion, and remember what the next piece needs.

        Parameters
        ----------
        features : (batch, frames, dim), or (frames, dim) for a batch of one; raw units.
        state : after the piece before; None at the beginning, where the first frame is taken to
            have been there before as well.

        Returns
        -------
        refined features (batch, frames, dim), and the state after them. Pieces of any length give
        what the whole gives.

        Raises
        ------
        ModelError : other features than this model's, NaN, or a state of another model or batch.
        """
        stepped = step(self, features, state)  # a single frame, if it can be calculated faster
        if stepped:
            return stepped
        features = as_features(self, features)
        features = checked_features(self, features[None] if features.ndim == 2 else features)
        if state is None:
            state = self.zero_state(len(features))._replace(frame=features[:, 0])
        state = checked_state(self, state)
        if len(state.frame) != len(features):
            raise ModelError(f"A state of {len(state.frame)} motions; there are {len(features)}.")
        with_before = torch.cat([state.frame[:, None], features], dim=1)
        moving = _felt(self.encoding.end_effectors(with_before)[:, 1:], self.effectors, self.slow)
        normalized = self.normalizer(features)
        seen = torch.cat([normalized, moving], dim=-1)
        memory = (part.transpose(0, 1).contiguous() for part in (state.hidden, state.cell))
        felt, (hidden, cell) = self.lstm(self.enter(seen), tuple(memory))
        refined = self.normalizer.inverse(normalized + self.leave(felt))
        if self.reach is not None:
            felt_before = torch.cat([state.hidden, felt[:, :-1]], dim=1)
            steps = self._steps(features, self._offset(felt_before), self._offset(felt))
            refined = torch.cat([steps, refined[..., 3:]], dim=-1)
        return refined, State(features[:, -1], hidden.transpose(0, 1), cell.transpose(0, 1))

    def _offset(self, felt: Tensor) -> Tensor:
        """Metres (..., 3) that the root should be aside and ahead of its place, in its heading."""
        x, z = (self.reach * self.aside(felt).tanh()).unbind(-1)
        return torch.stack([x, torch.zeros_like(x), z], dim=-1)

    @staticmethod
    def _steps(features: Tensor, before: Tensor, now: Tensor) -> Tensor:
        """Steps and turns (..., 3) of a root that was, and is, so far from its place."""
        # a step is seen from the frame before it, and so is the offset of now, turned back to there
        x, _, z = (turned(now, features[..., 2]) - before).unbind(-1)
        return features[..., :3] + torch.stack([x, z, torch.zeros_like(x)], dim=-1)

    def _seen(self, features: Tensor) -> State:
        return self.refine(features)[1]


class Discriminator(nn.Module):
    """FC - bidirectional LSTM - FC (eq. 12): is this real? It sees end effectors alone.

    Where hands, toes and head are, how they move, and, if the encoding has them, the contacts. It
    looks at a window forwards and backwards, and answers for every frame of it.

    Parameters
    ----------
    encoding : of the motions.
    effectors : as of `Refiner`.
    width : of the hidden layers, the LSTM's in each direction.
    slow : as of `Refiner`. It sees velocities' changes from frame to frame enlarged as well, those of
        all end effectors: it would rather look at feet than at hands that tremble.
    """

    def __init__(
        self,
        encoding: JointAngles,
        effectors: Normalizer | None = None,
        width: int = 128,
        slow: float | None = None,
    ) -> None:
        super().__init__()
        self.encoding, self.effectors = encoding, _checked(encoding, effectors)
        self.slow = _checked_slow(slow)
        contacts = encoding.slices.get("contacts", slice(0, 0))
        seen = _numbers(self.effectors, slow) + contacts.stop - contacts.start
        seen += len(self.effectors.mean) // 2 if slow else 0
        self.enter = nn.Sequential(nn.Linear(seen, width), nn.ReLU())
        self.lstm = nn.LSTM(width, width, batch_first=True, bidirectional=True)
        self.leave = nn.Linear(2 * width, 1)

    def seen(self, features: Tensor) -> Tensor:
        """All that it sees of features (batch, frames, dim): (batch, frames, numbers)."""
        moving = self.encoding.end_effectors(features)
        seen = [_felt(moving, self.effectors, self.slow)]
        if self.slow:
            changes = moving[..., 3:].diff(dim=-3, prepend=moving[..., :1, :, 3:])
            seen.append((changes / self.slow).asinh().flatten(-2))
        if "contacts" in self.encoding.slices:
            seen.append(self.encoding.contacts(features))
        return torch.cat(seen, dim=-1)

    def forward(self, features: Tensor) -> Tensor:
        """Logits (batch, frames) of being real: above 0 where it takes a frame for real."""
        return self.judge(self.seen(features))

    def judge(self, seen: Tensor) -> Tensor:
        """The same of what `seen` gives."""
        return self.leave(self.lstm(self.enter(seen))[0])[..., 0]


# -- the game (eq. 9, 10, 13) -----------------------------------------------------------------------


def fooling_loss(refined: Tensor) -> Tensor:
    """-log D of refined motion (eq. 9), mean over logits: the refiner wants them taken for real."""
    return softplus(-refined).mean()


def telling_loss(real: Tensor, refined: Tensor) -> Tensor:
    """-log D of real and -log(1 - D) of refined motion (eq. 10), each a mean over logits."""
    return softplus(-real).mean() + softplus(refined).mean()


def steepness(critic: Discriminator, seen: Tensor, judged: Tensor, noise: Tensor) -> Tensor:
    """How much logits change when what is seen does: mean square of the difference quotient.

    A discriminator that may be as steep as it likes tells real from refined by hairs, and a refiner
    learns nothing from it. This stands in for its gradient (the penalties R1 and R2 of Mescheder and
    others, *Which training methods for GANs do actually converge?*, 2018), which torch can't
    differentiate again through an LSTM on every device; as in Lin and others, *Diffusion adversarial
    post-training for one-step video generation*, 2025.

    Parameters
    ----------
    critic : the discriminator.
    seen : (batch, frames, numbers), as `Discriminator.seen` gives it.
    judged : (batch, frames), logits of that.
    noise : like seen; small, of one deviation in every direction.
    """
    scale = noise.std()
    return ((critic.judge(seen + noise) - judged) / scale).square().mean()


def root_deviation(encoding: JointAngles, features: Tensor, refined: Tensor) -> Tensor:
    """How far refined roots are from where they were (eq. 13): mean square in m² over all frames.

    features, refined : (..., frames, dim), set out from the same place.
    """
    away = encoding.root_path(refined) - encoding.root_path(features)
    return away.square().sum(-1).mean()


def effector_normalizer(encoding: JointAngles, clips: list[Tensor]) -> Normalizer:
    """Mean and deviation of positions (m) and velocities (m/s) of end effectors.

    clips : list of features (frames, dim), the training split.
    """
    return Normalizer.fit([encoding.end_effectors(clip).flatten(-2) for clip in clips])


def _checked(encoding: JointAngles, effectors: Normalizer | None) -> Normalizer:
    """The normaliser of end effectors, one that does nothing if None; ModelError if it is no such."""
    size = 6 * len(encoding.effector_names)
    effectors = effectors or Normalizer(size)
    if len(effectors.kept) != size:
        raise ModelError(
            f"effectors is for {len(effectors.kept)} numbers; {len(encoding.effector_names)} end "
            f"effectors have {size}."
        )
    return effectors


def _felt(moving: Tensor, effectors: Normalizer, slow: float | None) -> Tensor:
    """What a network sees of end effectors (..., effectors, 6): (..., numbers)."""
    seen = effectors(moving.flatten(-2))
    if slow is None:
        return seen
    return torch.cat([seen, (moving[..., _TOES, 3:] / slow).asinh().flatten(-2)], dim=-1)


def _numbers(effectors: Normalizer, slow: float | None) -> int:
    """How many numbers that is."""
    return len(effectors.mean) + (0 if slow is None else 6)


def _checked_slow(slow: float | None) -> float | None:
    if slow is not None and not 0 < slow < math.inf:
        raise ModelError(f"slow is {slow!r}; it must be metres a second above 0, or None.")
    return slow
