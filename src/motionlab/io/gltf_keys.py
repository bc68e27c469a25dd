"""A glTF animation: which node is moved how, at which times, and what it does between them."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation, Slerp

from .bvh_rate import RATES, whole
from .gltf_file import LARGEST, File, brief, is_count

MOVES = {"translation": "VEC3", "rotation": "VEC4", "scale": "VEC3"}
_WAYS = ("LINEAR", "STEP", "CUBICSPLINE")
_SAME = 5e-4  # seconds; keys that are nearer to each other are one frame's
_FLOAT32 = 2.0**-22  # share of a time by which its rounding may be off
_DEFAULT = 30.0
# Frames per second of what was recorded, or exported frame by frame.
_SLOWEST, _FASTEST = 1.0, 1000.0
# Keys that come more slowly are poses, and what lies between them counts, where curves join them or
# they are few: any two keys are even.
_POSES, _FEW = 10.0, 10
_MOSTLY = 0.5  # of the frames that have a key; exporters leave out what interpolation gives
# Share of a frame by which keys may miss it: by the rounding of float32, and of milliseconds.
_ROUNDED, _COARSE = 0.01, 0.05
_ALIKE = 1.1  # gaps between keys that differ by less are one frame each, rounded
_MOST = 5_000_000  # frames


@dataclass(frozen=True)
class Track:
    """What one node does in one way.

    Attributes
    ----------
    times : (keys,) seconds, ascending.
    values : (keys, 3), or (keys, 4) quaternions, w last; of a curve, CUBICSPLINE, (keys, 3, ...)
        with the slope that comes in, the value, the slope that goes out.
    way : from key to key: LINEAR, STEP, CUBICSPLINE.
    """

    times: np.ndarray
    values: np.ndarray
    way: str

    def at(self, when: np.ndarray) -> np.ndarray:
        """Values (frames, 3 or 4) at times (frames,); before the first key and after the last
        these. LINEAR turns quaternions along the shorter arc."""
        keyed = self.values[:, 1] if self.way == "CUBICSPLINE" else self.values
        if np.array_equal(when, self.times):  # as exporters write them, mostly
            return keyed
        when = when.clip(self.times[0], self.times[-1])
        if self.way == "STEP" or len(self.times) == 1:
            return keyed[np.searchsorted(self.times, when, side="right") - 1]
        if self.way == "CUBICSPLINE":
            return self._curve(when)
        if self.values.shape[-1] == 4:
            return Slerp(self.times, Rotation.from_quat(self.values))(when).as_quat()
        return np.stack([np.interp(when, self.times, axis) for axis in self.values.T], axis=1)

    def _curve(self, when: np.ndarray) -> np.ndarray:
        """Cubic Hermite splines, appendix C.5 of the format."""
        after = np.searchsorted(self.times, when, side="right").clip(1, len(self.times) - 1)
        start, span = self.times[after - 1, None], np.diff(self.times)[after - 1, None]
        t = (when[:, None] - start) / span
        (_, p, leaving), (arriving, q, _) = (
            np.moveaxis(self.values[keys], 1, 0) for keys in (after - 1, after)
        )
        return (
            (2 * t**3 - 3 * t**2 + 1) * p
            + (t**3 - 2 * t**2 + t) * span * leaving
            + (3 * t**2 - 2 * t**3) * q
            + (t**3 - t**2) * span * arriving
        )


def moved(file: File, animation: dict) -> set[int]:
    """The nodes that an animation moves."""
    nodes = [node for node, what, _ in _channels(file, animation) if what in MOVES]
    for node in nodes:
        file.item("nodes", node)
    return set(nodes)


def tracks(file: File, animation: dict, nodes: Iterable[int]) -> dict[tuple[int, str], Track]:
    """What an animation does to some nodes, by node and "translation", "rotation" or "scale"."""
    nodes, found = set(nodes), {}
    samplers = file.listed(animation.get("samplers"), "the samplers of an animation")
    for node, what, sampler in _channels(file, animation):
        if node not in nodes or what not in MOVES:
            continue
        name = f"the {what} of node {node}"
        if (node, what) in found:
            file.fail(f"{name} is animated twice in one animation")
        if not is_count(sampler) or sampler >= len(samplers):
            file.fail(f"{name} has no keys")
        found[node, what] = _track(
            file, file.object(samplers[sampler], "a sampler"), MOVES[what], name
        )
    return found


def _channels(file: File, animation: dict) -> list[tuple]:
    """Node, what of it is moved, and sampler of each channel that is about a node."""
    found = []
    for channel in file.listed(animation.get("channels"), "the channels of an animation"):
        channel = file.object(channel, "a channel of an animation")
        target = file.object(channel.get("target"), "the target of a channel")
        if "node" in target and isinstance(target.get("path"), str):
            found.append((target["node"], target["path"], channel.get("sampler")))
    return found


def _track(file: File, sampler: dict, kind: str, name: str) -> Track:
    way = sampler.get("interpolation", "LINEAR")
    if not isinstance(way, str) or way not in _WAYS:
        file.fail(f"{name} goes from key to key by {brief(way)}, which glTF does not have")
    times = file.numbers(sampler.get("input"), "SCALAR")[:, 0]
    values = file.numbers(sampler.get("output"), kind)
    if way == "CUBICSPLINE":
        values = values.reshape(-1, 3, values.shape[1]) if len(values) % 3 == 0 else values[:0]
    if not len(times) or len(values) != len(times):
        file.fail(f"{name} has {len(times)} keys with {len(values)} values")
    if not ((np.abs(times) <= LARGEST).all() and (np.abs(values) <= LARGEST).all()):
        file.fail(f"{name} has keys that are no numbers (NaN), or too large", "export it again")
    if (np.diff(times) <= 0).any():
        file.fail(f"the keys of {name} do not ascend in time", "export it again")
    if kind == "VEC4":
        turns = values[:, 1] if way == "CUBICSPLINE" else values
        if (np.linalg.norm(turns, axis=-1) < 1e-6).any():
            file.fail(f"{name} has a key that is no rotation (0, 0, 0, 0)", "export it again")
    return Track(times, values, way)


def frames(
    file: File, moves: Iterable[Track], fps: float | None
) -> tuple[np.ndarray, float, str | None]:
    """Times (frames,) from the first key to the last, frames per second, what to say of these.

    A frame that a key hardly misses is at the key, so that it is read as it was written.
    """
    moves = list(moves)
    if not moves:
        return np.zeros(1), fps or _DEFAULT, None
    keys = np.unique(np.concatenate([track.times for track in moves]))
    doubt, near = None, _FLOAT32 * np.abs(keys).max()
    if fps is None:
        fps, doubt = _rate(keys, any(track.way == "CUBICSPLINE" for track in moves))
        near = near if doubt else _COARSE / fps
    span = keys[-1] - keys[0]
    if span * fps > _MOST:
        file.fail(
            f"its animation lasts {span:.4g} s, which is too long at {fps:g} frames per second",
            "pass fewer as fps=, or export it again if it does not last that long",
        )
    count = int((span + near) * fps) + 1  # none is later than the last key
    when = keys[0] + np.arange(count) / fps
    nearest = keys[np.searchsorted((keys[1:] + keys[:-1]) / 2, when)]
    return np.where(np.abs(nearest - when) < near, nearest, when), float(fps), doubt


def _rate(keys: np.ndarray, curved: bool) -> tuple[float, str | None]:
    """The rate at whose frames all keys lie, where there is one and most frames have a key; or
    another, and what to say of it."""
    keys = keys[np.diff(keys, prepend=-np.inf) > _SAME] - keys[0]
    if len(keys) == 1:
        return _DEFAULT, None
    gaps = np.diff(keys)
    gap = gaps[gaps < _ALIKE * gaps.min()].mean()
    rate = round(keys[-1] / gap) / keys[-1]
    how, other = "at no even rate", "another rate"
    for fps, near in [(rate, _ROUNDED), *((usual, _COARSE) for usual in RATES)]:
        at = keys * fps
        even = np.abs(at - at.round()).max() < near
        if not even or fps > _FASTEST or len(gaps) <= _MOSTLY * at[-1]:
            continue
        if fps >= (_POSES if curved or len(keys) < _FEW else _SLOWEST):
            return whole(fps), None
        how, other = f"as poses do, {fps:.4g} per second", f"{fps:.4g}, for these alone,"
        break
    return _DEFAULT, (
        f"the keys of its animation come {how}; it is read at {_DEFAULT:g} frames per second, "
        f"interpolated: pass {other} as fps=."
    )
