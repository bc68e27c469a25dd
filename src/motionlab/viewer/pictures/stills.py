"""Pictures of motion: one body, a strip of bodies at successive times, a video.

Every function takes a :class:`~motionlab.Motion`, or point positions (frames, points, 3) in metres
together with ``skeleton`` and ``fps``. Pictures have a transparent background, so they sit on light
and dark pages. VTK draws where it can, matplotlib where it cannot (see ``probe.py``).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
from matplotlib import get_data_path
from PIL import Image, ImageDraw, ImageFont
from tqdm import tqdm

from ...errors import ViewerError
from . import palette, probe
from .picture import UP, Camera, Figure, Floor, Picture, unit
from .take import Take

Z = np.array([0.0, 0.0, 1.0])
ACROSS = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
# Metres between two bodies of a strip within which they stand where they really were.
STRIDE = (0.45, 1.60)
GAP = 0.25  # metres between bodies that were moved apart
STRIP_HEIGHT = (140, 460)  # pixels, least and most
LABEL_HEIGHT = 28  # pixels under a strip
LABEL_INK = (124, 124, 124, 255)  # legible on white and on black
PAPER = "#f1f2f4"  # behind videos, which cannot be transparent


def still(
    motion,
    frame: int = 0,
    *,
    size: tuple[int, int] = (480, 360),
    view: str = "three-quarter",
    color: str | None = None,
    contacts: bool = False,
    backend: str | None = None,
    skeleton=None,
) -> Image.Image:
    """Draw the body at one frame.

    Parameters
    ----------
    motion : a Motion, or positions (frames, points, 3) in metres with ``skeleton``. A body whose
        bones reach less than 10 cm far is magnified, its floor with it.
    frame : which one; negative counts from the end.
    size : width and height in pixels.
    view : "three-quarter", "side", "front" (all relative to where the body faces) or "top".
    color : a hex code, a name matplotlib knows, or a method's name ("mocap", "GAN1", ...).
    contacts : ring the feet that are down (needs ``motion.contacts``).
    backend : "vtk", "matplotlib" or None, which settles it by what works here.

    Returns
    -------
    An RGBA image with transparent background, which a notebook displays.
    """
    size = check_size(size)
    take = Take.of(motion, color=color, contacts=contacts, skeleton=skeleton)
    (frame,) = take.check_frames([frame])
    figure = take.figure(frame)
    below = take.on_floor(take.hips[frame])
    # Fitted to the pose and to the room that the standing body needs: who crouches looks smaller.
    room = take.height * np.array([[0, 0, 0], [0, 0.9, 0], *0.4 * np.vstack([ACROSS, -ACROSS])])
    shown = np.concatenate([take.hull(figure), below + room])
    camera = Camera(below, direction(view, take.facing[frame]), take.height)
    camera = camera.fitted(shown, size[0] / size[1])
    floor = Floor(below, Z, (1.1 * take.height, 1.1 * take.height), take.grid)
    return _draw(Picture([figure], floor, camera, size), backend)


def filmstrip(
    motion,
    frames: int | Sequence[int] = 8,
    *,
    width: int = 1200,
    view: str | None = None,
    color: str | None = None,
    contacts: bool = False,
    labels: bool = True,
    backend: str | None = None,
    skeleton=None,
    fps: float | None = None,
) -> Image.Image:
    """Draw the body at successive times side by side on one floor, labelled in seconds.

    A body that moves on is seen from its right, each pose where it really was (floor lines are
    0.5 m apart). Poses that would overlap, or lie far apart, are moved to even distances.

    Parameters
    ----------
    motion : a Motion, or positions (frames, points, 3) in metres with ``skeleton`` and ``fps``.
    frames : how many, evenly over the motion (all, if it has fewer), or the list of them.
    width : pixels; the height follows from the poses.
    view : as in :func:`still`; None sees travel from the side, all else in three-quarter view.
    labels : write the time under each pose, in seconds from the start of the motion.
    color, contacts, backend : as in :func:`still`.
    """
    width, _ = check_size((width, 2))
    take = Take.of(motion, color=color, contacts=contacts, skeleton=skeleton, fps=fps)
    frames = take.check_frames(take.spread(frames) if np.ndim(frames) == 0 else frames)
    figures, roots, camera = _line_up(take, frames, view)

    hulls = np.concatenate([take.hull(figure) for figure in figures])
    front = 0.25 * np.cross(camera.axes[0], UP)  # metres of floor before the feet
    shown = np.concatenate([hulls, take.on_floor(hulls) + front])
    extent = np.ptp(camera.project(shown)[:, :2], axis=0)
    height = int(np.clip(1.04 * width * extent[1] / extent[0], *STRIP_HEIGHT))
    camera = camera.fitted(shown, width / height, margin=1.04)

    right = camera.axes[0]
    floor = Floor(
        take.on_floor(roots.mean(axis=0)),
        right,
        (camera.height * width / height / 2, 0.62 * take.height),
        take.grid,
    )
    image = _draw(Picture(figures, floor, camera, (width, height)), backend)
    if not labels:
        return image
    middles = camera.project(take.on_floor(roots))[:, 0] * height / camera.height + width / 2
    return _labelled(image, middles, [f"{frame / take.fps:.2f} s" for frame in frames])


def stack(pictures: Mapping[str, Image.Image]) -> Image.Image:
    """Film strips one under another, each under its name.

    pictures : {name: picture}, as `filmstrip` draws them; the widest says how wide the whole is.
    """
    if not pictures:
        raise ViewerError("stack: there is no picture; give one name and its picture or more.")
    width = max(picture.width for picture in pictures.values())
    height = sum(picture.height + LABEL_HEIGHT for picture in pictures.values())
    sheet = Image.new("RGBA", (width, height), (0, 0, 0, 0))
    pen, top = ImageDraw.Draw(sheet), 0
    for name, picture in pictures.items():
        pen.text((4, top + LABEL_HEIGHT / 2), name, LABEL_INK, _font(15), anchor="lm")
        sheet.paste(picture, (0, top + LABEL_HEIGHT))
        top += picture.height + LABEL_HEIGHT
    return sheet


def video(
    motion,
    path: str | Path,
    *,
    fps: float | None = None,
    size: tuple[int, int] = (640, 480),
    view: str = "three-quarter",
    color: str | None = None,
    contacts: bool = False,
    background: str = PAPER,
    progress: bool = False,
    backend: str | None = None,
    skeleton=None,
) -> Path:
    """Write the motion as a video in real time; the camera follows the body.

    Parameters
    ----------
    motion : a Motion, or positions (frames, points, 3) in metres with ``skeleton`` and ``fps``.
    path : ends in ``.mp4`` or ``.gif``.
    fps : pictures a second. Default: the motion's own, at most 30. Positions are taken to have
        this rate.
    size : width and height in pixels, both even.
    background : colour behind the body; videos cannot be transparent.
    progress : show a progress bar.
    view, color, contacts, backend : as in :func:`still`.

    Returns
    -------
    The path. The same motion gives the same bytes on the same machine.
    """
    path, size = Path(path), check_size(size, even=True)
    if path.suffix.lower() not in (".mp4", ".gif"):
        raise ViewerError(f"video: {path.name!r} must end in .mp4 or .gif.")
    check_folder(path)
    take = Take.of(motion, color=color, contacts=contacts, skeleton=skeleton, fps=fps)
    rate = float(fps or min(take.fps, 30.0))
    count = max(1, round(len(take.positions) / take.fps * rate))
    last = len(take.positions) - 1
    moments = np.minimum((np.arange(count) * take.fps / rate).round(), last).astype(int)

    way = take.followed
    camera = Camera(way[0], direction(view, take.mean_facing), take.height)
    camera = camera.fitted(take.poses_at(way), size[0] / size[1], margin=1.12)
    paper = Image.new("RGBA", size, palette.check_color(background, "background"))
    with open_painter(size, backend) as paint, _writer(path, rate, size) as write:
        for frame in tqdm(moments, desc=path.name, disable=not progress):
            moved = replace(camera, target=camera.target + way[frame] - way[0])
            floor = Floor(way[frame], Z, (1.7 * take.height, 1.7 * take.height), take.grid)
            drawn = paint(Picture([take.figure(frame)], floor, moved, size))
            write(Image.alpha_composite(paper, Image.fromarray(drawn)).convert("RGB"))
    return path


def direction(view: str, facing: np.ndarray) -> np.ndarray:
    """Unit vector towards the eye for a named view of a body that faces ``facing``."""
    right = np.cross(facing, UP)
    views = {
        "three-quarter": 0.72 * facing + 0.69 * right + 0.26 * UP,
        "side": right + 0.20 * UP,
        "front": facing + 0.16 * UP,
        "top": UP,
    }
    if view not in views:
        raise ViewerError(f"view: {view!r} is unknown; use one of {', '.join(views)}.")
    return unit(views[view])


def open_painter(size: tuple[int, int], backend: str | None = None):
    """Context manager that yields the function which paints a Picture, by what works here."""
    # Imported here: where VTK is broken, importing it may be what breaks.
    if probe.choose(backend) == "vtk":
        from .paint_vtk import painter
    else:
        from .paint_mpl import painter
    return painter(size)


def _draw(picture: Picture, backend: str | None) -> Image.Image:
    with open_painter(picture.size, backend) as paint:
        # steps of 4 in 255 are not seen, and a page with them weighs a quarter less
        return Image.fromarray(paint(picture) & 252)


def _line_up(
    take: Take, frames: list[int], view: str | None
) -> tuple[list[Figure], np.ndarray, Camera]:
    """Figures of a strip, the hips they are labelled under (n, 3), and the direction of view."""
    figures, hips = [take.figure(frame) for frame in frames], take.hips[frames]
    travel = take.on_floor(hips[-1]) - take.on_floor(hips[0])
    steps = np.diff(hips @ unit(travel)) if len(frames) > 1 else np.zeros(1)
    travels = np.linalg.norm(travel) > 0.3 * len(frames) and steps.min() > 0
    facing = unit(travel) if travels else take.mean_facing
    seen_from = direction(view or ("side" if travels else "three-quarter"), facing)
    camera = Camera(take.on_floor(hips[0]), seen_from, take.height, perspective=False)
    if travels and STRIDE[0] <= steps.min() and steps.max() <= STRIDE[1]:
        return figures, hips, camera

    right = camera.axes[0]
    # The widest pose, seen from its hips, decides how far apart all of them stand.
    spans = [
        np.ptp(camera.project(take.hull(figure) - hip)[:, 0])
        for figure, hip in zip(figures, hips, strict=True)
    ]
    pitch = max(spans) + GAP
    moved, places = [], []
    for number, (figure, hip) in enumerate(zip(figures, hips, strict=True)):
        shift = number * pitch * right - (hip - hip[1] * UP)
        moved.append(replace(figure, points=figure.points + shift, marks=figure.marks + shift))
        places.append(hip + shift)
    return moved, np.stack(places), camera


def _labelled(image: Image.Image, middles: np.ndarray, texts: list[str]) -> Image.Image:
    """Add a band below with a text centred at each of ``middles`` (pixels)."""
    sheet = Image.new("RGBA", (image.width, image.height + LABEL_HEIGHT), (0, 0, 0, 0))
    sheet.paste(image, (0, 0))
    font = _font(int(np.clip(image.width / len(texts) / 4.5, 8, 17)))
    pen = ImageDraw.Draw(sheet)
    for middle, text in zip(middles, texts, strict=True):
        pen.text((middle, image.height + LABEL_HEIGHT / 2), text, LABEL_INK, font, anchor="mm")
    return sheet


def _font(size: int) -> ImageFont.FreeTypeFont:
    return ImageFont.truetype(str(Path(get_data_path(), "fonts", "ttf", "DejaVuSans.ttf")), size)


@contextmanager
def _writer(path: Path, fps: float, size: tuple[int, int]) -> Iterator[Callable]:
    """Yield a function that takes RGB images one by one and writes them to ``path``."""
    if path.suffix.lower() == ".gif":
        pages: list[Image.Image] = []
        yield pages.append
        # One palette for all pages, else colours flicker.
        first = pages[len(pages) // 2].quantize(255, dither=Image.Dither.NONE)
        pages = [page.quantize(palette=first, dither=Image.Dither.NONE) for page in pages]
        # GIF counts hundredths of a second: pages of unequal length keep the motion's time.
        turns = [round(100 * page / fps) for page in range(len(pages) + 1)]
        lengths = [10 * (end - start) for start, end in pairwise(turns)]
        pages[0].save(path, save_all=True, append_images=pages[1:], duration=lengths, loop=0)
        return
    try:
        import imageio_ffmpeg
    except ModuleNotFoundError as error:
        raise ViewerError(
            "mp4 needs ffmpeg: `pip install imageio-ffmpeg`, or write a .gif."
        ) from error
    # One thread and "bitexact": no trace of machine or encoder version in the file.
    options = ["-threads", "1", "-fflags", "+bitexact", "-flags:v", "+bitexact", "-crf", "20"]
    sink = imageio_ffmpeg.write_frames(
        str(path), size, fps=fps, macro_block_size=2, output_params=options
    )
    sink.send(None)
    try:
        yield lambda image: sink.send(image.tobytes())
    finally:
        sink.close()


def check_folder(path: Path) -> None:
    if not path.parent.is_dir():
        raise ViewerError(f"{path}: there is no folder {str(path.parent)!r}; make it first.")


def check_size(size: tuple[int, int], even: bool = False) -> tuple[int, int]:
    width, height = (int(side) for side in size)
    if not (1 < width <= 8192 and 1 < height <= 8192) or (even and (width % 2 or height % 2)):
        wanted = "even numbers" if even else "numbers"
        raise ViewerError(f"size: {size} must be {wanted} of pixels between 2 and 8192.")
    return width, height
