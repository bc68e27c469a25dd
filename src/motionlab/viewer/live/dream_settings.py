"""What both forms of a dream share: settings that a reader may change, and the motion they make."""

from __future__ import annotations

import inspect
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import torch
from torch import Tensor, nn

from ...encodings import JointAngles
from ...errors import ViewerError
from .network_weights import check_refiner
from .player import Track
from .show import trail_points


@dataclass(frozen=True)
class Control:
    """A setting that the reader may change: the same in a page and in a notebook's widgets."""

    name: str  # as `generate` calls it, where it knows it
    label: str
    help: str
    min: float
    max: float
    step: float
    value: float


CONTROLS = (
    Control("start", "Start", "What the body was doing before the network took over", 0, 0, 1, 0),
    Control("temperature", "Temperature", "Factor on the standard deviations: 1 is what was "
            "learned, less is calmer", 0.05, 2, 0.01, 1),
    Control("component_temperature", "Component temperature", "Near 0 the likeliest component "
            "always wins; 1 is what was learned", 0.05, 2, 0.05, 1),
    Control("memory", "Memory of the noise", "How much of its chance a frame keeps from the one "
            "before: with 0 it trembles, with 0.9 it changes its mind", 0, 0.99, 0.01, 0),
    Control("noise", "Input noise", "Standard deviation of what is added to all that the network "
            "sees", 0, 1, 0.01, 0),
    Control("characters", "Characters", "As many futures of the same start", 1, 8, 1, 1),
    Control("seed", "Seed", "The same seed gives the same motion", 0, 9999, 1, 0),
)  # fmt: skip
REFINED = Control("refined", "Refine the feet", "A second network corrects what the first makes, "
                  "which knows nothing of it", 0, 1, 1, 1)  # fmt: skip
_OF_EVERY_MODEL = ("start", "characters", "seed")


def controls_of(model: nn.Module, refiner: nn.Module | None = None) -> list[Control]:
    """Those that a model has a use for: what its `generate` takes decides; and that of a refiner."""
    takes = inspect.signature(model.generate).parameters
    its = [c for c in CONTROLS if c.name in _OF_EVERY_MODEL or c.name in takes]
    return its if refiner is None else [*its, REFINED]


def check_starts(model: nn.Module, start: int = 0) -> None:
    """Raise ViewerError if a model has no states to start from, or none of this number."""
    names = getattr(model, "start_names", ())
    if not names:
        raise ViewerError(
            "This model has no states to start from; motionlab.load gives it some, or set "
            "model.starts = model.observe(features) and model.start_names = ('name', ...)."
        )
    if start not in range(len(names)):
        raise ViewerError(
            f"start is {start!r}; this model has {len(names)}: give a number from 0 to {len(names) - 1}."
        )


@torch.no_grad()
def sampled_tracks(
    model: nn.Module,
    state: Any,
    frames: int,
    *,
    seed: int,
    color: str,
    refiner: nn.Module | None = None,
    **sampling: float,
) -> list[Track]:
    """What a player shows of motions that go on from a state, its own frame first; refined, if by one."""
    chance = torch.Generator(next(model.parameters()).device).manual_seed(seed)
    sampled = model.generate(frames, state, generator=chance, **sampling)
    features = torch.cat([state.frame[:, None].to(sampled), sampled], dim=1).cpu()
    if refiner is not None:
        check_refiner(model, refiner)
        features = refiner(features)
    encoding = model.encoding
    # Features of points have them: through `to_motion` they would be bent to the bones' lengths.
    points, contacts = encoding.positions(features), encoding.contacts(features)
    skeleton = encoding.skeleton
    if encoding.points != skeleton.points:  # joints alone
        skeleton = skeleton.without_end_sites()
    feet = [None] * len(points) if contacts is None else touching(contacts)
    motions = [None] * len(points)
    if isinstance(encoding, JointAngles):
        motions = [encoding.to_motion(each) for each in features]
    parts = zip(points, feet, motions, strict=True)
    return [Track(p, skeleton, "", color, f, name_of(model), m) for p, f, m in parts]


def name_of(model: nn.Module) -> str:
    """What a file is called that is saved of a model's motion."""
    return getattr(model, "about", {}).get("name", "dream")


def trail_of(trail: str | int | Sequence[str | int] | None, tracks: list[Track]) -> list[int]:
    """Points that leave a trail; by default hips and toes, or feet where a body has no toes."""
    if trail is None:
        toes = ("left_toes", "right_toes")
        body = tracks[0].skeleton
        toes = [toe if toe in body.roles else toe.replace("toes", "foot") for toe in toes]
        trail = [body.role(role) for role in ("hips", *toes)]
    return trail_points(trail, tracks)


def touching(contacts: Tensor) -> Tensor:
    """Heels and toes (..., 4) on the ground, from an encoding's channels; some have toes alone."""
    if contacts.shape[-1] == 2:
        left, right = contacts.unbind(-1)
        never = torch.zeros_like(left)
        contacts = torch.stack([never, left, never, right], dim=-1)
    return contacts > 0.5
