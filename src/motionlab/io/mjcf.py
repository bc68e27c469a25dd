"""Motion as a MuJoCo model: bodies that hang together as the joints do, and a keyframe for every frame.

The root has a free joint, every other body a ball joint, end sites are sites. z points up, lengths are
metres: (x, y, z) of a motion is (x, -z, y) here. As it is loaded the body stands at rest, its lowest
point on a floor that is only seen. There is nothing to drive the body with and it meets no obstacle, so
that under `mj_step` it falls: it shows the motion, and is something to copy poses from. In Python::

    model = mujoco.MjModel.from_xml_path("walk.xml")
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, frame)  # and mujoco.mj_forward(model, data)

The format: https://mujoco.readthedocs.io/en/stable/XMLreference.html.
"""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import torch

from ..errors import MotionFileError
from ..motion import Motion
from ..skeleton import Skeleton
from .bvh_up import turn_back
from .gltf import quaternions
from .whole_file import put_whole

_RADIUS = 0.03  # metres; of a bone, as far as it is as long
_UNTOUCHED = {"contype": "0", "conaffinity": "0"}  # of what is seen and meets nothing
_SHORT = 1e-3  # metres; a bone that is shorter is a ball


def write_mjcf(motion: Motion, path: str | os.PathLike) -> None:
    """Write a motion as a MuJoCo model, ``.xml``, with a key for every frame: "frame 0" at 0 s, and so on.

    The file appears whole or not at all, and replaces one of that name. The model's timestep is that
    between two frames.

    Raises
    ------
    MotionFileError : the motion has no frames, or the path can't be written.
    """
    path = Path(path)
    if path.suffix.lower() != ".xml":
        raise MotionFileError(f"{path}: the name must end in .xml, for example {path.stem}.xml.")
    if len(motion) == 0:
        raise MotionFileError(f"{path}: the motion has no frames; there is nothing to write.")
    motion = turn_back(motion, "z")
    root = ElementTree.Element("mujoco", model=motion.name or "motion")
    ElementTree.SubElement(root, "option", timestep=f"{1 / motion.fps:.10g}")
    # it refuses bodies that weigh next to nothing
    ElementTree.SubElement(root, "compiler", boundmass="1e-4", boundinertia="1e-8")
    world = ElementTree.SubElement(root, "worldbody")
    ElementTree.SubElement(world, "light", pos="0 0 4", dir="0 0 -1", directional="true")
    floor = {"type": "plane", "size": "0 0 1", "rgba": "0.6 0.6 0.6 1", **_UNTOUCHED}
    ElementTree.SubElement(world, "geom", **floor)
    order = _bodies(world, motion.skeleton, _beginning(motion))
    keys = ElementTree.SubElement(root, "keyframe")
    for frame, numbers in enumerate(_states(motion, order)):
        when = {"name": f"frame {frame}", "time": f"{frame / motion.fps:.10g}"}
        ElementTree.SubElement(keys, "key", **when, qpos=_words(numbers))
    ElementTree.indent(root)
    put_whole(path, ElementTree.tostring(root, encoding="utf-8"))


def _beginning(motion: Motion) -> list[float]:
    """Where the root (3,) is before a key is loaded: that of the first frame, in the height at which the
    body at rest has its lowest point on the floor."""
    turns = torch.eye(3).expand_as(motion.rotations[:1])
    (rest,) = replace(motion[:1], rotations=turns).positions().detach().cpu()
    x, y, z = rest[0].tolist()
    return [x, y, z - float(rest[:, 2].min())]


def _bodies(world: ElementTree.Element, skeleton: Skeleton, root: list[float]) -> list[int]:
    """Put a body for each joint below the world, the first one at `root`; the joints in MuJoCo's order,
    that of the file."""
    elements: list[ElementTree.Element] = []
    offsets = skeleton.offsets.tolist()
    ends = skeleton.end_offsets.tolist()
    for joint, (name, parent) in enumerate(zip(skeleton.names, skeleton.parents, strict=True)):
        above = world if parent < 0 else elements[parent]
        place = _words(root if parent < 0 else offsets[joint])
        elements.append(ElementTree.SubElement(above, "body", name=name, pos=place))
        ElementTree.SubElement(elements[-1], "joint", type="ball" if parent >= 0 else "free")
    for joint, element in enumerate(elements):
        tips = [offsets[child] for child, its in enumerate(skeleton.parents) if its == joint]
        mine = [end for end, its in enumerate(skeleton.end_parents) if its == joint]
        for tip in [*tips, *(ends[end] for end in mine)] or [[0, 0, 0]]:
            element.append(_bone(tip))
        for end in mine:
            name = skeleton.point_names[skeleton.joints + end]
            # two ends of one joint have one name, which MuJoCo refuses
            named = {"name": name} if skeleton.point_names.count(name) == 1 else {}
            ElementTree.SubElement(element, "site", pos=_words(ends[end]), **named)
    where = {id(element): joint for joint, element in enumerate(elements)}
    return [where[id(element)] for element in world.iter("body")]


def _bone(tip: list[float]) -> ElementTree.Element:
    """What is seen of a bone to `tip` (3,), which touches nothing."""
    length = float(np.linalg.norm(tip))
    radius = f"{min(_RADIUS, max(length / 4, _RADIUS / 6)):.4g}"
    shape = {"size": radius, **_UNTOUCHED}
    if length < _SHORT:
        return ElementTree.Element("geom", type="sphere", **shape)
    return ElementTree.Element("geom", type="capsule", fromto=_words([0, 0, 0, *tip]), **shape)


def _states(motion: Motion, order: list[int]) -> np.ndarray:
    """Positions and quaternions, w first, of the joints in an order: (frames, 3 + 4 joints)."""
    turns = quaternions(motion.rotations)[:, order][..., [3, 0, 1, 2]]
    return torch.cat([motion.root_positions.detach().cpu(), turns.flatten(1)], dim=1).numpy()


def _words(numbers) -> str:
    return " ".join(f"{number:.8g}" for number in numbers)
