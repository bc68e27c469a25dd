"""STRNN: twenty frames in, the same twenty and the next twenty out, all at once.

Wang, Ho, Shum and Zhu (2021), *Spatio-temporal Manifold Learning for Human Motions via Long-horizon
Modeling*, section 4. An LSTM reads some frames; from its last state a decoder says them again,
backwards, and a predictor says those that follow. Who must say twenty frames ahead can't get by with
repeating the last one. A network over all frames that were said takes the jumps out. The equations
are lost from the text that we have; they are built anew from its words.
"""

from __future__ import annotations

import math
from numbers import Integral
from typing import Literal, Self

import torch
from torch import Tensor, nn

from .. import encodings
from ..encodings import BodyFrame, Normalizer
from ..errors import ModelError
from .at_rest import at_rest
from .checks import (
    as_features,
    check_counts,
    check_noise,
    check_normalizer,
    checked_features,
    checked_going_on,
)  # fmt: skip
from .going_on import GoingOn
from .noise import normal
from .overlap import mean_of_windows, without_jumps
from .strnn_parts import SpatialDecoder, SpatialEncoder, part_channels, residual_layers
from .unchanged import made_of

# Of the training in three stages (section 4.2.4): all but the residual network, the residual network
# by itself, the residual network behind the others, which stay as they are.
FIRST, ALONE, BEHIND = 0, 1, 2


class Strnn(nn.Module):
    """Encoder, backward decoder and forward predictor, with a spatial and a residual network or without.

    As it stands it is the paper's Composite_20_20; ``residual=False`` is its SpatioTemp, and
    ``spatial=False, residual=False`` its Temporal. Other lengths are 39/1, 35/5, 30/10, 10/10, 5/5.

    Features go in and come out in raw units; inside they are normalised. In `extrapolate`,
    `reconstruct` and `project` nothing is dropped and batch norm has the statistics of the training,
    whatever mode the network is in.

    Parameters
    ----------
    encoding : `BodyFrame`.
    normalizer : fitted on the training split.
    width : of the LSTM layers and of a frame's code, 512 in the paper; a multiple of 8.
    encode, predict : frames that are read, and said again, and frames that are foretold.
    spatial : encode and decode frames part by part (`strnn_parts`); "dense": by layers of the same
        sizes that know no parts, as an ERD has them. False: frames are read as they are, and said by
        one linear layer.
    residual : four layers over all frames that were said, whose output is added to them. It begins as
        nothing.
    backward : the decoder says the last frame first, which is remembered best.
    conditional : decoder and predictor hear what they have said; otherwise, in training, the true frame.
    drop : share of the spatial network's units that are dropped in training.
    smooth : w_s, what mean squared second differences cost in training, eq. 4 and 7; 0 is the paper's
        MSE.
    penalty : what mean squares of weights and codes cost in training.
    bones : what squared errors of bone lengths cost in training, by cm²; not in the paper, which has it
        in control alone (eq. 10).

    Raises
    ------
    ModelError : another encoding, sizes that make no sense, a skeleton that lacks a part.
    """

    codes = 2  # h and C
    settings = (
        "width", "encode", "predict", "spatial", "residual", "conditional", "drop", "smooth", "penalty"
    )  # fmt: skip

    def __init__(
        self,
        encoding: BodyFrame,
        normalizer: Normalizer,
        width: int = 512,
        encode: int = 20,
        predict: int = 20,
        *,
        spatial: bool | Literal["dense"] = True,
        residual: bool = True,
        conditional: bool = True,
        drop: float = 0.1,
        smooth: float = 0.0,
        penalty: float = 0.0,
        backward: bool = True,
        bones: float = 0.0,
    ) -> None:
        super().__init__()
        check_normalizer(encoding, normalizer)
        _check(width, encode, predict, drop, smooth=smooth, penalty=penalty, bones=bones)
        if spatial not in (True, False, "dense"):
            raise ModelError(f'Strnn: spatial is {spatial!r}; it is True, False or "dense".')
        self.encoding, self.normalizer = encoding, normalizer
        self.width, self.encode, self.predict = width, encode, predict
        self.spatial, self.residual, self.conditional = spatial, residual, conditional
        self.drop, self.smooth, self.penalty, self.bones = drop, smooth, penalty, bones
        self.backward = backward
        self.kept = kept = len(normalizer.kept)
        size = kept
        if spatial:
            parts, size = part_channels(encoding, normalizer.kept.tolist()), width
            dense = spatial == "dense"
            self.enter = SpatialEncoder(parts, width, drop, dense)
            self.leave = SpatialDecoder(parts, width, drop, dense)
        else:
            self.leave = nn.Linear(width, kept)
        self.encoder = nn.LSTM(size, width, batch_first=True)
        self.decoder, self.predictor = GoingOn(size, width), GoingOn(size, width)
        if residual:
            self.filter = residual_layers(self.frames * kept, width)
        jerky = torch.ones(encoding.dim, dtype=torch.bool)  # a contact bit may jump
        jerky[encoding.slices.get("contacts", slice(0))] = False
        self.register_buffer("glides", jerky[normalizer.kept], persistent=False)

    @property
    def fps(self) -> float:
        """Frames per second of the features."""
        return self.encoding.fps

    @property
    def frames(self) -> int:
        """Frames of a training window: those that are read and those that are foretold."""
        return self.encode + self.predict

    # -- windows ----------------------------------------------------------------------------------

    def forward(self, features: Tensor) -> Tensor:
        """Of features (batch, encode, dim) the same and the next frames, (batch, encode + predict, dim)."""
        features = checked_features(self, features)
        if features.shape[1] != self.encode:
            raise ModelError(f"{features.shape[1]} frames; this network reads {self.encode}.")
        return self.normalizer.inverse(self._whole(self.normalizer(features)))

    def loss(
        self,
        features: Tensor,
        noise: Tensor | None = None,
        lots: Tensor | None = None,
        stage: Tensor | None = None,
    ) -> Tensor:
        """Mean squared error of decoded frames and of predicted ones, added (eq. 5, 6), normalised.

        In training mode `bones` is added, and, except where the residual network learns, `smooth` and
        `penalty`.

        Parameters
        ----------
        features : (batch, encode + predict, dim).
        noise : like features; added to what is read, in normalised units, not to what is to be said.
        lots : (batch,) whole numbers; the first is the seed of what is dropped. None: nothing is.
        stage : (batch,) of `FIRST`, `ALONE` or `BEHIND`, all alike; None: the whole network at once.
        """
        features = checked_features(self, features)
        if features.shape[1] != self.frames:
            raise ModelError(
                f"Windows have {features.shape[1]} frames; this network learns from {self.frames}, "
                f"{self.encode} to read and {self.predict} to foretell."
            )
        true = self.normalizer(features)
        seen = true if noise is None else true + noise[..., self.normalizer.kept]
        chance = lots if lots is None else torch.Generator(true.device).manual_seed(int(lots[0]))
        stage = None if stage is None else int(stage[0])
        if stage is not None and stage != FIRST:
            # Of clean frames there is nothing to take away: it learns from frames with noise.
            with torch.no_grad(), at_rest(self):
                said = seen if stage == ALONE else self._said(seen[:, : self.encode])[0]
            return self._error(self._filtered(said), true)
        said, codes = self._said(seen[:, : self.encode], None if self.conditional else true, chance)
        said = said if stage == FIRST else self._filtered(said)
        error = self._error(said, true)
        if self.training and self.smooth:
            bends = said[..., self.glides].diff(n=2, dim=1)  # across the seam, too
            error = error + self.smooth * bends.square().mean()
        if self.training and self.penalty:
            weights = torch.cat(
                [p.flatten() for n, p in self.named_parameters() if "filter" not in n]
            )
            error = error + self.penalty * (weights.square().mean() + codes.square().mean())
        return error

    def _error(self, said: Tensor, true: Tensor) -> Tensor:
        off = (said - true).square()
        error = off[:, : self.encode].mean() + off[:, self.encode :].mean()
        if self.training and self.bones:
            off = 100 * self.encoding.bones_off(self.normalizer.inverse(said))
            error = error + self.bones * off.square().mean()
        return error

    def _said(
        self, seen: Tensor, true: Tensor | None = None, chance: torch.Generator | None = None,
        decoded: bool = True,
    ) -> tuple[Tensor, Tensor]:  # fmt: skip
        """What decoder and predictor say of seen (batch, encode, kept), in the order of time, and h."""
        return self._told(self._state(seen, chance), true, chance, decoded)

    def _state(self, seen: Tensor, chance: torch.Generator | None = None) -> tuple[Tensor, ...]:
        """The encoder's h and C (1, batch, width) each, after seen (batch, encode, kept)."""
        return self.encoder(self.enter(seen, chance) if self.spatial else seen)[1]

    def _told(
        self, state: tuple[Tensor, ...], true: Tensor | None = None,
        chance: torch.Generator | None = None, decoded: bool = True,
    ) -> tuple[Tensor, Tensor]:  # fmt: skip
        """What is said from a state, and h.

        true : (batch, encode + predict, kept), what both hear if they do not hear themselves.
        decoded : False leaves out the decoder's frames.
        """
        back_alone, ahead_alone = self._alone()
        back = ahead = None
        if true is not None:
            heard = self.enter(true, chance) if self.spatial else true
            back = heard[:, : self.encode]  # after frame t was to be said, t is heard
            back = back.flip(1)[:, :-1] if self.backward else back[:, :-1]
            ahead = heard[:, self.encode : -1]
        codes = self.predictor(state, self.predict, ahead_alone, ahead)
        if decoded:
            before = self.decoder(state, self.encode, back_alone, back)
            codes = torch.cat([before.flip(1) if self.backward else before, codes], 1)
        return (self.leave(codes, chance) if self.spatial else self.leave(codes)), codes

    def _alone(self) -> list[tuple[Tensor, Tensor]]:
        """Weights with which decoder and predictor hear themselves; at run time made once."""
        says = None if self.spatial else self.leave
        make = lambda: [part.alone(says) for part in (self.decoder, self.predictor)]
        return make() if torch.is_grad_enabled() else made_of(self, "alone", make)

    def _filtered(self, said: Tensor) -> Tensor:
        """Frames (batch, encode + predict, kept) as the residual network leaves them."""
        if not self.residual:
            return said
        return said + self.filter(said.flatten(1)).unflatten(1, said.shape[1:])

    def _whole(self, seen: Tensor) -> Tensor:
        return self._filtered(self._said(seen)[0])

    # -- at run time ------------------------------------------------------------------------------

    def extrapolate(
        self,
        features: Tensor,
        n: int,
        *,
        noise: float = 0.0,
        generator: torch.Generator | None = None,
        fade: int = 0,
    ) -> Tensor:
        """n frames (batch, n, dim) that go on from features (batch, frames, dim), in open loop.

        The last `encode` frames are read, the next `predict` said, and so on from there. Of features
        (frames, dim) it is (n, dim).

        Parameters
        ----------
        noise : standard deviation of what is added to frames that are read, in normalised units.
            Without it one start has one future, and it may end in a loop.
        generator : source of chance, for the noise.
        fade : frames over which the jump at the begin of each window dies away (`without_jumps`); 0: as
            the network says them. What it reads is as it said it, all the same.

        Raises
        ------
        ModelError : fewer frames than `encode`, another number of channels, NaN, n below 1, or a fade
            that does not end before its window.
        """
        check_noise(noise)
        features, one = checked_going_on(self, features, n, self.encode, "this network")
        if not isinstance(fade, Integral) or not 0 <= fade < self.predict:
            raise ModelError(f"extrapolate: fade is {fade!r}; give 0 to {self.predict - 1} frames.")
        seen, made = self.normalizer(features)[:, -self.encode :], []
        before = seen[:, [-min(2, self.encode), -1]]
        with at_rest(self):
            for _ in range(-(-n // self.predict)):
                read = seen + noise * normal(seen, generator) if noise else seen
                if self.residual:
                    said = self._whole(read)[:, self.encode :]
                else:
                    said, _ = self._said(read, decoded=False)
                made.append(said)
                seen = torch.cat([seen, said], 1)[:, -self.encode :]
        found = torch.cat(made, 1)[:, :n]
        if fade:
            found[..., self.glides] = without_jumps(
                torch.cat([before, found], 1)[..., self.glides], 2, self.predict, fade
            )[:, 2:]
        found = self.normalizer.inverse(found)
        return found[0] if one else found

    def reconstruct(self, features: Tensor) -> Tensor:
        """Features (batch, frames, dim) said again, `encode` frames at a time; like features.

        The last window ends with the last frame; where it overlaps the one before it, both count.
        Raises ModelError as `extrapolate` does.
        """
        return self._again("reconstruct", features, self.encode)

    def project(self, features: Tensor, step: int | None = None) -> Tensor:
        """Features (batch, frames, dim) brought to the manifold: what is noise can't be said again.

        Each frame is the mean of what is said of it in windows of `encode` frames, one every `step`
        frames, by default a quarter of them. Raises ModelError as `extrapolate` does, and for a step
        below 1 or beyond `encode`.
        """
        step = max(1, self.encode // 4) if step is None else step
        if not isinstance(step, Integral) or not 1 <= step <= self.encode:
            raise ModelError(f"project: step is {step!r}; it must lie between 1 and {self.encode}.")
        return self._again("project", features, step)

    def code(self, features: Tensor) -> Tensor:
        """What the encoder knows after the last `encode` of features (batch, frames, dim): h and C side
        by side, (batch, 2 width). A place on the manifold; `say` is the way back."""
        seen, one = self._checked("code", features)
        with at_rest(self):
            found = torch.cat([part[0] for part in self._state(seen[:, -self.encode :])], 1)
        return found[0] if one else found

    def say(self, code: Tensor) -> Tensor:
        """The frames (batch, encode + predict, dim) that are said of codes (batch, 2 width) of `code`;
        of one code (2 width,) they are (encode + predict, dim).

        Raises
        ------
        ModelError : codes of another size, or NaN.
        """
        size = self.codes * self.width
        code = torch.as_tensor(code).to(self.normalizer.mean)
        if code.ndim not in (1, 2) or code.shape[-1] != size or not bool(code.isfinite().all()):
            raise ModelError(
                f"say: codes of shape {tuple(code.shape)}; they must be (batch, {size}) without NaN, as "
                "`code` gives them."
            )
        one = code.ndim == 1
        state = (code[None] if one else code)[None].split(self.width, -1)
        with at_rest(self):
            said = self._filtered(self._told(tuple(part.contiguous() for part in state))[0])
        said = self.normalizer.inverse(said)
        return said[0] if one else said

    def _again(self, what: str, features: Tensor, step: int) -> Tensor:
        seen, one = self._checked(what, features)
        say = lambda window: self._whole(window)[:, : self.encode]
        with at_rest(self):
            found = mean_of_windows(seen, self.encode, step, say)
        found = self.normalizer.inverse(found)
        return found[0] if one else found

    def _checked(self, what: str, features: Tensor) -> tuple[Tensor, bool]:
        """Normalised (batch, frames, kept), and whether they came without a batch."""
        features = as_features(self, features)
        one = features.ndim == 2
        features = checked_features(self, features[None] if one else features)
        if features.shape[1] < self.encode:
            raise ModelError(
                f"{what}: {features.shape[1]} frames; this network reads {self.encode} at a time, so "
                "give as many or more."
            )
        return self.normalizer(features), one

    # -- settings ---------------------------------------------------------------------------------

    def config(self) -> dict:
        """What `from_config` needs to build an untrained copy; fit for JSON."""
        kept = {name: getattr(self, name) for name in self.settings}
        # older weights say neither
        kept |= {} if self.backward else {"backward": False}
        kept |= {"bones": self.bones} if self.bones else {}
        return {
            "encoding": self.encoding.config(), "kept": self.normalizer.kept.tolist(), **kept
        }  # fmt: skip

    @classmethod
    def from_config(cls, config: dict) -> Self:
        """A model of the right shapes, to be filled by `load_state_dict`."""
        encoding = encodings.from_config(config["encoding"])
        normalizer = Normalizer(encoding.dim, len(config["kept"]))
        normalizer.kept.copy_(torch.tensor(config["kept"]))
        names = (*cls.settings, *({"backward", "bones"} & config.keys()))
        return cls(encoding, normalizer, **{name: config[name] for name in names})


def _check(width, encode, predict, drop, **costs) -> None:
    if not isinstance(width, Integral) or width < 8 or width % 8:
        raise ModelError(f"Strnn: width is {width!r}; it must be a multiple of 8.")
    check_counts("Strnn", encode=encode, predict=predict)
    if not 0 <= drop < 1:
        raise ModelError(f"Strnn: drop is {drop!r}; it must be a share, from 0 to below 1.")
    for what, value in costs.items():
        if not 0 <= value < math.inf:
            raise ModelError(f"Strnn: {what} is {value!r}; it must be a number from 0.")
