"""The motion player: numbers packed for the browser, as a live widget or as a piece of a page.

A built page has no kernel, so the motion itself travels in it, and can be saved from there: the
root's place to a tenth of a millimetre, and every joint's angles to half of 360° / 2^16. Where only
points are known, they are sent, to a tenth of a millimetre, relative to the root. Numbers are sent as
changes of their changes: a body moves on as it moved, so that most of them fit one byte.

A body that is no person's size, such as metres read as centimetres, is sent magnified, its way and
its floor with it, so that all of this, light and camera are right for it, too; `magnified`.
"""

from __future__ import annotations

import base64
import html
import json
import math
import warnings
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import anywidget
import numpy as np
import torch
import traitlets
from torch import Tensor

from ...errors import ViewerError
from ...io.euler import to_euler
from ...io.gltf_mesh import rest_stands
from ...motion import Motion
from ...skeleton import Skeleton
from ..pictures.body import Body, body
from ..pictures.palette import COLORS

STATIC = Path(__file__).parent / "static"
ROOT_UNIT = 1e-4  # metres; an int32 reaches 214 km
FARTHEST = np.iinfo(np.int32).max
FINEST = 1e-4  # metres, for points relative to the root: an int16 reaches 3.3 m
COARSEST = 2e-3  # metres; rounding is then off by half of it, the contract's 1 mm
TURN = 2 * np.pi / 2**16  # radians; the sixteen bits of a number go round as an angle does
FLOOR_SLACK = 0.15  # metres
SHOWN_FPS = 30.0  # a browser mixes frames in between; more would only weigh more


@dataclass(frozen=True)
class Track:
    """What one figure needs: ``positions`` (frames, points, 3) metres, a body, how it looks."""

    positions: Tensor
    skeleton: Skeleton
    label: str = ""
    color: str = COLORS["mocap"]
    contacts: Tensor | None = None  # bool (frames, 4)
    name: str = ""  # what a file is called that is saved of it
    motion: Motion | None = None  # with the rotations, where they are known


def bundle_path() -> Path:
    """The player's script for built pages (one for the whole book; the style is inside)."""
    return _built("player.js")


def _built(name: str) -> Path:
    if not (STATIC / name).is_file():
        raise ViewerError(
            f"The player's script {STATIC / name} is missing: it is bundled when the package is "
            "built. Run `pip install -e .` in the repository (it needs no Node of your own)."
        )
    return STATIC / name


def payload(
    tracks: Sequence[Track],
    fps: float,
    *,
    paths: Sequence[dict[str, Any]] = (),
    trail: Sequence[int] = (),
    **options: Any,
) -> dict[str, Any]:
    """The JSON object that the player reads.

    Parameters
    ----------
    tracks : the figures; they share one clock, a shorter one waits at its end.
    fps : frames per second of all of them.
    paths : ``{"points": [[x, z], ...], "color": "#...", "track": index or None}``, metres.
    trail : points that leave a trail.
    options : height, follow, overlay, autoplay, speed; choose, the name of a slider over the tracks,
        of which one is seen at a time, and chosen, which is at first; focus, what the camera looks at;
        chart, lines below the picture.

    Places, lengths and radii are ``magnified`` times what they are, but for the skeletons, which
    are saved. Every ``stride``-th frame is stored, so that at least `SHOWN_FPS` a second are; ``frames`` and
    the player's clock count the motion's own frames.
    """
    stride = max(1, int(fps / SHOWN_FPS + 1e-3))
    bodies: list[dict[str, Any]] = []  # that tracks share
    times = magnified(track.skeleton for track in tracks)
    return {
        "version": 2,
        "fps": fps,
        "frames": max(len(track.positions) for track in tracks),
        "stride": stride,
        "magnified": times,
        "tracks": [_pack(track, stride, bodies, times) for track in tracks],
        "bodies": bodies,
        "paths": [{**path, "points": _times(times, path["points"])} for path in paths],
        "trail": [int(point) for point in trail],
        "floor": floor_height(tracks[0], times),
        **options,
    }


def magnified(skeletons: Iterable[Skeleton]) -> float:
    """How many times larger a page shows bodies that it shows together: 1 for people, from infants
    to giants; else 1, 2 or 5 times a power of ten, the nearest that makes the largest an adult."""
    size = max(body(skeleton).size for skeleton in skeletons)
    tens = 10.0 ** -round(math.log10(size))
    if tens == 1:
        return 1.0
    return min(
        (tens * by for by in (0.2, 0.5, 1, 2, 5)), key=lambda times: abs(math.log(times * size))
    )


def floor_height(track: Track, times: float = 1.0) -> float:
    """Height in metres, of the body `times` as large, where the soles are in all but the lowest 2 % of the frames.

    Sources put y = 0 some centimetres above or below the sole. A motion whose lowest point is
    farther from it than that (a jump, a drifting model) keeps its floor at 0.
    """
    dress = body(track.skeleton)
    points = times * dress.points(track.positions)[..., 1]
    ends = [
        (end, times * radius) for a, b, ra, rb in dress.bones for end, radius in ((a, ra), (b, rb))
    ]
    if not ends:
        return 0.0
    index, radius = zip(*ends, strict=True)
    lowest = (points[:, list(index)] - torch.tensor(radius)).amin(dim=1)
    sole = float(lowest.quantile(0.02))
    return round(sole, 4) if abs(sole) < FLOOR_SLACK else 0.0


def dressed(skeleton: Skeleton, times: float = 1.0) -> dict[str, Any]:
    """A body as the page knows it: its skeleton, to be saved, and its figure, to be drawn `times`
    as large."""
    dress = body(skeleton)
    return {
        "skeleton": {
            "names": list(skeleton.names),
            "parents": list(skeleton.parents),
            "offsets": _in_micrometres(skeleton.offsets),
            "end_parents": list(skeleton.end_parents),
            "end_offsets": _in_micrometres(skeleton.end_offsets),
            "orders": list(skeleton.rotation_orders),
            "stands": rest_stands(skeleton),
        },
        "middle": skeleton.roles.get("hips", 0),
        "extras": [list(extra) for extra in dress.extras],
        "bones": [[a, b, *_times(times, radii)] for a, b, *radii in dress.bones],
        "contactPoints": list(dress.feet),
    }


def _times(times: float, numbers: Any) -> Any:
    return numbers if times == 1 else (times * np.asarray(numbers)).tolist()


def _in_micrometres(offsets: Tensor) -> list[list[float]]:
    return offsets.double().numpy().round(6).tolist()


def _pack(track: Track, stride: int, bodies: list[dict[str, Any]], times: float) -> dict[str, Any]:
    """What is sent of a track; its body is added to `bodies` unless it is there."""
    dress, drawn = dressed(track.skeleton, times), body(track.skeleton)
    if dress not in bodies:
        bodies.append(dress)
    numbers = (
        _points(track, stride, drawn, times)
        if track.motion is None
        else _turns(track.motion, stride, times)
    )
    return {
        "label": track.label,
        "name": track.name,
        "color": track.color,
        "body": bodies.index(dress),
        "frames": len(range(0, len(track.positions), stride)),
        "contacts": _bitmask(track.contacts, stride, drawn),
        **numbers,
    }


def _points(track: Track, stride: int, dress: Body, times: float) -> dict[str, Any]:
    positions = times * track.positions[::stride].numpy()
    root, local, scale = quantise(positions, track.skeleton, dress)
    return {
        "root": _base64(root, "<i4"),
        "local": _base64(in_few_bytes(local), "u1"),
        "scale": scale,
    }


def _turns(motion: Motion, stride: int, times: float) -> dict[str, Any]:
    root_positions, rotations = (values[::stride] for values in motion.numpy())
    root_positions = times * root_positions
    root = np.rint(root_positions.astype(np.float64) / ROOT_UNIT)
    if np.abs(root).max() > FARTHEST:
        warnings.warn(
            f"The root lies {np.abs(root_positions).max():.0f} m away: the motion has exploded or is "
            "not in metres. It is held at 214 km.",
            stacklevel=4,
        )
    angles = to_euler(rotations, motion.skeleton.rotation_orders)
    steps = np.rint(angles / TURN).astype(np.int64).astype(np.int16)
    return {
        "root": _base64(root.clip(-FARTHEST, FARTHEST), "<i4"),
        "turns": _base64(in_few_bytes(steps), "u1"),
    }


def quantise(
    positions: np.ndarray, skeleton: Skeleton, dress: Body
) -> tuple[np.ndarray, np.ndarray, float]:
    """Integers for positions (frames, points, 3): root (frames, 3), local, and local's unit.

    The root is the hips where they are known: some files have a root joint that stays behind.
    Points that no bone touches (such a root) are not drawn; they are sent as if at the root.
    """
    drawn = _drawn_points(dress, positions.shape[1])
    middle = skeleton.roles.get("hips", 0)
    positions = np.asarray(positions, dtype=np.float64)
    _check_finite(positions[:, [*drawn, middle]], [*drawn, middle], skeleton)
    root = np.rint(positions[:, middle] / ROOT_UNIT)
    local = np.zeros_like(positions)
    local[:, drawn] = positions[:, drawn] - root[:, None] * ROOT_UNIT
    reach = np.abs(local).max(initial=0.0)
    scale = min(max(reach / np.iinfo(np.int16).max, FINEST), COARSEST)
    steps = np.rint(local / scale)
    held = np.iinfo(np.int16).max
    if np.abs(steps).max(initial=0) > held or np.abs(root).max(initial=0) > FARTHEST:
        warnings.warn(
            f"A point lies {reach:.0f} m from the hips: the motion has exploded or is not in "
            f"metres. It is shown cut off at {held * scale:.0f} m.",
            stacklevel=4,
        )
    root = np.clip(root, -FARTHEST, FARTHEST).astype(np.int32)
    return root, np.clip(steps, -held, held).astype(np.int16), scale


def in_few_bytes(numbers: np.ndarray) -> np.ndarray:
    """Bytes for int16 numbers (frames, ...): each says how much the change itself has changed.

    What does not fit sixteen bits goes round, and comes back when the page adds it up in sixteen.
    A number takes as many bytes as it needs: seven bits in each, the lowest first, and a high bit
    if more follow; its sign is its lowest bit.
    """
    rest = np.zeros((2, *numbers.shape[1:]), dtype=np.int32)
    bent = np.diff(np.concatenate([rest, numbers]), n=2, axis=0).ravel()
    bent = bent.astype(np.int16).astype(np.int32)
    unsigned = np.where(bent < 0, -2 * bent - 1, 2 * bent)
    shifts = np.array([0, 7, 14])
    pieces = unsigned[:, None] >> shifts
    follows = pieces[:, 1:] > 0
    sent = (pieces & 127).astype(np.uint8)
    sent[:, :-1] |= (follows * 128).astype(np.uint8)
    needed = np.concatenate([np.ones((len(bent), 1), bool), follows], axis=1)
    return sent[needed]


def _drawn_points(dress: Body, points: int) -> list[int]:
    used = {index for bone in dress.bones for index in bone[:2]} | set(dress.feet)
    behind = {p for index in used if index >= points for p in dress.extras[index - points][:2]}
    return sorted(index for index in used | behind if index < points) or list(range(points))


def _check_finite(positions: np.ndarray, points: list[int], skeleton: Skeleton) -> None:
    bad = ~np.isfinite(positions).all(axis=-1)
    if bad.any():
        frame, point = np.argwhere(bad)[0]
        raise ViewerError(
            f"The motion to show has {int(bad.any(axis=1).sum())} frames with NaN or infinite "
            f"positions, the first at frame {frame} (of those shown), point "
            f"{skeleton.point_names[points[point]]!r}. Cut the motion before it with a slice, "
            "or find out what produced it."
        )


def _bitmask(contacts: Tensor | None, stride: int, dress: Body) -> str | None:
    if contacts is None or not dress.feet:
        return None
    bits = np.asarray(contacts[::stride], dtype=np.uint8) << np.arange(4, dtype=np.uint8)
    return _base64(bits.sum(axis=1), "u1")


def _base64(values: np.ndarray, kind: str) -> str:
    return base64.b64encode(np.ascontiguousarray(values, dtype=kind).tobytes()).decode("ascii")


class Player(anywidget.AnyWidget):
    """The live player. Its traits can be linked to other widgets.

    >>> ipywidgets.jslink((slider, "value"), (player, "frame"))  # doctest: +SKIP

    works in the browser alone, also without a kernel.
    """

    _esm = STATIC / "widget.js"

    payload = traitlets.Dict().tag(sync=True)
    # no echo: while a kernel is busy frames queue up; late echoes would undo what it sets then
    frame = traitlets.Int(0).tag(sync=True, echo_update=False)
    playing = traitlets.Bool(False).tag(sync=True)
    speed = traitlets.Float(1.0, min=0.0).tag(sync=True)
    follow = traitlets.Bool(True).tag(sync=True)
    overlay = traitlets.Bool(False).tag(sync=True)
    chosen = traitlets.Int(0).tag(sync=True)
    caption = traitlets.Unicode("").tag(sync=True)

    def __init__(self, payload: dict[str, Any], **traits: Any):
        _built("widget.js")
        shared = ("speed", "follow", "overlay", "chosen")
        state = {name: payload[name] for name in shared if name in payload}
        playing = bool(payload.get("autoplay", False))
        super().__init__(payload=payload, **{"playing": playing, **state, **traits})

    def __repr__(self) -> str:
        count = len(self.payload["tracks"])
        return (
            f"Player({count} motion{'s' if count > 1 else ''}, {self.payload['frames']} frames, "
            f"{self.payload['fps']:g} fps)"
        )

    @traitlets.validate("frame")
    def _inside(self, proposal: dict[str, Any]) -> int:
        return min(max(proposal["value"], 0), self.payload["frames"] - 1)

    @traitlets.validate("chosen")
    def _one_of_them(self, proposal: dict[str, Any]) -> int:
        return min(max(proposal["value"], 0), len(self.payload["tracks"]) - 1)


def page_html(payload: dict[str, Any], still: str | None = None, caption: str | None = None) -> str:
    """The player without a kernel: a figure that the book's one script brings to life.

    `still`, a data URL, is seen where scripts are off; `caption` is plain text.
    """
    # "</script>" inside a string would end the element: escape every "<".
    data = json.dumps(payload, separators=(",", ":")).replace("<", "\\u003c")
    labels = ", ".join(track["label"] for track in payload["tracks"] if track["label"])
    alt = html.escape(f"Still picture of the motion {labels}".strip(), quote=True)
    picture = f'<img src="{still}" alt="{alt}" style="max-width:100%">' if still else ""
    text = f"<figcaption>{html.escape(caption)}</figcaption>" if caption else ""
    return (
        '<figure class="motionlab-player" style="margin:1rem 0">'
        f'<script type="application/json">{data}</script>'
        f"<noscript>{picture}</noscript>{text}</figure>"
    )
