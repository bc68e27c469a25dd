"""``motionlab.show``: look at motions, in a notebook and in a built page."""

from __future__ import annotations

import base64
import io
import os
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import torch
from PIL import Image
from torch import Tensor

from ...errors import ViewerError
from ...motion import Motion
from ...skeleton import Skeleton
from ..pictures.palette import PATH, check_color, color
from .figure import PageFigure
from .player import Player, Track, page_html, payload

MOST_TRACKS = 12


def show(
    motion: Motion | Tensor | np.ndarray | Sequence[Motion | Tensor | np.ndarray],
    *,
    labels: str | Sequence[str] | None = None,
    contacts: bool | Tensor | np.ndarray | Sequence = False,
    paths: Any = None,
    trail: str | int | Sequence[str | int] | None = None,
    overlay: bool = False,
    choose: str | None = None,
    chosen: int = 0,
    focus: str = "body",
    chart: Mapping[str, Sequence[float]] | None = None,
    chart_label: str | None = None,
    chart_log: bool = False,
    caption: str | None = None,
    height: int = 380,
    skeleton: Skeleton | None = None,
    fps: float | None = None,
    colors: str | Sequence[str] | None = None,
    autoplay: bool = True,
    page: bool | None = None,
) -> Player | PageFigure:
    """Play one motion, or several side by side or in one picture, on one clock.

    The player's last button saves what is seen as .bvh or .glb, as it is played: of a fast motion at
    least 30 frames a second, the root to 0.1 mm, joints to 0.01 degrees. Of point positions only how
    bones lie is known, not how they are twisted, and they keep the skeleton's lengths.

    A body of no person's size is drawn magnified, its floor and its way with it, and the player tells
    how far apart the floor's lines are. Bodies that are shown together are magnified alike. What sinks
    below the floor is hidden but for a thin broken outline.

    Parameters
    ----------
    motion : a `Motion`, point positions (frames, points, 3) in metres, or a list of either. Points
        may be the joints alone.
    labels : what to call each motion; by default the motions' names.
    contacts : True to mark the feet by the motions' own labels, or bool (frames, 4) arrays.
    paths : a path (n, 2) of x, z or (n, 3) of points in metres, or a list of paths, on the ground.
    trail : joints (names, roles or point indices) that leave a trail.
    overlay : all in one picture instead of side by side; the player has a button for it, too.
    choose : name of a slider by which one motion is seen at a time, such as "weight"; its values are
        the labels.
    chosen : number of the motion that is seen at first, then.
    focus : "body", or "feet": at first the camera stands near the ground and sees the legs alone.
    chart : named lines of one value a frame, below the picture, with a cursor that follows the player
        and can be dragged; NaN leaves a gap. With `choose`, and lines named as the motions: a click on
        a line plays its motion from there, and the lines' names take the place of the slider.
    chart_label, chart_log : what the lines are and their unit; a logarithmic axis.
    caption : a text below the player.
    height : of the picture, pixels.
    skeleton, fps : of point positions; needed for those only.
    colors : one per motion: a method's name (see `motionlab.viewer.palette`) or a colour.
    autoplay : start when it comes into view (never if the reader asks for reduced motion).
    page : plain HTML that needs no kernel. None: if the environment variable ``MOTIONLAB_VIEWER`` is
        "page", as when a book is built.

    Returns
    -------
    A widget whose ``frame``, ``playing``, ``speed``, ``follow``, ``overlay`` and ``chosen`` can be
    set, read and linked; or plain HTML.
    """
    motions = _as_list(motion)
    names = _per_motion("labels", labels, len(motions))
    looks = _per_motion("colors", colors, len(motions))
    feet = _contacts(contacts, motions)
    tracks = [
        _track(m, i, names[i], looks[i], feet[i], skeleton, len(motions))
        for i, m in enumerate(motions)
    ]
    rate = _rate(motions, fps)
    if not isinstance(height, int | np.integer) or not 120 <= height <= 2000:
        raise ViewerError(f"show: height is {height!r}; give pixels, from 120 to 2000.")
    if focus not in ("body", "feet"):
        raise ViewerError(f"show: focus is {focus!r}; give 'body' or 'feet'.")
    if choose is not None:
        if overlay or len(tracks) < 2 or not 0 <= chosen < len(tracks):
            raise ViewerError(
                f"show: choose={choose!r} is a slider over two motions or more, not overlaid, and "
                f"chosen one of their numbers; there are {len(tracks)}, chosen is {chosen}."
            )
    longest = max(len(track.positions) for track in tracks)
    lines = _chart(chart_label, chart, longest, chart_log)
    if lines is not None and choose is not None:
        lines |= _own_lines(lines["lines"], tracks)
    data = payload(
        tracks,
        rate,
        paths=_paths(paths, len(motions)),
        trail=trail_points(trail, tracks),
        height=int(height),
        overlay=bool(overlay),
        follow=True,
        autoplay=bool(autoplay),
        **({} if focus == "body" else {"focus": focus}),
        **({} if lines is None else {"chart": lines}),
        **({} if choose is None else {"choose": str(choose), "chosen": int(chosen)}),
    )
    if os.environ.get("MOTIONLAB_VIEWER") == "page" if page is None else page:
        return PageFigure(page_html(data, still_picture(tracks[0]), caption))
    return Player(data, caption=caption or "")


def _as_list(motion: Any) -> list[Motion | Tensor]:
    many = isinstance(motion, list | tuple)
    motions = list(motion) if many else [motion]
    if not motions:
        raise ViewerError("show: the list of motions is empty; give at least one motion.")
    if len(motions) > MOST_TRACKS:
        raise ViewerError(
            f"show: {len(motions)} motions are more than one player can hold ({MOST_TRACKS}); "
            "show fewer, or call show again for the rest."
        )
    found: list[Motion | Tensor] = []
    for i, item in enumerate(motions):
        if isinstance(item, Motion):
            found.append(item)
            continue
        try:
            points = torch.as_tensor(item, dtype=torch.float32).detach().cpu()
        except (TypeError, ValueError, RuntimeError) as error:
            raise ViewerError(
                f"show: motion {i} is a {type(item).__name__}; give a motionlab.Motion or point "
                "positions (frames, points, 3) in metres."
            ) from error
        if points.ndim != 3 or points.shape[-1] != 3:
            raise ViewerError(
                f"show: motion {i} has shape {tuple(points.shape)}; point positions need "
                "(frames, points, 3), metres. Show the clips of a batch as a list."
            )
        found.append(points)
    for i, item in enumerate(found):
        if len(item) == 0:
            raise ViewerError(f"show: motion {i} has no frames; there is nothing to show.")
    return found


def _track(
    motion: Motion | Tensor,
    index: int,
    label: str | None,
    look: str | None,
    feet: Tensor | None,
    skeleton: Skeleton | None,
    count: int,
) -> Track:
    if isinstance(motion, Motion):
        positions, bones = motion.positions().detach().cpu(), motion.skeleton
        label = label if label is not None else (motion.name if count > 1 else "")
    else:
        if skeleton is None:
            raise ViewerError(
                f"show: motion {index} is point positions, which need skeleton=, as in "
                "show(points, skeleton=motion.skeleton, fps=30)."
            )
        positions, bones = motion, skeleton
        if positions.shape[1] == bones.joints != bones.points:  # as the encoding BodyFrame gives
            bones = bones.without_end_sites()
        if positions.shape[1] != bones.points:
            raise ViewerError(
                f"show: motion {index} has {positions.shape[1]} points, its skeleton has "
                f"{bones.points} ({bones.joints} joints, then end sites); give the skeleton the "
                "positions were made with."
            )
    if feet is not None and feet.shape != (len(positions), 4):
        raise ViewerError(
            f"show: contacts of motion {index} have shape {tuple(feet.shape)}, need "
            f"({len(positions)}, 4): left heel, left toe, right heel, right toe."
        )
    label = label or ""
    fallback = color(label, index) if count > 1 or label else color("mocap")
    shade = check_color(look, "colors") if look else fallback
    name, whole = (motion.name, motion) if isinstance(motion, Motion) else ("", None)
    return Track(positions, bones, label, shade, feet, name, whole)


def _per_motion(name: str, value: Any, count: int) -> list[str | None]:
    if value is None:
        return [None] * count
    values = [value] if isinstance(value, str) else list(value)
    if len(values) != count:
        raise ViewerError(
            f"show: {len(values)} {name} for {count} motions; give one for each motion."
        )
    return [None if v is None else str(v) for v in values]


def _contacts(contacts: Any, motions: list[Motion | Tensor]) -> list[Tensor | None]:
    if contacts is None or contacts is False:
        return [None] * len(motions)
    if contacts is True:
        own = [getattr(m, "contacts", None) for m in motions]
        if all(c is None for c in own):
            raise ViewerError(
                "show: contacts=True, but no motion has contact labels. Give them as an array, "
                "contacts=labels of shape (frames, 4), or leave contacts out."
            )
        return own
    given = list(contacts) if isinstance(contacts, list | tuple) else [contacts]
    if len(given) != len(motions):
        raise ViewerError(
            f"show: contacts for {len(given)} motions, but there are {len(motions)}; give a list "
            "with one array (frames, 4), or None, for each."
        )
    return [None if c is None else torch.as_tensor(np.asarray(c)).bool() for c in given]


def _rate(motions: list[Motion | Tensor], fps: float | None) -> float:
    rates = {round(m.fps, 2): m.fps for m in motions if isinstance(m, Motion)}
    if len(rates) > 1:
        raise ViewerError(
            f"show: the motions have different rates ({', '.join(f'{r:g}' for r in rates)} fps) but "
            "share one clock; bring them to one rate first, as in motion.resample(30)."
        )
    if fps is not None and not (np.isfinite(fps) and fps > 0):
        raise ViewerError(f"show: fps is {fps!r}; give frames per second, as 30.")
    if rates:
        rate = next(iter(rates.values()))
        if fps is not None and abs(fps - rate) > 0.01:
            raise ViewerError(
                f"show: fps={fps:g}, but the motion itself has {rate:g} fps; leave fps out, or "
                "change the motion with resample."
            )
        return float(rate)
    if fps is None:
        raise ViewerError("show: point positions need fps=, the frames per second, as fps=30.")
    return float(fps)


def _paths(paths: Any, count: int) -> list[dict[str, Any]]:
    if paths is None:
        return []
    try:
        many = isinstance(paths, list | tuple) and len(paths) and np.ndim(paths[0]) == 2
        ways = [np.asarray(path, dtype=np.float64) for path in (paths if many else [paths])]
    except (TypeError, ValueError, RuntimeError) as error:
        raise ViewerError(
            f"show: paths is a {type(paths).__name__} that is not numbers ({error}); give an array "
            "(n, 2) of x, z or (n, 3) of points in metres, or a list of such arrays."
        ) from error
    made = []
    for i, points in enumerate(ways):
        if points.ndim != 2 or points.shape[1] not in (2, 3) or not np.isfinite(points).all():
            raise ViewerError(
                f"show: path {i} has shape {points.shape}; give (n, 2) of x, z or (n, 3) of points, "
                "finite, in metres."
            )
        ground = points[:, [0, points.shape[1] - 1]].round(3).tolist()
        made.append({"points": ground, "color": PATH, "track": None})
    if len(made) == count > 1:  # one for each motion: drawn in its own picture only
        made = [{**path, "track": i} for i, path in enumerate(made)]
    return made


def trail_points(trail: Any, tracks: list[Track]) -> list[int]:
    """Point indices of what `show` calls its trail."""
    if trail is None:
        return []
    skeleton = tracks[0].skeleton
    points = []
    for item in [trail] if isinstance(trail, str | int) else trail:
        if isinstance(item, str):
            points.append(_point(skeleton, item))
        elif 0 <= int(item) < min(track.skeleton.points for track in tracks):
            points.append(int(item))
        else:
            raise ViewerError(
                f"show: trail point {item} is not there; the skeleton has {skeleton.points} points."
            )
    return points


def _point(skeleton: Skeleton, name: str) -> int:
    if name in skeleton.point_names:
        return skeleton.point_names.index(name)
    return skeleton.index(name)  # a role, or an error that lists what there is


def _chart(
    label: str | None, lines: Mapping[str, Sequence[float]] | None, frames: int, log: bool
) -> dict[str, Any] | None:
    """What web/src/chart.js reads: names, colours and values, None where there is none."""
    if lines is None:
        return None
    if not isinstance(lines, Mapping) or not lines:
        raise ViewerError(
            "show: chart is {name: values}, one value a frame, such as {'left toe': heights}."
        )
    sent = []
    for index, (name, values) in enumerate(lines.items()):
        try:
            row = np.asarray(values, dtype=float)
        except (TypeError, ValueError, RuntimeError) as error:
            raise ViewerError(f"show: chart's {name!r} is not numbers: {error}.") from error
        drawn = np.isfinite(row) & (row > 0 if log else True)
        if row.ndim != 1 or not 0 < len(row) <= frames or not drawn.any():
            raise ViewerError(
                f"show: chart's {name!r} has shape {row.shape}, the motion {frames} frames; give one "
                f"value a frame, some of them {'above 0' if log else 'finite'}."
            )
        said = [float(f"{v:.4g}") if ok else None for v, ok in zip(row, drawn, strict=True)]
        sent.append({"name": str(name), "color": color(name, index), "values": said})
    return {"label": label or "", "log": log, "lines": sent}


def _own_lines(lines: list[dict[str, Any]], tracks: Sequence[Track]) -> dict[str, Any]:
    """Lines that are named as the motions, in their order and colours: a reader may pick one."""
    named = {line["name"]: line for line in lines}
    if sorted(named) != sorted(track.label for track in tracks):
        return {}
    owned = [{**named[track.label], "color": track.color} for track in tracks]
    return {"picks": True, "lines": owned}


def still_picture(track: Track) -> str:
    """What is seen without scripts: the middle of the motion, as a data URL of a few kilobytes."""
    from ..pictures.stills import still

    picture = still(
        track.positions,
        len(track.positions) // 2,
        size=(360, 270),
        color=track.color,
        skeleton=track.skeleton,
    )
    packed = io.BytesIO()
    # 64 colours look the same at this size and weigh a quarter.
    picture.quantize(64, method=Image.Quantize.FASTOCTREE).save(packed, "PNG", optimize=True)
    return "data:image/png;base64," + base64.b64encode(packed.getvalue()).decode("ascii")
