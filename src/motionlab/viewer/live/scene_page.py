"""A scene as HTML without a kernel: pyvista's scene, shown by vtk.js and posed by the page.

vtk.js comes as one file with trame. :func:`write_viewer` puts it beside the pages of a book, which
share it; each page carries only its scene and its motion. A scene lives in a frame of its own
because vtk.js knows only one per document.
"""

from __future__ import annotations

import base64
import html
import io
import json
import re
import zipfile
from importlib.resources import files
from pathlib import Path

import numpy as np
import roma
import torch
from matplotlib.colors import to_rgb

from ...errors import ViewerError
from ..pictures import stills
from ..pictures.picture import GRID

VIEWER = "motionlab-scene.js"
TEMPLATE = Path(__file__).with_name("scene.html")
MOST_FRAMES = 300  # that a page carries; of longer motions every second, third, ...
DOTS, DOTS_PER_SECOND = 30, 15  # of a trail: their distance tells the speed
HIP_SHADE, FOOT_SHADE = 0.55, 0.24  # metres, radius of a soft shadow
ACCENT = "#e69f00"  # the chosen joint's limbs and trail
UNIT = 1e-3  # metres, of positions relative to the hips: the contract's 1 mm, by int16


def viewer_script() -> str:
    """vtk.js and its loader of scenes as a classic script: modules can't load from disk."""
    page = (files("trame_vtk") / "tools" / "static_viewer.html").read_text(encoding="utf-8")
    (script,) = re.findall(r'<script type="module">(.*?)</script>', page, flags=re.DOTALL)
    return f'"use strict";window.global = window;(function () {{{script}\n}})();\n'


def write_viewer(folder: str | Path) -> Path:
    """Write vtk.js into the folder of a book's scripts (``_static``)."""
    path = Path(folder) / VIEWER
    path.write_text(viewer_script(), encoding="utf-8")
    return path


def figure_html(scene, standalone: bool = False) -> str:
    """The figure of a page; see :meth:`Scene.html`."""
    page = TEMPLATE.read_text(encoding="utf-8")
    content = {"zip": base64.b64encode(_vtkjs(scene.plotter)).decode("ascii"), **_motion(scene)}
    content["page"] = page
    if standalone:
        content["viewer"] = viewer_script()
    # "</script>" inside a string would end the element: escape every "<".
    data = json.dumps(content, separators=(",", ":")).replace("<", "\\u003c")
    width, height = scene.size
    title = html.escape(f"3D scene: {scene.motion.name or 'motion'}", quote=True)
    return (
        f'<figure class="motionlab-scene" style="margin:1rem 0;max-width:{width}px">'
        f'<script type="application/json">{data}</script>'
        f'<noscript><img src="{_picture(scene)}" alt="{title}"></noscript>'
        f'<iframe title="{title}" loading="lazy" '
        f'style="border:0;width:100%;height:{height + 44}px;color-scheme:normal"></iframe>'
        f"<script>{_OPEN}</script></figure>"
    )


# The frame finds the shared script from the root of the book, however deep its page lies.
_OPEN = (
    """(function (figure) {
  var data = JSON.parse(figure.querySelector("script").textContent);
  var root = document.documentElement.dataset.content_root || "";
  var script = data.viewer
    ? "<script>" + data.viewer + "<\\/script>"
    : '<script src="' + root + '_static/"""
    + VIEWER
    + """"><\\/script>';
  figure.scene = data;
  figure.querySelector("iframe").srcdoc = data.page.split("<!--viewer-->").join(script);
})(document.currentScript.parentElement);"""
)


def save(scene, path: Path) -> Path:
    """Write a page that holds the scene, its motion and vtk.js."""
    if path.suffix.lower() != ".html":
        raise ViewerError(
            f"scene.save: {path.name!r} must end in .html: it is a page to be turned about. "
            "For a picture use motionlab.viewer.still."
        )
    stills.check_folder(path)
    page = f'<!doctype html><meta charset="utf-8"><title>scene</title>{figure_html(scene, True)}'
    path.write_text(page, encoding="utf-8")
    return path


def _vtkjs(plotter) -> bytes:
    """The plotter's scene for vtk.js: what trame exports, without the server that it starts."""
    from trame_vtk.modules.vtk.serializers import (
        SynchronizationContext,
        extract_array_hash,
        initialize_serializers,
        reference_id,
        serialize,
    )

    initialize_serializers()
    context = SynchronizationContext()
    context.set_ignore_last_dependencies(True)
    window = plotter.render_window
    camera = plotter.renderer.GetActiveCamera()
    state = serialize(None, window, reference_id(window), context, 1)
    state["extra"] = {
        "vtkRefId": reference_id(window),
        "centerOfRotation": camera.GetFocalPoint(),
        "camera": reference_id(camera),
    }
    hashes = {
        entry["hash"]: entry | {"content": context.get_cached_data_array(entry["hash"])}
        for entry in extract_array_hash(state)
    }
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED, compresslevel=9) as archive:
        # A fixed date: the same scene gives the same bytes.
        entry = zipfile.ZipInfo("index.json")
        entry.compress_type = zipfile.ZIP_DEFLATED
        archive.writestr(entry, json.dumps({"hashes": hashes, "scene": state}))
    return packed.getvalue()


def _motion(scene) -> dict:
    """What ``scene.html`` needs to pose the parts: positions, orientations and the parts' sizes."""
    take, skeleton = scene.take, scene.motion.skeleton
    stride = -(-len(take.positions) // MOST_FRAMES)
    points = take.positions[::stride, : skeleton.points]
    hips = take.hips[::stride].astype(np.float32)
    local = np.clip(np.rint((points - hips[:, None]) / UNIT), -32767, 32767)
    turns = roma.rotmat_to_unitquat(torch.from_numpy(scene.orientations[::stride]))
    return {
        "frames": len(points),
        "points": skeleton.points,
        "joints": list(skeleton.names),
        "stride": stride,
        "fps": take.fps,
        "unit": UNIT,
        "hips": _base64(hips, "<f4"),
        "local": _base64(local, "<i2"),
        "turns": _base64(np.rint(turns.numpy() * 32767), "<i2"),
        "extras": [list(extra) for extra in take.body.extras],
        "bones": take.bones[:, :2].astype(int).tolist(),
        "lengths": np.round(scene.lengths, 5).tolist(),
        "ground": take.ground,
        "grid": GRID,
        "hips_point": take.roles.get("hips", 0),
        "feet": list(take.body.feet),
        "shades": [HIP_SHADE, FOOT_SHADE],
        "dots": DOTS,
        "dots_per_second": DOTS_PER_SECOND,
        "accent": list(to_rgb(ACCENT)),
        "color": take.color.tolist(),
        "frame": scene.frame // stride,
        "joint": -1 if scene.joint is None else scene.joint,
        "trail": scene.trail,
    }


def _picture(scene) -> str:
    """What is seen where scripts are off, as a data URL."""
    image = stills.still(scene.motion, scene.frame, size=scene.size)
    packed = io.BytesIO()
    image.save(packed, "webp", quality=70)
    return f"data:image/webp;base64,{base64.b64encode(packed.getvalue()).decode('ascii')}"


def _base64(values: np.ndarray, kind: str) -> str:
    return base64.b64encode(np.ascontiguousarray(values, dtype=kind).tobytes()).decode("ascii")
