"""What `denoise` refuses, and what it says then."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import torch
from torch import Tensor, nn

from ..encodings import JointAngles
from ..errors import SolverError
from ..models import LstmGmm
from ..motion import Motion
from .denoise_seen import FEWEST, NoiseLevels
from .denoise_windows import Settings
from .window import METHODS

FARTHEST = (
    5.0  # m that a root may be from where it stands at rest, up or down: no one climbs farther
)


def called(clip: Motion) -> str:
    """What a clip is called in words to a reader."""
    return f"Clip {clip.name!r}" if clip.name else "The clip"


def check_model(model: nn.Module) -> None:
    """Raise SolverError for a model that can't say how likely a motion is."""
    kind = type(model).__name__
    if not isinstance(model, LstmGmm):
        raise SolverError(
            f"{kind} has no likelihood to weigh what was seen against; take an LstmGmm."
        )
    encoding = model.encoding
    if not isinstance(encoding, JointAngles) or encoding.rotation != "vector":
        raise SolverError(
            f"This {kind} is on {type(encoding).__name__}; denoise needs one on JointAngles of rotation "
            "vectors, such as lstm-gmm-contacts."
        )


def check_settings(how: Settings) -> None:
    """Raise SolverError for settings that make no sense."""
    if how.method not in METHODS:
        raise SolverError(f"method is {how.method!r}; it must be one of {', '.join(METHODS)}.")
    if not (0 <= 2 * how.overlap <= how.window and how.window > 1):
        raise SolverError(
            f"Windows of {how.window} frames that share {how.overlap}: they may share half of them at "
            "most, and need 2 frames or more."
        )
    if min(how.steps, how.rounds, how.batch, how.memory) < 1:
        raise SolverError(
            f"{how.steps} steps, {how.rounds} rounds, batches of {how.batch}, a memory of {how.memory} "
            "frames: each must be 1 or more."
        )
    if not (0 <= how.slow < math.inf and 0 < how.spread < math.inf):
        raise SolverError(
            f"slow is {how.slow} m/s and spread {how.spread} frames; both are numbers from 0 on, spread "
            "above it."
        )
    if how.least is not None and not isinstance(how.least, int | float):
        raise SolverError(f"least is {how.least!r}; it must be a number of nats a frame, or None.")
    if not all(0 <= weight < math.inf for weight in (how.prior, how.contact)):
        raise SolverError(
            f"prior {how.prior} and contact {how.contact} are factors, from 0 on, of two terms."
        )


def check_length(clip: Motion) -> None:
    """Raise SolverError for a clip of too few frames."""
    if len(clip) < FEWEST:
        raise SolverError(
            f"{called(clip)} has {len(clip)} frames, too few to tell noise from motion; {FEWEST} are needed."
        )


def check_clip(encoding: JointAngles, clip: Motion) -> None:
    """Raise SolverError for a clip that can't be cleaned as it is."""
    if not isinstance(clip, Motion):
        raise SolverError(f"denoise takes a Motion or a list of them, not {type(clip).__name__}.")
    check_length(clip)
    if not encoding.skeleton.matches(clip.skeleton):
        raise SolverError(
            f"{called(clip)} is on another body than the model's: "
            f"{encoding.skeleton.difference(clip.skeleton)}. Take `solvers.clean_recording`, which "
            "cleans any rig, or motion.retarget()."
        )
    if abs(clip.fps - encoding.fps) > 1e-4 * encoding.fps:
        raise SolverError(
            f"{called(clip)}: the model knows motion at {encoding.fps:g} frames a second. Take "
            f"`solvers.clean_recording`, which cleans any rate, or motion.resample({encoding.fps:g})."
        )
    off = float((clip.root_positions[:, 1] - encoding.skeleton.rest_points[0, 1]).abs().median())
    if off > FARTHEST:
        raise SolverError(
            f"{called(clip)}: its root is {off:.0f} m above or below where it is when the body stands. Are "
            "its lengths in metres (units='mm' reads millimetres), and is y up?"
        )


def other_unit(too_large: bool) -> str:
    """What to do about a body of no person's size, in words."""
    than, some = ("smaller", "'cm' or units='mm'") if too_large else ("larger", "'cm' or units='m'")
    return f"Its unit is {than} than the one it was read in; try units={some}."


def check_levels(noise: Any) -> NoiseLevels:
    """Levels of noise as such; SolverError for what is none."""
    try:
        root, angle = map(float, noise)
    except (TypeError, ValueError):
        root = angle = math.nan
    if not (0 < root < math.inf and 0 < angle < math.inf):
        raise SolverError(
            f"noise is {noise!r}; it must be two numbers above 0, of the root in metres and of angles "
            "in radians, as NoiseLevels(0.02, 0.08), or None, and the clip tells it."
        )
    return NoiseLevels(root, angle)


def mask_of(clip: Motion, missing: Any) -> Tensor:
    """What of a clip was seen, bool (frames, joints); SolverError for a mask that does not fit."""
    frames, joints = len(clip), clip.skeleton.joints
    seen = torch.ones(frames, joints, dtype=torch.bool)
    if missing is None:
        return seen
    try:
        mask = torch.as_tensor(missing)
    except (TypeError, ValueError, RuntimeError) as error:
        raise SolverError(
            f"{called(clip)}: missing must be an array of truth values: {error}."
        ) from error
    if mask.dtype != torch.bool or mask.shape not in ((frames,), (frames, joints)):
        raise SolverError(
            f"{called(clip)}: missing is {mask.dtype} of shape {tuple(mask.shape)}; it must be bool, "
            f"({frames},) or ({frames}, {joints}), true where nothing was seen."
        )
    seen &= ~(mask if mask.ndim == 2 else mask[:, None])
    if int(seen.any(1).sum()) < FEWEST:
        raise SolverError(
            f"{called(clip)}: in all but {int(seen.any(1).sum())} frames all joints are missing; "
            f"{FEWEST} with something in them are needed."
        )
    if int(seen[:, 0].sum()) < FEWEST:
        raise SolverError(
            f"{called(clip)}: its root is missing in all but {int(seen[:, 0].sum())} frames, so nobody knows "
            f"where it goes; {FEWEST} are needed."
        )
    return seen


def start_of(clip: Motion, start: Any) -> Motion:
    """A motion that the search may begin with; SolverError for another body, rate or length."""
    if (
        not isinstance(start, Motion)
        or len(start) != len(clip)
        or not start.skeleton.matches(clip.skeleton)
        or abs(start.fps - clip.fps) > 1e-4 * clip.fps
    ):
        raise SolverError(
            f"{called(clip)}: start is {start!r}; it must be a motion of the same body, rate and length."
        )
    return start


def theirs(name: str, given: Any, clips: int, alone: bool) -> list:
    """What was given for each clip; SolverError if there are not as many."""
    if alone or given is None:
        return [given] * clips
    if isinstance(given, Tensor | Motion) or not isinstance(given, Sequence) or len(given) != clips:
        raise SolverError(f"{name} must be a list of {clips}, one for each motion, or None.")
    return list(given)
