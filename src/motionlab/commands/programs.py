"""What each program needs of a file, so that nothing is lost on the way: `motionlab convert --for`.

GLB, USD and MuJoCo's XML say their unit and their axes themselves. BVH does not: there each program
has a habit. The page *Between programs* shows what they do to files.
"""

from __future__ import annotations

from dataclasses import dataclass, field

from ..errors import MotionLabError
from .choices import chosen


@dataclass(frozen=True)
class Program:
    """How files for a program are written.

    Attributes
    ----------
    title : as its makers call it.
    endings : of the files that it opens, the one first that loses least.
    notes : what to set there, by ending.
    tried : with which version all endings were tried, point by point; "" if with none.
    units, up, names : of BVH, as `write_bvh` takes them.
    root_motion : as `write_bvh` and `write_gltf` take it; what is asked for goes first.
    """

    title: str
    endings: tuple[str, ...]
    notes: dict[str, str] = field(default_factory=dict)
    tried: str = ""
    units: str = "cm"
    up: str = "y"
    names: str = "kept"
    root_motion: str | None = None

    def note(self, ending: str, root_motion: str | None) -> str:
        """What to know of a file that ends so and was written with such a root; "" if nothing."""
        said = [self.notes[ending]] if ending in self.notes else []
        if self.root_motion:
            said.append(_MOVED_BY[root_motion])
        if self.title and not self.tried:
            said.append(f"not tried in {self.title}: look at one file there before you write many")
        return "; ".join(said)


_MOVED_BY = {
    "ground": "let the engine move the character by its root joint, which carries way and heading",
    "in-place": "it stays on its spot: way and heading are the engine's to give",
    None: "no root joint was added: its own uppermost joint carries way and heading",
}
_ONCE = "to stop at the last frame, setLoop(LoopOnce) and clampWhenFinished"

ANY = Program("", (".bvh", ".glb", ".usda", ".xml"))
PROGRAMS = {
    "blender": Program(
        "Blender",
        (".glb", ".bvh", ".usda"),
        {
            ".glb": "give the scene the clip's frame rate before the file is opened, or its keys fall "
            "between frames",
            ".bvh": "tick Update Scene FPS and Update Scene Duration where it is opened",
            ".usda": "give the scene the clip's frame rate by hand",
        },
        "bpy 4.5.15",
        units="m",  # one unit of a scene is a metre
    ),
    "three": Program(
        "three.js",
        (".glb", ".bvh"),
        {".glb": _ONCE, ".bvh": _ONCE},
        "three 0.187.0",
        units="m",
        names="safe",  # a colon would keep a joint still
    ),
    "unreal": Program("Unreal", (".glb",), root_motion="ground"),
    "unity": Program("Unity", (".glb",), {".glb": "glTFast opens it"}, root_motion="ground"),
    "mujoco": Program(
        "MuJoCo",
        (".xml",),
        {
            ".xml": "mujoco.mj_resetDataKeyframe(model, data, i), then mj_forward, shows frame i; under "
            "mj_step it falls, as gravity pulls it, nothing drives it, and it meets no floor"
        },
        "mujoco 4.0.0",
    ),
    "usd": Program("USD", (".usda",), {".usda": "a time code is a frame"}, "usd-core 26.11"),
}
SERVED = {"godot": "Godot", "babylon": "Babylon.js", "gltf": "every reader of glTF"}
"""What needs no file of its own: GLB as it comes is what these open."""


def program_for(said: str | None) -> Program:
    """The program that ``--for`` names; raises MotionLabError for one that is not known."""
    if said is None:
        return ANY
    if (word := said.lower()) in SERVED:
        raise MotionLabError(
            f"--for {said}: {SERVED[word]} opens GLB as it comes; leave --for out, and name a file "
            "that ends in .glb, as --out walk.glb."
        )
    return PROGRAMS[chosen("--for", said, PROGRAMS)]
