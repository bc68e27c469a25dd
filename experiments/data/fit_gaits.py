"""Fit the curves of `motionlab.datasets.gaits` to real walks and runs: writes gaits.json.

    python -m experiments.data.fit_gaits FOLDER_WITH_ACCAD_BVH [--output gaits.json]

The clips are those of one actor, "Male1", ACCAD Motion Lab, The Ohio State University, CC BY 3.0.

Every gait cycle of every clip, between two strikes of the same foot, becomes one row of Fourier
coefficients per curve; a cycle that starts with the right foot is mirrored first. A regression over
all cycles of a gait then gives each coefficient as a straight line in speed. Lengths are in leg
lengths and speeds are Froude speeds v / sqrt(g leg), so that the curves fit a body of any size
(Alexander and Jayes 1983: bodies of different size move alike at equal Froude speed).
"""

from __future__ import annotations

import argparse
import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation

import motionlab
from motionlab.datasets.gait_curves import HARMONICS, clamped_basis, fourier_basis
from motionlab.datasets.swings import ease, stages, turned

GRAVITY = 9.81
_CANONICAL = motionlab.Skeleton.canonical()
_OFFSET = dict(zip(_CANONICAL.names, _CANONICAL.offsets.double().numpy(), strict=True))
SOLE = _OFFSET["LeftToes"] / -(_OFFSET["LeftLowerLeg"] + _OFFSET["LeftFoot"])[1]  # in leg lengths
STAND = {"Male1_A1_Stand": (20, 120), "Male1_B1_StandToWalk": (0, 45)}
WALKS = (
    *("Male1_B1_StandToWalk", "Male1_B2_WalkToStand", "Male1_B3_Walk", "Male1_B9_WalkToTurnLeft90"),
    *("Male1_B10_WalkTurnLeft45", "Male1_B11_WalkTurnLeft135", "Male1_B12_WalkTurnRight90"),
    *("Male1_B13_WalkTurnRight45", "Male1_B14_WalkTurnRight135", "Male1_C04_RunToWalk"),
)
RUNS = (
    *("Male1_C01_StandToRun", "Male1_C02_RunToStand", "Male1_C03_Run", "Male1_C04_RunToWalk"),
    "Male1_C05_WalkToRun",
)
SPEEDS = {"walk": (0.7, 1.8), "run": (2.4, 5.6)}  # metres a second, of cycles that are kept
STRAIGHT = np.radians(8)  # a kept cycle turns less than this from its first to its second half
STEADY = {"walk": 0.15, "run": 0.25}  # ... and changes its speed by less than this part
SLOPE_PRIOR = 0.5  # Froude units: slopes seen over a narrower range are mostly the prior's
# A foot is down from the moment it is slower than a share of the body's speed until it is faster
# than another. The ankle rests late, when heel and cushion have given way; the toes leave late.
SLOW = {"walk": (0.35, 0.8), "run": (0.42, 0.25)}
HEEL_RISE = 0.007  # metres
# Strides a second grow with a power of speed. Square root in walks (Boulic, Magnenat-Thalmann and
# Thalmann 1990, after Inman); less in runs, where longer strides make the speed. The clips say how
# fast, their range of speeds is too small to say how the rate grows.
RATE_EXPONENT = {"walk": 0.5, "run": 0.25}
# The share of a walk's cycle for which a foot is down falls to one half where walks become runs.
DUTY_EXPONENT = {"walk": -0.15, "run": 0.0}
MIRROR = np.array([-1.0, 1.0, 1.0])
SAMPLES = 120  # a cycle


@dataclass
class Clip:
    """A clip in the fit's own terms: spline functions of time in frames."""

    name: str
    fps: float
    leg: float
    point: dict[str, CubicSpline]  # role -> position (3,) metres, floor level
    turn: dict[str, CubicSpline]  # hips, chest, head -> rotation matrix (9,) from standing
    stand: dict[str, float]  # height of the hip joints over the toes, slope of the foot
    frames: int


def read(folder: Path, name: str) -> motionlab.Motion:
    return motionlab.read_bvh(folder / f"{name}.bvh", units="cm")


def floor(folder: Path) -> np.ndarray:
    """(3,) height, slope along x, slope along z of the capture floor, which is off level by 1 %.

    A plane through the toes at rest in all clips; the right ones are tracked 2 cm higher than the
    left ones, so that the floor lies half-way.
    """
    rows, heights = [], []
    for name in sorted({*STAND, *WALKS}):
        motion = read(folder, name)
        positions = motion.positions().double().numpy()
        for sign, side in ((0.5, "left"), (-0.5, "right")):
            toes = positions[:, motion.skeleton.roles[f"{side}_toes"]]
            rest = toes[np.linalg.norm(np.gradient(toes, axis=0), axis=1) * motion.fps < 0.35]
            rows.append(np.insert(rest[:, [0, 2]], 0, 1, axis=1))
            rows[-1] = np.c_[rows[-1], np.full(len(rest), sign)]
            heights.append(rest[:, 1])
    return np.linalg.lstsq(np.concatenate(rows), np.concatenate(heights), rcond=None)[0][:3]


def levelled(motion: motionlab.Motion, plane: np.ndarray) -> np.ndarray:
    """Positions (frames, points, 3) over a floor where resting toes have height 0."""
    positions = motion.positions().double().numpy()
    positions[..., 1] -= plane[0] + positions[..., [0, 2]] @ plane[1:]
    return positions


def standing(folder: Path, plane: np.ndarray) -> tuple[dict[str, Rotation], dict[str, np.ndarray]]:
    """Mean orientation of hips, chest and head, and mean points, of a body that stands facing z."""
    orientations, points = {"hips": [], "chest": [], "head": []}, []
    for name, (start, stop) in STAND.items():
        motion = read(folder, name)[start:stop]
        roles, positions = motion.skeleton.roles, levelled(motion, plane)
        across = positions[:, roles["left_upper_leg"]] - positions[:, roles["right_upper_leg"]]
        back = Rotation.from_euler("y", np.arctan2(across[:, 2].mean(), across[:, 0].mean()))
        for role, found in orientations.items():
            turns = motion.orientations()[:, roles[role]].numpy()
            found.append((back * Rotation.from_matrix(turns)).mean())
        points.append(back.apply((positions - positions[:, :1] * [1, 0, 1]).mean(0)))
    named = {role: np.mean(points, 0)[joint] for role, joint in roles.items()}
    mean = {role: Rotation.concatenate(found).mean() for role, found in orientations.items()}
    return mean, named


def prepare(folder: Path, name: str, plane: np.ndarray, stand: dict, points: dict) -> Clip:
    motion = read(folder, name)
    roles, positions = motion.skeleton.roles, levelled(motion, plane)
    height = (points["left_upper_leg"] + points["right_upper_leg"])[1] / 2
    feet = [points[f"{side}_toes"] - points[f"{side}_foot"] for side in ("left", "right")]
    slope = np.mean([np.arctan2(foot[1], np.hypot(foot[0], foot[2])) for foot in feet])
    offsets = motion.skeleton.offsets
    leg = float(offsets[[roles["left_lower_leg"], roles["left_foot"]]].norm(dim=1).sum())
    time = np.arange(len(motion))
    turns = motion.orientations().double().numpy()
    turns = {role: turns[:, roles[role]] @ stand[role].inv().as_matrix() for role in stand}
    return Clip(
        name,
        motion.fps,
        leg,
        {role: CubicSpline(time, positions[:, joint]) for role, joint in roles.items()},
        {role: CubicSpline(time, turn.reshape(-1, 9)) for role, turn in turns.items()},
        {"hip": height, "slope": slope},
        len(motion),
    )


# -- gait events --------------------------------------------------------------------------------


def events(clip: Clip, side: str) -> list[tuple[float, float, float, float, float]]:
    """(strike, flat, heel off, toe off, next strike) of each whole cycle of one foot, in frames."""
    time = np.arange(0, clip.frames - 1, 0.1)
    ankle = np.linalg.norm(clip.point[f"{side}_foot"](time, 1), axis=1) * clip.fps
    toes = np.linalg.norm(clip.point[f"{side}_toes"](time, 1), axis=1) * clip.fps
    hips = np.linalg.norm(clip.point["hips"](time, 1)[:, [0, 2]], axis=1) * clip.fps
    # Down where ankle or toes are slow beside the body and near the floor.
    height = clip.point[f"{side}_toes"](time)[:, 1]
    share = SLOW["walk" if np.median(hips) < 2 else "run"]
    slowest = np.minimum(ankle, toes)
    low = height < 0.12
    starts = np.flatnonzero(np.diff((low & (slowest < share[0] * hips + 0.1)).astype(int)) > 0) + 1
    stops = np.flatnonzero(np.diff((low & (slowest < share[1] * hips + 0.1)).astype(int)) < 0)
    found = []
    for strike, following in zip(starts, starts[1:], strict=False):
        off = next((s for s in stops if strike < s < following), None)
        if off is None or not 10 < (following - strike) / 10 < 50:
            continue
        stance = slice(strike, off)
        slow = np.flatnonzero(toes[stance] < 0.25 * hips[stance] + 0.05)
        if len(slow) < 3:
            continue
        flat = strike + slow[0]
        # The heel is off once the ankle has risen from its lowest.
        rise = clip.point[f"{side}_foot"](time[flat:off])[:, 1]
        lowest = int(rise.argmin())
        late = np.flatnonzero(rise[lowest:] > rise[lowest] + HEEL_RISE)
        heel = flat + lowest + (late[0] if len(late) else 0)
        found.append(tuple(time[[strike, flat, heel, off, following]]))
    return found


def cycles(clip: Clip, gait: str) -> list[dict]:
    found = []
    low, high = SPEEDS[gait]
    for side in ("left", "right"):
        for event in events(clip, side):
            cycle = measure(clip, side, *event)
            stance = (event[3] - event[0]) / (event[4] - event[0])
            runs = stance < 0.5
            steady = abs(cycle["turn"]) < STRAIGHT and abs(cycle["change"]) < STEADY[gait]
            if low < cycle["speed"] < high and steady and runs == (gait == "run"):
                found.append(cycle)
    return found


# -- one cycle ----------------------------------------------------------------------------------


def measure(clip, side, strike, flat, heel_off, toe_off, following) -> dict:
    """All curves of one cycle as Fourier coefficients, in leg lengths and radians."""
    leg, period = clip.leg, following - strike
    time = strike + period * np.arange(SAMPLES) / SAMPLES
    hips = clip.point["hips"]
    travel = hips(following) - hips(strike)
    half = hips(strike + period / 2) - hips(strike)
    rest = travel - half
    bearing = lambda v: np.arctan2(v[0], v[2])
    turn = (bearing(rest) - bearing(half) + np.pi) % (2 * np.pi) - np.pi
    length = lambda v: np.hypot(v[0], v[2])
    change = (length(rest) - length(half)) / (length(travel) / 2)
    level = Rotation.from_euler("y", -bearing(travel))  # world to a frame whose z is the way
    swap = 1 if side == "left" else -1
    other = {"left": "right", "right": "left"}
    flip = MIRROR if side == "right" else np.ones(3)

    def local(role: str, when) -> np.ndarray:
        if side == "right":  # the mirrored body's left foot strikes first
            head, _, tail = role.partition("_")
            role = f"{other[head]}_{tail}" if head in other else role
        return level.apply(clip.point[role](when)) * flip

    def orientation(role: str) -> Rotation:
        turns = level * Rotation.from_matrix(clip.turn[role](time).reshape(-1, 3, 3))
        return Rotation.from_rotvec(turns.as_rotvec() * [1.0, swap, swap])

    speed = np.linalg.norm(travel[[0, 2]]) / period * clip.fps
    root = local("hips", time)
    straight = local("hips", strike) + np.outer(
        (time - strike) / period, local("hips", following) - local("hips", strike)
    )
    sway = (root - straight) / leg
    sway[:, 0] -= sway[:, 0].mean()
    sway[:, 2] -= sway[:, 2].mean()
    hip_joints = (local("left_upper_leg", time) + local("right_upper_leg", time)) / 2
    sway[:, 1] = (hip_joints[:, 1] - clip.stand["hip"]) / leg
    chest = orientation("chest")
    curves = {
        "pelvis_position": sway,
        "pelvis_rotation": orientation("hips").as_rotvec(),
        "chest_rotation": chest.as_rotvec(),
        "head_rotation": orientation("head").as_rotvec(),
    }
    for part, child in (("upper_arm", "lower_arm"), ("lower_arm", "hand")):
        for arm in ("left", "right"):
            bone = local(f"{arm}_{child}", time) - local(f"{arm}_{part}", time)
            bone = chest.inv().apply(bone / np.linalg.norm(bone, axis=1, keepdims=True))
            curves[f"{arm}_{part}"] = bone
    basis = fourier_basis(np.arange(SAMPLES) / SAMPLES)
    fitted = {name: np.linalg.lstsq(basis, curve, rcond=None)[0] for name, curve in curves.items()}

    # The foot that struck: its slope from heel off over toe off and strike to flat ...
    def slope(when):
        foot = local("left_toes", when) - local("left_foot", when)
        return np.arctan2(foot[:, 1], foot[:, 2])

    # The slope of a foot that lies flat: as in this stance, in runs (heel hardly down) as standing.
    lying = np.median(slope(np.linspace(flat, max(heel_off, flat + 1), 20)))
    rest_slope = lying if (toe_off - strike) / period > 0.5 else clip.stand["slope"]
    # ... over the stages of the next swing, which are those of the made foot.
    marks = np.minimum([heel_off, toe_off, following, following + flat - strike], clip.frames - 1)
    when = np.linspace(marks[0], marks[3], 3 * SAMPLES)
    stage = stages(np.tile(marks, (len(when), 1)), when)
    pitch = np.unwrap(slope(when) - rest_slope)
    # A foot that never lies flat, as in a sprint, is made to, while it is on the floor.
    pitch -= pitch[0] * (1 - ease(stage)) + pitch[-1] * ease(stage - 2)
    # The canonical foot is short and high: before toe-off it is tilted so as to lift the ankle as
    # the actor's does; where it can't, and in the air, as the actor's is.
    ankle = local("left_foot", when) / leg
    angle = np.linspace(0, np.arctan2(SOLE[2], -SOLE[1]), 200)
    lift = -turned(SOLE, 0 * angle, -angle)[:, 1] + SOLE[1]
    lifting = -np.interp(ankle[:, 1] - ankle[0, 1], lift, angle)
    lifting += ease(2 * stage - 1) * np.minimum(pitch - lifting, 0)
    leave = np.searchsorted(stage, 1)
    fading = (lifting[leave] - pitch[leave]) * (1 - ease(2 * stage - 2))
    pitch = np.where(stage < 1, lifting, pitch + fading)
    fitted["foot_pitch"] = _clamped(stage / 3, pitch)[:, None]
    # ... and the way of the toes through the air, of a foot of canonical proportions that is led
    # by the actor's ankle.
    inside = (stage >= 1) & (stage <= 2)
    swing = stage[inside] - 1
    toes = ankle[inside] + turned(SOLE, 0 * swing, pitch[inside])
    ramp = ease(swing)[:, None]
    bend = toes - toes[0] - ramp * (toes[-1] - toes[0])
    fitted["toes_path"] = np.stack([_clamped(swing, bend[:, axis]) for axis in range(3)], -1)

    middle = (strike + toe_off) / 2
    held = local("left_foot", np.linspace(flat, heel_off, 9)).mean(0)
    below = (held - local("hips", middle)) / leg
    fitted["numbers"] = {
        "period": period / clip.fps / np.sqrt(leg / GRAVITY),
        "flat": (flat - strike) / period,
        "heel_off": (heel_off - strike) / period,
        "toe_off": (toe_off - strike) / period,
        "ahead": below[2],
        "aside": below[0],
    }
    return {
        "speed": speed,
        "froude": speed / np.sqrt(GRAVITY * leg),
        "turn": turn,
        "change": change,
        "clip": clip.name,
        **fitted,
    }


def _clamped(phase: np.ndarray, curve: np.ndarray) -> np.ndarray:
    return np.linalg.lstsq(clamped_basis(phase), curve, rcond=None)[0]


# -- all cycles ---------------------------------------------------------------------------------


def regress(rows: np.ndarray, froude: np.ndarray, power: np.ndarray | float) -> tuple:
    """Mean and slope over speed of each coefficient.

    The clips cover few speeds. Where they say little, the coefficient grows like Froude ** power:
    the prior of the slope.
    """
    centred = froude - froude.mean()
    mean = rows.mean(0)
    prior = power * mean / froude.mean()
    rest = rows - mean - np.multiply.outer(centred, prior)
    return mean, prior + np.tensordot(centred, rest, 1) / ((centred**2).sum() + SLOPE_PRIOR**2)


def mirrored(rows: np.ndarray, name: str) -> np.ndarray:
    """Coefficients (cycles, terms, 3) of the curve seen in a mirror, half a cycle later."""
    signs = [1, -1, -1] if name.endswith("rotation") else [-1, 1, 1]
    shift = np.array([1.0] + [(-1.0) ** k for k in range(1, HARMONICS + 1) for _ in range(2)])
    return rows * np.array(signs) * shift[:, None]


def summarise(gait: str, found: list[dict]) -> dict:
    froude = np.array([cycle["froude"] for cycle in found])
    result: dict = {"froude": [froude.min(), froude.mean(), froude.max()], "cycles": len(found)}
    # Strides grow like speed over stride rate, what swings grows with them, and postures stay.
    growth = 1 - RATE_EXPONENT[gait]
    waves = np.r_[0, np.full(2 * HARMONICS, growth)][:, None]
    curves = {}
    for name in ("pelvis_position", "pelvis_rotation", "chest_rotation", "head_rotation"):
        rows = np.stack([cycle[name] for cycle in found])
        curves[name] = regress((rows + mirrored(rows, name)) / 2, froude, waves)
    for part in ("upper_arm", "lower_arm"):
        left = np.stack([cycle[f"left_{part}"] for cycle in found])
        right = np.stack([cycle[f"right_{part}"] for cycle in found])
        curves[part] = regress((left + mirrored(right, part)) / 2, froude, waves)
    for name in ("foot_pitch", "toes_path"):
        curves[name] = regress(np.stack([cycle[name] for cycle in found]), froude, growth)
    result["curves"] = {
        name: {"mean": mean.round(5).tolist(), "slope": slope.round(5).tolist()}
        for name, (mean, slope) in curves.items()
    }
    result["numbers"] = {}
    for name in found[0]["numbers"]:
        power = DUTY_EXPONENT[gait] if name == "toe_off" else 0
        mean, slope = regress(np.array([cycle["numbers"][name] for cycle in found]), froude, power)
        result["numbers"][name] = {"mean": round(float(mean), 5), "slope": round(float(slope), 5)}
    periods = np.array([cycle["numbers"]["period"] for cycle in found])
    exponent = RATE_EXPONENT[gait]
    scale = np.exp(-np.log(periods) - exponent * np.log(froude)).mean()
    result["rate"] = {"scale": round(float(scale), 4), "exponent": exponent}
    result["froude"] = [round(float(v), 4) for v in result["froude"]]
    return result


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path, help="folder that holds Male1_B3_Walk.bvh and so on")
    home = Path(motionlab.__file__).parent / "datasets" / "gaits.json"
    parser.add_argument("--output", type=Path, default=home)
    options = parser.parse_args()

    plane = floor(options.folder)
    stand, points = standing(options.folder, plane)
    gaits = {}
    for gait, names in (("walk", WALKS), ("run", RUNS)):
        clips = [prepare(options.folder, name, plane, stand, points) for name in names]
        found = [cycle for clip in clips for cycle in cycles(clip, gait)]
        gaits[gait] = summarise(gait, found)
        for cycle in found:
            numbers = " ".join(f"{k} {v:.3f}" for k, v in cycle["numbers"].items())
            print(f"{gait} {cycle['clip']:28} {cycle['speed']:.2f} m/s {numbers}")
        print(gait, gaits[gait]["froude"], gaits[gait]["rate"], gaits[gait]["numbers"])
    arms = {}
    for part, child in (("upper_arm", "lower_arm"), ("lower_arm", "hand")):
        left, right = (points[f"{s}_{child}"] - points[f"{s}_{part}"] for s in ("left", "right"))
        mean = (left + right * MIRROR) / 2
        arms[part] = (mean / np.linalg.norm(mean)).round(5).tolist()
    document = {
        "source": "Fitted by experiments/data/fit_gaits.py to motion capture of one actor (Male1) "
        "by ACCAD Motion Lab, The Ohio State University",
        "licence": "CC BY 3.0",
        "clips": sorted({*STAND, *WALKS, *RUNS}),
        "units": "leg lengths (thigh + shank), radians, Froude speed v / sqrt(g leg)",
        "stand": arms,
        **gaits,
    }
    options.output.write_text(json.dumps(document, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
