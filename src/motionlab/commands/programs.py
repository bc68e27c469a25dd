"""What each program needs of a file, so that nothing is lost on the way: `motionlab convert --for`.

GLB, USD and MuJoCo's XML say their unit and their axes themselves. BVH does not: there each program
has a habit. The page *Between programs* shows what they do to files.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Program:
    """How files for a program are written.

    Attributes
    ----------
    endings : of the files that it opens, the one first that loses least.
    note : what to set there.
    tried : with which version all endings were tried, point by point; "" if with none.
    units, up, names : of BVH, as `write_bvh` takes them.
    root_motion : as `write_bvh` and `write_gltf` take it; what is asked for goes first.
    """

    endings: tuple[str, ...]
    note: str = ""
    tried: str = ""
    units: str = "cm"
    up: str = "y"
    names: str = "kept"
    root_motion: str | None = None


ANY = Program((".bvh", ".glb", ".usda", ".xml"))
_ENGINE = (
    "its root joint, called Root, carries way and heading: let the engine move the character by it"
)
PROGRAMS = {
    "blender": Program(
        (".glb", ".bvh", ".usda"),
        "give the scene the clip's frame rate before a GLB file is opened, or its keys fall between "
        "frames; for BVH tick Update Scene FPS and Update Scene Duration",
        "bpy 4.5.15",
        units="m",  # one unit of a scene is a metre
    ),
    "three": Program(
        (".glb", ".bvh"),
        "to stop at the last frame, setLoop(LoopOnce) and clampWhenFinished",
        "three 0.187.0",
        units="m",
        names="safe",  # a colon would keep a joint still
    ),
    "unreal": Program((".glb",), _ENGINE, root_motion="ground"),
    "unity": Program((".glb",), f"glTFast opens it; {_ENGINE}", root_motion="ground"),
    "mujoco": Program(
        (".xml",),
        "frame i is data.qpos[:] = model.key_qpos[i], then mj_forward: bodies are moved by hand, as "
        "nothing drives them",
        "mujoco 4.0.0",
    ),
    "usd": Program((".usda",), "a time code is a frame", "usd-core 26.11"),
}
