"""The body above the feet of a procedural gait: pelvis, trunk, head, arms, and the legs by IK."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import torch
from scipy.ndimage import gaussian_filter1d, maximum_filter1d
from scipy.spatial.transform import Rotation

from ..errors import DataError
from ..ik import two_bone
from ..motion import Motion
from ..skeleton import Skeleton
from . import gait_curves
from .footsteps import ANKLE_HEIGHT, Course
from .gait_curves import GRAVITY
from .swings import Foot

SIDES = {"left": 1, "right": -1}  # sign of x
STAND_REACH = 0.995  # leg length in use when standing: knees are a little bent
REACH = (0.997, 0.980)  # walking, running: no leg is stretched beyond this share of its length
STAND_AHEAD, STAND_ASIDE = -0.035, 0.012  # metres from the hip joint to the ankle, standing
ABDUCTION = 0.10  # radians; the canonical shoulders are narrower than the actor's
LOOK_AHEAD = 0.35  # seconds
TICKS, SINK_TIME = 60.0, 0.045  # per second; seconds


class Body(NamedTuple):
    skeleton: Skeleton
    leg: float  # thigh + shank, metres
    hip_width: float  # from the middle to a hip joint
    hip_drop: float  # from Hips down to the hip joints
    sole: np.ndarray  # (3,) from ankle to toe joint
    toe_length: float

    @staticmethod
    def canonical() -> Body:
        skeleton = Skeleton.canonical()
        offset = lambda role: skeleton.offsets[skeleton.role(role)].double().numpy()
        leg = -offset("left_lower_leg")[1] - offset("left_foot")[1]
        hip = offset("left_upper_leg")
        tip = skeleton.end_parents.index(skeleton.role("left_toes"))
        length = float(skeleton.end_offsets[tip].norm())
        return Body(skeleton, leg, hip[0], -hip[1], offset("left_toes"), length)


class Style(NamedTuple):
    """What is drawn by the seed: phase and slow random waves."""

    phase: float
    size: float
    pace: np.ndarray  # (waves, 3) radians a second
    shift: np.ndarray  # (waves, 3)

    @staticmethod
    def draw(seed: int | torch.Generator, noise: float, phase: float | None) -> Style:
        generator = seed
        if not isinstance(seed, torch.Generator):
            try:
                generator = torch.Generator().manual_seed(seed)
            except (TypeError, RuntimeError, ValueError, OverflowError) as error:
                raise DataError(
                    f"gaits: seed is {seed!r}; give a whole number or a torch.Generator."
                ) from error
        drawn = torch.rand(2, 8, 3, generator=generator, dtype=torch.float64).numpy()
        start = float(torch.rand((), generator=generator, dtype=torch.float64))
        pace = 2 * np.pi * (0.12 + 0.35 * drawn[0])
        return Style(start if phase is None else phase, noise, pace, 2 * np.pi * drawn[1])

    def wave(self, time: np.ndarray, number: int) -> np.ndarray:
        """A slow random wave of about unit size."""
        angle = np.multiply.outer(time, self.pace[number]) + self.shift[number]
        return self.size * np.sin(angle).sum(-1) / np.sqrt(1.5)


# -- the body above the feet ---------------------------------------------------------------------


class Pose(NamedTuple):
    """Body above the feet over time, arrays (n, ...): world orientations, metres, radians."""

    root: np.ndarray  # (n, 3)
    heading: np.ndarray
    hips: Rotation
    spine: Rotation
    chest: Rotation
    neck: Rotation
    head: Rotation
    arms: dict[str, tuple[np.ndarray, np.ndarray]]  # directions of upper and lower arm in the chest

    @staticmethod
    def at(
        course: Course,
        time: np.ndarray,
        style: Style,
        *,
        bounce: float,
        arm_swing: float,
        lean: float,
    ) -> Pose:
        signals = ("phase", "froude", "running", "effort", "heading", "speed", "turn_rate")
        phase, froude, running, effort, heading, speed, turn_rate = (
            course.at(time, signal) for signal in signals
        )
        effort = effort[:, None]

        def curve(name: str, shift: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
            mean, wave = gait_curves.curve(name, phase + shift, froude, running)
            return effort * mean, effort * wave

        # Into the bend the body leans as a bicycle does, though less: feet can push sideways.
        bank = 0.8 * np.arctan(speed * turn_rate / GRAVITY)
        push = np.gradient(course.speed, course.time)
        forward = 0.5 * np.arctan(np.interp(time, course.time, push) / GRAVITY)
        turned = Rotation.from_euler("y", heading[:, None])
        idle = 1 - effort[:, 0]
        breath = idle * np.sin(2 * np.pi * 0.25 * time + style.shift[0, 0])
        shift_weight = idle * style.wave(time, 1)

        def oriented(name: str, pitch, banked: float) -> Rotation:
            mean, wave = curve(name)
            tilt = Rotation.from_euler("zx", np.stack([-banked * bank, pitch], -1))
            return turned * tilt * Rotation.from_rotvec(mean + wave)

        hips = oriented("pelvis_rotation", 0.3 * lean + 0.4 * forward, 0.8)
        chest = oriented("chest_rotation", lean + forward + 0.008 * breath, 1.0)
        ahead = course.at(time + LOOK_AHEAD, "heading") - heading
        ahead = np.clip(ahead, -0.6, 0.6) + 0.03 * shift_weight
        ahead = Rotation.from_euler("y", ahead[:, None])
        head = oriented("head_rotation", 0.15 * (lean + forward), 0.3)
        head = turned * ahead * turned.inv() * head
        between = lambda a, b: a * Rotation.from_rotvec((a.inv() * b).as_rotvec() / 2)

        mean, wave = curve("pelvis_position")
        sway = mean + wave * [1.0, bounce, 1.0]
        sway[:, 0] += 0.006 * shift_weight + 0.55 * np.sin(bank)
        body = Body.canonical()
        root = body.leg * turned.apply(sway)
        root[:, [0, 2]] += course.at(time, "way")
        root[:, 1] += ANKLE_HEIGHT + STAND_REACH * body.leg + body.hip_drop

        arms = {}
        for side, sign in SIDES.items():
            bones = []
            for part in ("upper_arm", "lower_arm"):
                mean, wave = gait_curves.curve(
                    part, phase + (0 if sign > 0 else 0.5), froude, running
                )
                stand = np.array(gait_curves.table()["stand"][part])
                bone = stand + effort * (mean - stand + arm_swing * wave)
                bone = Rotation.from_euler("z", ABDUCTION).apply(bone) * [sign, 1.0, 1.0]
                bones.append(bone / np.linalg.norm(bone, axis=-1, keepdims=True))
            arms[side] = tuple(bones)
        return Pose(
            root, heading, hips, between(hips, chest), chest, between(chest, head), head, arms
        )


def _hip_joints(body: Body, pose: Pose) -> dict[str, np.ndarray]:
    """Each hip joint relative to Hips, (n, 3) metres."""
    return {
        side: pose.hips.apply([sign * body.hip_width, -body.hip_drop, 0.0])
        for side, sign in SIDES.items()
    }


def sink(body: Body, pose: Pose, feet: dict[str, Foot], running: np.ndarray) -> np.ndarray:
    """Metres (n,) by which the body must come down for its legs to reach the feet, at TICKS."""
    reach = REACH[0] + running * (REACH[1] - REACH[0])
    needed = np.zeros(len(pose.root))
    for side, below in _hip_joints(body, pose).items():
        joint, ankle = pose.root + below, feet[side].ankle
        level = ((ankle - joint)[:, [0, 2]] ** 2).sum(-1)
        highest = ankle[:, 1] + np.sqrt(np.maximum((reach * body.leg) ** 2 - level, 0.01))
        needed = np.maximum(needed, joint[:, 1] - highest)
    # At least what is needed, at most as sudden as SINK_TIME allows.
    widest = maximum_filter1d(needed, 2 * round(2 * SINK_TIME * TICKS) + 1)
    return gaussian_filter1d(widest, SINK_TIME * TICKS, truncate=2)


def assemble(body: Body, pose: Pose, feet: dict[str, Foot], fps: float, name: str) -> Motion:
    """Joint rotations from the pose and the feet."""
    skeleton, count = body.skeleton, len(pose.root)
    hips = pose.hips.as_matrix()
    legs = _legs(body, pose, feet)
    world = {joint: np.broadcast_to(np.eye(3), (count, 3, 3)) for joint in skeleton.names}
    world |= {
        "Hips": hips,
        "Spine": pose.spine.as_matrix(),
        "Chest": pose.chest.as_matrix(),
        "Neck": pose.neck.as_matrix(),
        "Head": pose.head.as_matrix(),
    }
    for side, sign in SIDES.items():
        label = side.capitalize()
        world[f"{label}Shoulder"] = world["Chest"]
        upper, lower = _arm(*pose.arms[side], sign)
        world[f"{label}UpperArm"] = world["Chest"] @ upper
        world[f"{label}LowerArm"] = world["Chest"] @ lower
        world[f"{label}Hand"] = world["Chest"] @ lower
        foot = feet[side]
        world[f"{label}UpperLeg"], world[f"{label}LowerLeg"] = legs[side]
        turn = np.stack([foot.yaw, -foot.pitch], -1)
        world[f"{label}Foot"] = Rotation.from_euler("YX", turn).as_matrix()
        turn = np.stack([foot.yaw, -foot.toe_pitch], -1)
        world[f"{label}Toes"] = Rotation.from_euler("YX", turn).as_matrix()

    rotations = np.empty((count, skeleton.joints, 3, 3))
    for joint, (joint_name, parent) in enumerate(
        zip(skeleton.names, skeleton.parents, strict=True)
    ):
        above = np.eye(3) if parent < 0 else world[skeleton.names[parent]]
        rotations[:, joint] = np.swapaxes(above, -1, -2) @ world[joint_name]
    contacts = np.concatenate([feet["left"].contacts, feet["right"].contacts], -1)
    return Motion(
        skeleton, pose.root, rotations, fps, name, "gaits", contacts=torch.from_numpy(contacts)
    )


def _legs(body: Body, pose: Pose, feet: dict[str, Foot]) -> dict[str, tuple]:
    """World rotations of thigh and shank of each leg, (n, 3, 3) each."""
    hips, ankles, knees = [], [], []
    for (side, sign), below in zip(SIDES.items(), _hip_joints(body, pose).values(), strict=True):
        between = (pose.heading + feet[side].yaw) / 2 + 0.06 * sign
        hips.append(pose.root + below)
        ankles.append(feet[side].ankle)
        knees.append(np.stack([np.sin(between), 0 * between, np.cos(between)], -1))
    offsets = [
        body.skeleton.offsets[body.skeleton.role(f"left_{j}")] for j in ("lower_leg", "foot")
    ]
    both = [torch.from_numpy(np.stack(points)) for points in (hips, ankles, knees)]
    thighs, shanks = (turns.numpy() for turns in two_bone(*both, *offsets))
    return {side: (thighs[i], thighs[i] @ shanks[i]) for i, side in enumerate(SIDES)}


def _arm(upper: np.ndarray, lower: np.ndarray, sign: int) -> tuple[np.ndarray, np.ndarray]:
    """Orientations of upper and lower arm in the chest from their directions, (n, 3, 3) each.

    The bones lie along +x (left) or -x (right) at rest and the elbow turns about y.
    """
    # Where the elbow is nearly straight its axis says little: then it points sideways.
    axis = np.cross(upper, lower) - 0.15 * np.array([1.0, 0.0, 0.0])
    frames = []
    for bone in (upper, lower):
        x = sign * bone
        y = -sign * axis
        y = y - (y * x).sum(-1, keepdims=True) * x
        y = y / np.linalg.norm(y, axis=-1, keepdims=True)
        frames.append(np.stack([x, y, np.cross(x, y)], -1))
    return frames[0], frames[1]
