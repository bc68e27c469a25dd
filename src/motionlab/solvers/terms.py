"""What one may wish of a motion, each wish a term of an energy (RNN-GAN, sections 5.2 to 5.4).

A term is a plain function ``term(features, positions, contacts) -> (batch,)``: the negative
logarithm of a Gaussian, without its constant, summed over the frames of a window. The functions
here make such functions from what is wished. A term gets

* features (batch, 1 + frames, dim), raw units;
* positions (batch, 1 + frames, points, 3) in metres, where they stand in the world;
* contacts (batch, 1 + frames, 2 or 4) from 0 to 1, or None if the model has none.

Row 0 of each is the frame before the window, which stands fast: speeds and slides of the first frame
are seen from there. Whatever follows this contract is a term, wherever it stands. A term that looks at
some points only may say so by an attribute `points`: what nobody looks at is NaN, and costs nothing.

The paper leaves out the 2 of a Gaussian's denominator in (18), (19), (23) and (24), and has it in
(17) and (26); here every σ is a standard deviation. Their defaults are told in the book under *Assumptions and
deviations*, with what was measured (``experiments/rnn_gan/control_spreads.py``).
"""

from __future__ import annotations

from collections.abc import Callable

import torch
from torch import Tensor

from ..encodings import JointAngles
from ..errors import SolverError
from ..feet.contacts import foot_points, rest_heights
from ..metrics import facing
from ..metrics.broken import outside
from ..paths import Piece
from ..skeleton import Skeleton

Term = Callable[[Tensor, Tensor, Tensor | None], Tensor]

PATH = 0.007  # m; people sway by four times that, so this is already a strict wish
TIME = 0.1  # m along the path; people sway 2.7 cm to and fro, and change their pace by more
AHEAD = 0.15  # m; half a second of a sideways sway of 0.2 m/s, and some
SPEED = 0.1  # m/s of a window's mean speed
FACING = 0.2  # rad; people face 0.19 off their way
STEP = 0.03  # m
SLIDE, HEIGHT = 0.004, 0.008  # m a frame, m: a fifth of what sampled toes do; recorded do neither
PLANTED = 0.3  # m/s of the slowest part of the feet
REST = 0.006  # m a frame: less holds feet better, and jerks them
POSE = (
    0.03  # rad, and m of the root's height, beyond what the data do; that is broken from 0.1 rad on
)
SLOW = 0.45  # m/s, of a foot in contact: the paper's
ROOT, ANGLE = 0.02, 0.08  # m, rad: the weaker noise that denoising is tried on
_GROUND = [0, 2]


def _looking_at(*points: int) -> Callable[[Term], Term]:
    """Says of a term which points of the body it looks at."""

    def said(term: Term) -> Term:
        term.points = frozenset(points)
        return term

    return said


def path(piece: Piece, point: int = 0, std: float = PATH) -> Term:
    """A point of the body is above a path at all times (eq. 18), wherever on it.

    Parameters
    ----------
    piece : the stretch of path that this window may use.
    point : which of the body's points: 0 is the root.
    std : σ_fit in metres.
    """

    @_looking_at(point)
    def term(features: Tensor, positions: Tensor, contacts: Tensor | None) -> Tensor:
        places = positions[:, 1:, point, _GROUND]
        return _gaussian(places - piece.nearest(places).places, std)

    return term


def time(piece: Piece, arcs: Tensor, point: int = 0, std: float = TIME) -> Term:
    """... and on it in time: arcs (batch, frames), metres of path that should lie behind it."""

    @_looking_at(point)
    def term(features: Tensor, positions: Tensor, contacts: Tensor | None) -> Tensor:
        there = piece.nearest(positions[:, 1:, point, _GROUND]).arcs
        return _gaussian(there - arcs.to(there), std)

    return term


def ahead(
    piece: Piece, fps: float, frames: int = 10, seconds: float = 0.5, std: float = AHEAD
) -> Term:
    """The end of a window looks ahead: who goes on as in the last `frames` is above the path later.

    Without it nothing says where the last frames should lead, and the next window pays for it. Not
    the paper's.
    """

    @_looking_at(0)
    def term(features: Tensor, positions: Tensor, contacts: Tensor | None) -> Tensor:
        places = positions[:, :, 0, _GROUND]
        some = min(frames, places.shape[1] - 1)
        velocity = (places[:, -1] - places[:, -1 - some]) * (fps / some)
        later = (places[:, -1] + seconds * velocity)[:, None]
        return _gaussian(later - piece.nearest(later).places, std)

    return term


def speed(wanted: Tensor | float, fps: float, std: float = SPEED) -> Term:
    """The root's mean speed over the ground in the window is `wanted` (batch,) m/s (eq. 23)."""

    @_looking_at(0)
    def term(features: Tensor, positions: Tensor, contacts: Tensor | None) -> Tensor:
        moves = positions[:, :, 0, _GROUND].diff(dim=1)
        moved = moves.square().sum(-1).clamp(min=1e-12).sqrt()  # standing has a slope, too
        return _gaussian((fps * moved.mean(1) - wanted)[:, None], std)

    return term


def direction(wanted: Tensor | float, skeleton: Skeleton, std: float = FACING) -> Term:
    """In its last frame the body faces `wanted` (batch,) radians, 0 is +z, π/2 is +x (eq. 24)."""

    def term(features: Tensor, positions: Tensor, contacts: Tensor | None) -> Tensor:
        off = facing(positions[:, -1:], skeleton)[:, 0] - wanted
        return _gaussian(torch.remainder(off + torch.pi, 2 * torch.pi)[:, None] - torch.pi, std)

    return term


def turn(wanted: Tensor | float, std: float = FACING) -> Term:
    """Over the window the body turns by `wanted` (batch,) radians, more than one turn if need be.

    Of features whose third channel is the root's turn from frame to frame, as of `JointAngles`.
    """

    @_looking_at()
    def term(features: Tensor, positions: Tensor, contacts: Tensor | None) -> Tensor:
        return _gaussian((features[:, 1:, 2].sum(1) - wanted)[:, None], std)

    return term


def step_length(wanted: Tensor | float, skeleton: Skeleton, std: float = STEP) -> Term:
    """Wherever a toe sets down, it does so `wanted` (batch,) metres from the other one."""
    toes = [foot_points(skeleton)[channel] for channel in (1, 3)]

    @_looking_at(*toes)
    def term(features: Tensor, positions: Tensor, contacts: Tensor | None) -> Tensor:
        down = _toes(contacts)
        strikes = (down[:, 1:] & ~down[:, :-1]).any(-1)  # (batch, frames)
        left, right = positions[:, 1:, toes][..., _GROUND].unbind(2)
        apart = (left - right).square().sum(-1).clamp(min=1e-12).sqrt()
        off = apart - torch.as_tensor(wanted).to(apart).expand(len(apart))[:, None]
        return _gaussian(off * strikes, std)

    return term


def contact(skeleton: Skeleton, slide: float = SLIDE, height: float = HEIGHT) -> Term:
    """Toes in contact stay where they are, and lie on the floor y = 0 (eq. 19).

    Contacts are the network's own words, above one half. They count as they are: a term that could
    reach them would rather unsay the contact than hold the foot.
    """
    toes = [foot_points(skeleton)[channel] for channel in (1, 3)]
    low = rest_heights(skeleton)[[1, 3]]

    @_looking_at(*toes)
    def term(features: Tensor, positions: Tensor, contacts: Tensor | None) -> Tensor:
        down, feet = _toes(contacts), positions[:, :, toes]
        held = down[:, 1:] & down[:, :-1]
        slides = feet[..., _GROUND].diff(dim=1) * held[..., None]
        above = (feet[:, 1:, :, 1] - low.to(feet)) * down[:, 1:]
        return _gaussian(slides.flatten(2), slide) + _gaussian(above, height)

    return term


def resting(skeleton: Skeleton, fps: float, slide: float = REST, slower: float = SLOW) -> Term:
    """What is slow rests: heels and toes that move by less than `slower` m/s do not move at all.

    The network tells of toes only, and now and then a frame too late. This asks the feet themselves,
    by the rule that labels recorded feet (section 4.3). Not the paper's.
    """
    feet = foot_points(skeleton)

    @_looking_at(*feet)
    def term(features: Tensor, positions: Tensor, contacts: Tensor | None) -> Tensor:
        moves = positions[:, :, feet].diff(dim=1)  # (batch, frames, 4, 3)
        slow = (moves.detach().norm(dim=-1) * fps < slower)[..., None]
        return _gaussian((moves[..., _GROUND] * slow).flatten(2), slide)

    return term


def planted(skeleton: Skeleton, fps: float, speed: float = PLANTED) -> Term:
    """In each frame some part of the feet rests: who goes on without gets dearer with its speed, m/s.

    A network that was led astray may glide: its feet move as fast as the body, and as it says that
    neither is in contact, `contact` asks for nothing. A run's flight pays, too, but pays in any case.
    Not the paper's.
    """
    feet = foot_points(skeleton)

    @_looking_at(*feet)
    def term(features: Tensor, positions: Tensor, contacts: Tensor | None) -> Tensor:
        moves = positions[:, :, feet].diff(dim=1)[..., _GROUND]
        return _gaussian(fps * moves.norm(dim=-1).amin(-1), speed)

    return term


def poses(encoding: JointAngles, std: float = POSE) -> Term:
    """No joint goes beyond the range that it has in the data; within, this says nothing.

    The network was shown no such poses, but does not rule them out: an elbow may bend a little the
    wrong way if that brings the root nearer to its path. Not the paper's.

    encoding : one that `metrics.broken` knows.
    """

    @_looking_at()
    def term(features: Tensor, positions: Tensor, contacts: Tensor | None) -> Tensor:
        return _gaussian(outside(encoding, features[:, 1:]), std)

    return term


def places(
    wanted: Tensor, points: list[int], mask: Tensor | None = None, std: float = ROOT
) -> Term:
    """Points of the body are where they were seen (eq. 26, the root).

    Parameters
    ----------
    wanted : (batch, frames, len(points), 3) metres; what the mask leaves out may be anything.
    points : which they are; [0] is the root.
    mask : bool (batch, frames, len(points)), which were seen. None: all.
    std : σ_root in metres.
    """

    @_looking_at(*points)
    def term(features: Tensor, positions: Tensor, contacts: Tensor | None) -> Tensor:
        return _seen(
            positions[:, 1:, points], wanted, None if mask is None else mask[..., None], std
        )

    return term


def headings(wanted: Tensor, mask: Tensor | None = None, std: float = ANGLE) -> Term:
    """The root faces the way that it was seen to face (eq. 26, the root's turn).

    Parameters
    ----------
    wanted : (batch, frames) radians from where it faced in row 0, more than half a turn if need be.
    mask : bool, like wanted, which were seen. None: all.
    """

    @_looking_at()
    def term(features: Tensor, positions: Tensor, contacts: Tensor | None) -> Tensor:
        return _seen(features[:, 1:, 2].cumsum(1), wanted, mask, std)

    return term


def channels(
    wanted: Tensor, which: slice, mask: Tensor | None = None, std: Tensor | float = ANGLE
) -> Term:
    """Channels of the features are what was seen (eq. 26, the joint angles).

    Parameters
    ----------
    wanted : (batch, frames, channels) in the features' units.
    which : channels, such as ``encoding.slices["pose"]``.
    mask : bool, like wanted, which were seen. None: all.
    std : σ_angle in the features' units, one or one a channel.
    """

    @_looking_at()
    def term(features: Tensor, positions: Tensor, contacts: Tensor | None) -> Tensor:
        return _seen(features[:, 1:, which], wanted, mask, std)

    return term


def _seen(found: Tensor, wanted: Tensor, mask: Tensor | None, std: Tensor | float) -> Tensor:
    wanted = wanted.to(found)
    if mask is not None:  # what was not seen may be NaN
        wanted = torch.where(mask, wanted, found)
    return _gaussian(found - wanted, std)


def _toes(contacts: Tensor | None) -> Tensor:
    """Whether left and right toe are down, bool (batch, 1 + frames, 2)."""
    if contacts is None:
        raise SolverError(
            "A term of contacts, but this model's features have none; take one that has, such as "
            "lstm-gmm-contacts, or leave the term out."
        )
    toes = contacts if contacts.shape[-1] == 2 else contacts[..., [1, 3]]
    return toes.detach() > 0.5


def _gaussian(off: Tensor, std: Tensor | float) -> Tensor:
    """Half the squares of off (batch, ...), in deviations, summed: (batch,)."""
    return (off / std).square().flatten(1).sum(1) / 2
