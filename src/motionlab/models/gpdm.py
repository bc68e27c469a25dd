"""GPDM, the Gaussian process dynamical model: a few hundred frames, each a point that moves in a space.

Wang, Fleet and Hertzmann (2005), *Gaussian Process Dynamical Models*; a rival of STRNN in its table of
forecasts. Frames Y are a Gaussian process of points X of few dimensions, and each point is one of the
point before it. With K_Y and K_X, the covariances by two kernels, D channels and d dimensions ::

    -log p(X, Y) = D/2 log|K_Y| + tr(Y' K_Y^-1 Y)/2 + d/2 log|K_X| + tr(X+' K_X^-1 X+)/2 + ...

(eq. 6 to 11; X+ are the points that follow another). X and the kernels' scales are what makes that
least. Both processes are exact: time grows as the cube of the number of frames, so that it learns from
some hundreds and no more, here as many from each of some clips. GPyTorch, which has Gaussian processes
in many forms, has none whose inputs are again one; what it would save are two factorisations.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Self

import torch
from torch import Tensor, nn

from ..encodings import Encoding, Normalizer
from ..errors import ModelError
from .checks import check_counts, check_normalizer, checked_features, checked_going_on

MOST = 2_000  # frames; beyond, one step of learning takes seconds


class Gpdm(nn.Module):
    """Frames as a Gaussian process of points that move; see `fit`.

    Features go in and come out in raw units; inside they are normalised.

    Parameters
    ----------
    encoding : what a row of features means.
    normalizer : fitted on the training split.
    latent : dimensions of a point; 3 in the paper.
    encode : last frames of which points are found, to go on from.
    rounds : steps of gradient descent by which they are found.
    """

    def __init__(
        self, encoding: Encoding, normalizer: Normalizer, latent: int = 3, encode: int = 5,
        rounds: int = 40,
    ) -> None:  # fmt: skip
        super().__init__()
        check_normalizer(encoding, normalizer)
        check_counts("Gpdm", latent=latent, encode=encode, rounds=rounds)
        self.encoding, self.normalizer = encoding, normalizer
        self.latent, self.encode, self.rounds = latent, encode, rounds
        none = torch.zeros(0, dtype=torch.double)
        self.register_buffer("rows", none[:, None].expand(-1, len(normalizer.kept)))  # Y
        self.register_buffer("before", none.long())  # indices of points that another follows
        # log of: variance, reach^-2, of lines (unused by frames), of noise; for frames and for moves
        self.points = nn.Parameter(none[:, None].expand(-1, latent))
        self.of_frames = nn.Parameter(none.new_tensor([1.0, 1.0, 1e-9, 0.1]).log())
        self.of_moves = nn.Parameter(none.new_tensor([1.0, 1.0, 1.0, 0.01]).log())

    @property
    def fps(self) -> float:
        """Frames per second of the features."""
        return self.encoding.fps

    # -- learning ---------------------------------------------------------------------------------

    @classmethod
    def fit(
        cls, encoding: Encoding, normalizer: Normalizer, clips: Sequence[Tensor], latent: int = 3, *,
        length: int = 30, frames: int = 600, updates: int = 300, rate: float = 0.02,
    ) -> Self:  # fmt: skip
        """One of `length` frames from the middle of each of as many clips (frames, dim) as `frames` allow.

        Clips that are shorter are left out; where there are too many, they are spread evenly.

        Parameters
        ----------
        updates : steps of Adam, at a learning rate of `rate`.

        Raises
        ------
        ModelError : no clip is long enough, too many frames, NaN.
        """
        check_counts("Gpdm.fit", length=length, frames=frames, updates=updates)
        if not 2 <= length <= frames <= MOST:
            raise ModelError(
                f"Gpdm.fit: {frames} frames in pieces of {length}; give 2 or more a piece, and at most "
                f"{MOST} in all, since time grows as their cube."
            )
        model = cls(encoding, normalizer, latent)
        long = [clip for clip in clips if len(clip) >= length]
        if not long:
            raise ModelError(
                f"Gpdm.fit: none of {len(clips)} clips has {length} frames; give longer ones, or ask "
                "for a smaller length."
            )
        count = min(len(long), frames // length)
        chosen = [long[i * len(long) // count] for i in range(count)]
        pieces = torch.stack([clip[(len(clip) - length) // 2 :][:length] for clip in chosen])
        model._learn(normalizer(checked_features(model, pieces)).double(), updates, rate)
        return model

    def _learn(self, pieces: Tensor, updates: int, rate: float) -> None:
        """Points and scales of pieces (pieces, length, kept)."""
        count, length, _ = pieces.shape
        self.rows = pieces.flatten(0, 1)
        self.before = torch.arange(count * length).unflatten(0, (count, length))[:, :-1].flatten()
        middle = self.rows - self.rows.mean(0)
        found = torch.linalg.svd(middle, full_matrices=False)[0][:, : self.latent]
        self.points = nn.Parameter(
            found * len(found) ** 0.5
        )  # the first guess: principal components
        optimizer = torch.optim.Adam(self.parameters(), rate)
        for _ in range(updates):
            optimizer.zero_grad()
            self.cost().backward()
            optimizer.step()
        self.points.grad = None

    def cost(self) -> Tensor:
        """-log p(X, Y, scales) but for constants; X_1 are standard normal, scales have p = 1 / scale."""
        follow = self.points[self.before + 1]
        first = torch.ones(len(self.points), dtype=torch.bool)
        first[self.before + 1] = False
        return (
            _minus_log(_covariance(self.of_frames, self.points), self.rows)
            + _minus_log(_covariance(self.of_moves, self.points[self.before]), follow)
            + self.points[first].square().sum() / 2
            + self.of_frames[[0, 1, 3]].sum() + self.of_moves.sum()
        )  # fmt: skip

    # -- at run time ------------------------------------------------------------------------------

    def extrapolate(self, features: Tensor, n: int) -> Tensor:
        """n frames (batch, n, dim) that go on from features (batch, frames, dim).

        Points of the last `encode` frames are found, then each next one is the mean of its process, and
        so is its frame: no chance is in it. Of features (frames, dim) it is (n, dim). Raises ModelError
        for fewer frames than `encode`, another number of channels, NaN, n below 1, or if nothing was
        learned.
        """
        if not len(self.rows):
            raise ModelError("extrapolate: this GPDM has learned nothing; `Gpdm.fit` makes one.")
        features, one = checked_going_on(self, features, n, self.encode, "this GPDM")
        with torch.no_grad():
            frames = _Process(self.of_frames, self.points, self.rows)
            follow = self.points[self.before + 1]
            moves = _Process(self.of_moves, self.points[self.before], follow)
        seen = self.normalizer(features)[:, -self.encode :].double()
        point, made = self._found(seen, frames, moves)[:, -1], []
        for _ in range(n):
            point = moves.mean(point)
            made.append(frames.mean(point))
        found = self.normalizer.inverse(torch.stack(made, 1).to(features))
        return found[0] if one else found

    @torch.enable_grad()
    def _found(self, seen: Tensor, frames: _Process, moves: _Process) -> Tensor:
        """The likeliest points (batch, encode, latent) of frames (batch, encode, kept); those of the
        nearest frames that were learned are the first guess."""
        nearest = torch.cdist(seen, self.rows[None]).argmin(-1)
        points = self.points.detach()[nearest].requires_grad_()
        optimizer = torch.optim.Adam([points], 0.05)
        for _ in range(self.rounds):
            unlikely = frames.minus_log(points, seen).sum()
            unlikely = unlikely + moves.minus_log(points[:, :-1], points[:, 1:]).sum()
            (points.grad,) = torch.autograd.grad(unlikely, points)
            optimizer.step()
        return points.detach()


class _Process:
    """A Gaussian process that has seen outputs (seen, channels) of inputs (seen, latent)."""

    def __init__(self, scales: Tensor, inputs: Tensor, outputs: Tensor) -> None:
        self.scales, self.inputs = scales.detach(), inputs.detach()
        root = torch.linalg.cholesky(_covariance(self.scales, self.inputs))
        self.inverse = torch.cholesky_inverse(root)
        self.weights = self.inverse @ outputs.detach()

    def mean(self, points: Tensor) -> Tensor:
        """Outputs (..., channels) of points (..., latent)."""
        return _kernel(self.scales, points, self.inputs) @ self.weights

    def minus_log(self, points: Tensor, outputs: Tensor) -> Tensor:
        """-log of the density of each output (..., channels), given its point, but for constants."""
        near = _kernel(self.scales, points, self.inputs)
        size, _, lines, noise = self.scales.exp()
        variance = size + lines * points.square().sum(-1) + noise
        variance = (variance - ((near @ self.inverse) * near).sum(-1)).clamp(min=1e-9)
        off = (outputs - near @ self.weights).square().sum(-1)
        return (outputs.shape[-1] * variance.log() + off / variance) / 2


def _kernel(scales: Tensor, some: Tensor, others: Tensor) -> Tensor:
    """Covariances (..., others) of points (..., latent) and others (others, latent); no noise."""
    size, near, lines, _ = scales.exp()
    inner = some @ others.T
    far = some.square().sum(-1, keepdim=True) - 2 * inner + others.square().sum(-1)
    return size * (-near / 2 * far).exp() + lines * inner


def _covariance(scales: Tensor, points: Tensor) -> Tensor:
    """Of points (points, latent) with each other, with noise."""
    return _kernel(scales, points, points) + scales[3].exp() * torch.eye(len(points)).to(points)


def _minus_log(covariance: Tensor, outputs: Tensor) -> Tensor:
    """-log of the density of outputs (points, channels), each channel by itself, but for constants."""
    root = torch.linalg.cholesky(covariance)
    white = torch.linalg.solve_triangular(root, outputs, upper=False)
    return outputs.shape[1] * root.diagonal().log().sum() + white.square().sum() / 2
