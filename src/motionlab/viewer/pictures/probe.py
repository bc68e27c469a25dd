"""Can VTK render on this machine? Asked in another process, because where it cannot, it crashes.

Without a display VTK needs EGL or OSMesa. Where neither is installed, the first render ends the
Python process with a signal that no ``try`` catches, and a notebook loses its kernel.
"""

from __future__ import annotations

import os
import subprocess
import sys
import warnings
from functools import cache
from importlib.util import find_spec

from ...errors import ViewerError

SECONDS = 60
TRIAL = (
    "import pyvista; p = pyvista.Plotter(off_screen=True, window_size=(16, 16));"
    "p.add_mesh(pyvista.Cube(), color='white'); p.set_background('black');"
    "raise SystemExit(0 if p.screenshot(return_img=True).max() > 0 else 3)"
)
REMEDY = (
    "pictures are drawn by matplotlib, because VTK cannot render on this machine ({reason}). "
    "For the better ones install a software renderer: on Debian or Ubuntu "
    "`apt install libegl1 libgl1-mesa-dri` (or libosmesa6), with conda `conda install mesalib`."
)
TOO_SLOW = (
    "pictures are drawn by matplotlib this time: a trial of VTK had made {reason}, perhaps because the "
    "machine is busy. Where it always is so slow, `MOTIONLAB_BACKEND=vtk` in the environment takes VTK "
    "without a trial, and `MOTIONLAB_BACKEND=matplotlib` asks for none."
)
NOT_INSTALLED = "pyvista is not installed"
_LATE = "no picture within"
MISSING = "pictures are drawn by matplotlib: {reason}. For the better ones `pip install pyvista`."


def choose(backend: str | None = None) -> str:
    """Settle which painter draws: "vtk" or "matplotlib".

    Parameters
    ----------
    backend
        "vtk", "matplotlib", or None: what the environment variable ``MOTIONLAB_BACKEND`` says,
        else VTK if it works here.
    """
    backend = backend or os.environ.get("MOTIONLAB_BACKEND") or None
    if backend not in (None, "vtk", "matplotlib"):
        raise ViewerError(f"backend: {backend!r} is unknown; use 'vtk', 'matplotlib' or None.")
    if backend is not None:
        return backend
    reason = why_not()
    if reason:
        _warn_once(reason)
    return "matplotlib" if reason else "vtk"


def remedy(reason: str) -> str:
    """In words, what draws instead of VTK for a reason of `why_not`, and what to do about it."""
    if reason == NOT_INSTALLED:
        return MISSING.format(reason=reason)
    return (TOO_SLOW if reason.startswith(_LATE) else REMEDY).format(reason=reason)


@cache
def why_not() -> str:
    """Say why VTK cannot render here; empty if it can. One trial (2 s) a process."""
    if find_spec("pyvista") is None:
        return NOT_INSTALLED
    try:
        done = subprocess.run(
            [sys.executable, "-c", TRIAL],
            stdin=subprocess.DEVNULL,
            capture_output=True,
            timeout=SECONDS,
        )
    except subprocess.TimeoutExpired:
        reason = f"{_LATE} {SECONDS} s"
    else:
        reason = "" if done.returncode == 0 else f"a trial ended with status {done.returncode}"
    return reason


@cache
def _warn_once(reason: str) -> None:
    warnings.warn(remedy(reason), stacklevel=4)
