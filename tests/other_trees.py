"""The same body in motion on trees as rigs have them: joints above, between and beside its own.

What the body's own joints do in the world stays, to rounding; which tree they hang in changes.
"""

from __future__ import annotations

from typing import NamedTuple

import roma
import torch
from rig_names import CONVENTIONS, names_of

from motionlab import Motion, Skeleton
from motionlab.roles import SIDES


class Joint(NamedTuple):
    parent: str | None
    place: torch.Tensor  # (frames, 3) metres
    turn: torch.Tensor  # (frames, 3, 3), in the world


class Rig:
    """A tree of joints that is being changed. `own` has the name of each role's joint."""

    def __init__(self, motion: Motion, convention: str, generator: torch.Generator) -> None:
        names = names_of(CONVENTIONS[convention])
        s, points, turns = motion.skeleton, motion.positions(), motion.orientations()
        self.tree = {
            name: Joint(None if p < 0 else names[p], points[:, j], turns[:, j])
            for j, (name, p) in enumerate(zip(names, s.parents, strict=True))
        }
        self.own = {role: names[joint] for role, joint in s.roles.items()}
        self.called = dict(zip(SIDES, CONVENTIONS[convention].split()[-2:], strict=True))
        self.generator, self.motion = generator, motion
        self.ends = [
            (names[p], offset) for p, offset in zip(s.end_parents, s.end_offsets, strict=True)
        ]

    def pick(self, *of):
        return of[int(torch.randint(len(of), (), generator=self.generator))]

    def new(self, name: str, parent: str | None, place: torch.Tensor, turn: torch.Tensor) -> str:
        """A joint of this name, or of one like it if another has it."""
        while name in self.tree:
            name += "B"
        self.tree[name] = Joint(parent, place, turn)
        return name

    def between(self, joint: str, name: str, at: float, twist: float = 0.0) -> None:
        """A joint on a joint's bone, at a share of it, twisting by radians about it or not at all."""
        own = self.tree[joint]
        above = self.tree[own.parent]
        way, turn = own.place - above.place, above.turn
        if twist:
            axis = torch.nn.functional.normalize(way, dim=-1)
            turn = _twisted(axis, twist) @ turn
        self.hang([joint], self.new(name, own.parent, above.place + at * way, turn))

    def beside(self, joint: str | None, name: str, offset: tuple[float, float, float]) -> str:
        """A joint that hangs on one and goes where it goes."""
        on = self.tree[joint]
        return self.new(name, joint, on.place + on.turn @ torch.tensor(offset), on.turn)

    def hang(self, joints: list[str], onto: str) -> None:
        for joint in joints:
            self.tree[joint] = self.tree[joint]._replace(parent=onto)

    def on(self, joint: str) -> list[str]:
        return [name for name, each in self.tree.items() if each.parent == joint]

    def pairs(self, part: str, *styles: str):
        """Both sides' joint of a role and a name beside it; @ is its side, & its own name."""
        style = self.pick(*styles)
        for side in SIDES:
            own = self.own[f"{side}_{part}"]
            yield own, style.replace("@", self.called[side]).replace("&", own)

    def grown(self) -> Motion:
        """The motion on this tree; contacts as they were."""
        order: list[str] = []
        while len(order) < len(self.tree):
            order += [
                n for n, j in self.tree.items() if n not in order and j.parent in (None, *order)
            ]
        offsets, rotations = [], []
        for name in order:
            above, place, turn = self.tree[name]
            on = self.tree.get(above, Joint(None, torch.zeros(3), torch.eye(3)))
            offset = (on.turn.mT @ (place - on.place)[..., None])[..., 0]
            if above is not None:
                assert (offset - offset.mean(0)).abs().max() < 1e-4, f"{name} slides on {above}"
            offsets.append(offset.mean(0))
            rotations.append(on.turn.mT @ turn)
        parents = [order.index(self.tree[n].parent) if self.tree[n].parent else -1 for n in order]
        body = Skeleton(
            order, parents, torch.stack(offsets), [order.index(name) for name, _ in self.ends],
            torch.cat([torch.zeros(0, 3), *(offset[None] for _, offset in self.ends)]),
        )  # fmt: skip
        m, root = self.motion, self.tree[order[0]].place
        body.offsets[0] = m.skeleton.offsets[0] - body.rest_points[order.index(self.own["hips"])]
        return Motion(body, root, torch.stack(rotations, 1), m.fps, m.name, contacts=m.contacts)


def _twisted(axis: torch.Tensor, radians: float) -> torch.Tensor:
    """Rotations (frames, 3, 3) to and fro about axes (frames, 3)."""
    return roma.rotvec_to_rotmat(radians * torch.sin(torch.arange(len(axis)) / 7)[:, None] * axis)


# -- what rigs do ---------------------------------------------------------------------------------


def root_above(rig: Rig) -> None:
    """A root on the floor or in the hips, which turns with the hips or not at all."""
    hips = rig.tree[rig.own["hips"]]
    (top,) = rig.on(None)
    turn = rig.pick(hips.turn, torch.eye(3).expand_as(hips.turn))
    place = hips.place + turn @ torch.tensor(rig.pick((0.0, 0.0, 0.0), (0.0, -0.9, 0.0)))
    name = rig.pick("root", "Armature", "Reference", "world", "Bip01", "RL_BoneRoot", "hips_root")
    rig.hang([top], rig.new(name, None, place, turn))


def legs_on_a_pelvis(rig: Rig) -> None:
    """Both legs on a joint that hangs on the hips beside the spine, or carries that, too."""
    hips = rig.own["hips"]
    hung = rig.pick(rig.on(hips), [rig.own[f"{side}_upper_leg"] for side in SIDES])
    name = rig.pick("pelvis", "waist", "Waist", "LegRoot", "lower_body", "&_ctrl", "&_offset")
    offset = rig.pick((0.0, 0.0, 0.0), (0.0, -0.05, 0.0))
    rig.hang(hung, rig.beside(hips, name.replace("&", hips), offset))


def legs_on_the_spine(rig: Rig) -> None:
    """As in Biped: the legs, and the spine proper, hang on a first joint of the spine."""
    hips = rig.own["hips"]
    name = rig.pick("spine_00", "Spine0", "lower_spine", "back_base")
    rig.hang(rig.on(hips), rig.beside(hips, name, rig.pick((0.0, 0.0, 0.0), (0.0, 0.1, 0.0))))


def a_mount_a_leg(rig: Rig) -> None:
    """Each leg on a joint of its side that never turns, as CMU's LHipJoint."""
    at = rig.pick(0.0, 0.5, 1.0)
    for leg, name in rig.pairs(
        "upper_leg", "pelvis_@", "@_hip_joint", "@_groin", "&_offset", "null_@"
    ):
        rig.between(leg, name, at)


def joints_in_limbs(rig: Rig) -> None:
    """Joints on long bones, which carry the next one: they twist, or only have an offset."""
    for part in ("lower_arm", "hand", "lower_leg", "foot"):
        at, twist = rig.pick(0.0, 0.3, 0.5, 1.0), rig.pick(0.0, 0.0, 0.6)
        style = rig.pick("&_twist", "&Roll", "twist_&", "&_offset", "null_&", "&_grp", "between_@")
        for joint, _ in rig.pairs(part, ""):
            above = rig.tree[joint].parent
            side = next(s for s in SIDES if rig.own[f"{s}_{part}"] == joint)
            rig.between(joint, style.replace("@", rig.called[side]).replace("&", above), at, twist)


def twist_beside(rig: Rig) -> None:
    """Twist joints that hang on long bones and carry nothing."""
    for part in ("upper_arm", "lower_arm", "upper_leg", "lower_leg"):
        for joint, name in rig.pairs(part, "&_twist", "&_twist_01", "&Roll", "twist_&", "&_share"):
            rig.beside(joint, name, (0.0, -0.1, 0.0))


def bend_and_twist(rig: Rig) -> None:
    """As in Daz: the first joint of a limb bends, and the next one twists what hangs on it."""
    for part, below in rig.pick(
        [("upper_leg", "lower_leg")], [("lower_arm", "hand"), ("upper_leg", "lower_leg")]
    ):
        for (joint, name), (child, _) in zip(
            rig.pairs(part, "&_twist", "&Twist"), rig.pairs(below, ""), strict=True
        ):
            own = rig.tree[joint]
            axis = torch.nn.functional.normalize(rig.tree[child].place - own.place, dim=-1)
            rig.tree[joint] = own._replace(turn=_twisted(axis, -0.5) @ own.turn)
            below_it = rig.on(joint)
            rig.hang(below_it, rig.new(name, joint, own.place, own.turn))


def joints_in_feet(rig: Rig) -> None:
    """A joint between ankle and toes, and toes that go on."""
    for toes, name in rig.pairs(
        "toes", "@_metatarsals", "@_subtalar", "@_arch", "mid_@", "&_offset"
    ):
        rig.between(toes, name, rig.pick(0.3, 0.6, 1.0))
    if rig.pick(True, False):
        for toes, name in rig.pairs("toes", "&_end", "&2", "&Nub", "@_big_toe_1"):
            rig.beside(toes, name, (0.0, 0.0, 0.05))


def ends_as_joints(rig: Rig) -> None:
    """Tips are joints that carry nothing, and there are no end sites."""
    style = rig.pick("&_end", "&End", "&_nub", "&_tip")
    for joint, offset in rig.ends:
        rig.beside(joint, style.replace("&", joint), tuple(offset.tolist()))
    rig.ends.clear()


def targets_beside(rig: Rig) -> None:
    """Targets and poles of inverse kinematics and controls, on the root or on the hips."""
    (top,) = rig.on(None)
    on = rig.pick(top, rig.own["hips"])
    if rig.pick(True, False):
        on = rig.beside(on, "ik_foot_root", (0.0, 0.0, 0.0))
    for part, styles in {
        "foot": ("ik_foot_@", "&_ik", "ik_&", "@_foot_ctrl", "&_target", "foot_ik.@"),
        "lower_leg": ("&_pole", "@_knee_pole", "pole_&", "@_knee_target"),
        "hand": ("ik_hand_@", "&_ik", "@_hand_ctrl"),
    }.items():
        for _, name in rig.pairs(part, *styles):
            rig.beside(on, name, (0.1, -0.9, 0.3))
    if rig.pick(True, False):
        for foot, name in rig.pairs("foot", "@_heel", "&_roll", "heel_roll_@"):
            rig.beside(foot, name, (0.0, -0.05, -0.05))


def collars_on_the_neck(rig: Rig) -> None:
    """As in Biped: a neck that goes with the chest carries collars and what turns the head."""
    chest = rig.tree[rig.own["chest"]]
    neck = rig.own["neck"]
    low = rig.new(f"{neck}_base", rig.own["chest"], rig.tree[neck].place, chest.turn)
    rig.hang([neck, *(rig.own[f"{side}_shoulder"] for side in SIDES)], low)


def more_spine(rig: Rig) -> None:
    """Joints that never turn in the trunk, the last of which carries arms and neck."""
    rig.between(
        rig.own["chest"],
        rig.pick("spine_mid", "&_offset", "torso_2").replace("&", rig.own["spine"]),
        0.5,
    )
    chest = rig.own["chest"]
    if rig.pick(True, False):
        high = rig.beside(
            chest,
            rig.pick("upper_spine", "&_2", "rib_offset").replace("&", chest),
            (0.0, 0.05, 0.0),
        )
        rig.hang([joint for joint in rig.on(chest) if joint != high], high)


def arms_without_collars(rig: Rig) -> None:
    for side in SIDES:
        collar = rig.own[f"{side}_shoulder"]
        rig.hang([rig.own[f"{side}_upper_arm"]], rig.tree[collar].parent)
        del rig.tree[collar]


CHANGES = {
    change.__name__: change
    for change in (
        legs_on_a_pelvis, legs_on_the_spine, a_mount_a_leg, more_spine, collars_on_the_neck,
        arms_without_collars, bend_and_twist, joints_in_limbs, twist_beside, joints_in_feet,
        ends_as_joints, targets_beside, root_above,
    )
}  # fmt: skip


def regrown(motion: Motion, changes: set[str], convention: str, seed: int) -> Motion:
    """A motion of the canonical body under other names, and its tree changed."""
    rig = Rig(motion, convention, torch.Generator().manual_seed(seed))
    for name, change in CHANGES.items():
        if name in changes:
            change(rig)
    return rig.grown()
