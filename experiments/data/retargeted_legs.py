"""What retargeting does to legs, clip by clip: writes results/retargeted_legs.json.

    MOTIONLAB_DATA=folder python -m experiments.data.retargeted_legs [--output FILE] [--sources NAME ...]

Every clip of `SOURCES` is resampled to 30 frames per second and brought to `Skeleton.canonical`;
joints are found by their roles, everything is measured on positions of joints, before and after.
Each foot and knee counts by itself, a clip as its worse one. Targets, and who misses them:

* **foot direction**: degrees between the way from ankle to toes before and after. Target: a foot's
  median over the clip at most `FOOT`. Said besides: the 95 % quantile of its frames, and the same
  two *from the actor's own flat foot*, where what lies between a flat foot of theirs and of ours, the
  median over all their clips, is taken out: the ankle of one rig stands higher above its toes than
  that of another. Flat is a foot whose heel and toes retargeting holds.
* **stance knee**: what the knee's median over the frames with a heel in contact has changed by.
  Target: at most `STANCE` degrees; of feet with `ENOUGH` such frames. Said besides: the mean change
  of single frames in contact.
* **jumps**: how much more than in the source a knee turns from one frame to the next, the most of
  all frames. Target: at most `JUMP` degrees. Said besides: the same of the clip's largest steps
  wherever they are, which a jump that is a frame early or late does not change.
* **acceleration**: root mean square of a knee's second difference over the source's. Target: at most
  `ACCELERATION`; a source's of less than `CALM` degrees a frame² counts as that.
* **backwards**: the least angle of a knee. Target: none below `BACKWARDS` degrees.

Feet and hips must not pay for it, so these stand beside: how far a held joint moves in a frame, how
fast held feet slide, how deep a point lies below the floor, how much is held, and the acceleration
of the hips, in lengths of a leg, over the source's.
"""

from __future__ import annotations

import argparse
import math
import time
from collections import defaultdict
from collections.abc import Iterator

import torch
from torch import Tensor
from tqdm import tqdm

import motionlab
from motionlab import Motion, Skeleton, datasets
from motionlab.contacts import foot_points
from motionlab.datasets import loader, splits
from motionlab.datasets.registry import choose
from motionlab.metrics import feet
from motionlab.retargeting.stance import stances
from motionlab.roles import SIDES

from ..common import record

SOURCES = ("cmu", "accad", "aclstm-cmu", "cmu-amc", "bandai-actions", "bandai-locomotion")
SOURCES += ("o3de-motionmatching", "virvig-jl")
FPS = 30.0
FOOT, STANCE, JUMP, ACCELERATION, BACKWARDS = (
    45.0,
    5.0,
    5.0,
    1.2,
    -3.0,
)  # what a person would not notice
ENOUGH, CALM = 5, 0.05
LEAST = 3  # frames; fewer have no acceleration: the T-pose of virvig-jl
# measure: whether a value misses its target
TARGETS = {
    "foot direction, median (deg)": lambda value: value > FOOT,
    "stance knee, change of median (deg)": lambda value: abs(value) > STANCE,
    "knee jump beyond source's (deg)": lambda value: value > JUMP,
    "knee acceleration over source's": lambda value: value > ACCELERATION,
    "least knee (deg)": lambda value: value < BACKWARDS,
}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--output", default="results/retargeted_legs.json")
    parser.add_argument("--sources", nargs="+", default=SOURCES, choices=SOURCES)
    args = parser.parse_args()
    torch.set_num_threads(1)  # a clip is too small to share
    begin = time.perf_counter()
    rows = [(c.source, c.where, c.split) for name in args.sources for c in choose(name)]
    found = {name: measured(name) for name in args.sources}
    record.write(
        {
            "command": " ".join(record.command()),
            "code_version": motionlab.__version__,
            "data_hash": splits.digest(rows),
            "fps": FPS,
            "sources": {name: summary(clips) for name, clips in found.items()},
            "clips": {name: columns(clips) for name, clips in found.items()},
            "torch": torch.__version__,
            "seconds": round(time.perf_counter() - begin, 1),
        },
        args.output,
    )


def measured(source: str) -> dict[str, dict[str, float]]:
    """Every clip of a source by its name, and what was measured of it."""
    pairs = list(retargeted(source))
    actors: dict[bytes, list[tuple[Motion, Motion]]] = defaultdict(list)
    for before, after in pairs:
        actors[before.skeleton.offsets.numpy().tobytes()].append((before, after))
    flat = {bones: flat_foot(its) for bones, its in actors.items()}
    return {
        before.name: of_clip(before, after, flat[bones])
        for bones, its in actors.items()
        for before, after in its
    }


def retargeted(source: str) -> Iterator[tuple[Motion, Motion]]:
    """Every clip before and after, as `locomotion` and a folder of such clips would bring it."""
    motions = [motion.resample(FPS) for motion in datasets.load(source)]
    motions = [motion for motion in motions if len(motion) >= LEAST]
    stance = loader.stance(source)
    references = [stance] * len(motions)
    if stance is None:
        references = stances(motions, Skeleton.canonical()).references
    pairs = zip(motions, references, strict=True)
    for motion, reference in tqdm(pairs, source, len(motions), leave=False, disable=None):
        yield motion, motion.retarget(reference=reference)


# -- one clip -------------------------------------------------------------------------------------


def legs(motion: Motion) -> dict[str, Tensor]:
    """Ways of both feet (frames, 2, 3), angles of both knees (frames, 2) in degrees, negative where
    they bend backwards, and the hips' place (frames, 3) in lengths of a leg.

    Backwards is against the side to which the knee bends in the clip as a whole, as seen from the
    thigh, so that it does not matter how a rig draws its axes.
    """
    points, world, roles = motion.positions(), motion.orientations(), motion.skeleton.roles
    found: dict[str, list[Tensor]] = defaultdict(list)
    for side in SIDES:
        hip, knee, ankle = (roles[f"{side}_{part}"] for part in ("upper_leg", "lower_leg", "foot"))
        thigh, shank = points[:, knee] - points[:, hip], points[:, ankle] - points[:, knee]
        cross = torch.linalg.cross(thigh, shank)
        axis = (world[:, hip].mT @ cross[..., None])[..., 0]
        angle = torch.atan2(cross.norm(dim=-1), (thigh * shank).sum(-1))
        forwards = axis @ axis.mean(0) >= 0
        found["knee"].append(torch.rad2deg(torch.where(forwards, angle, -angle)))
        found["foot"].append(points[:, _toes(motion.skeleton, side)] - points[:, ankle])
        found["hips"].append(points[:, hip])
        found["leg"].append(thigh.norm(dim=-1) + shank.norm(dim=-1))
    found = {part: torch.stack(both, 1) for part, both in found.items()}
    return found | {"hips": found["hips"].mean(1) / found["leg"].median()}


def _toes(skeleton: Skeleton, side: str) -> int:
    """The point a foot ends in: its toes, or the foot's end site."""
    foot, toes = (skeleton.roles.get(f"{side}_{part}") for part in ("foot", "toes"))
    return skeleton.joints + skeleton.end_parents.index(foot) if toes is None else toes


def flat_foot(pairs: list[tuple[Motion, Motion]]) -> float:
    """Degrees by which an actor's flat feet point farther down than ours, median of all clips."""
    lower = []
    for before, after in pairs:
        flat = after.contacts.reshape(-1, 2, 2).all(-1)
        down = [_down(legs(motion)["foot"])[flat] for motion in (before, after)]
        lower.append(down[0] - down[1])
    return float(torch.cat(lower).median()) if any(map(len, lower)) else math.nan


def _down(ways: Tensor) -> Tensor:
    """Degrees (...,) by which ways (..., 3) point below the horizontal."""
    return torch.rad2deg(torch.atan2(-ways[..., 1], ways[..., [0, 2]].norm(dim=-1)))


def of_clip(before: Motion, after: Motion, flat: float) -> dict[str, float]:
    """What was measured of one clip; of both feet the worse."""
    source, result = legs(before), legs(after)
    ways = {"": source["foot"], " from own flat": _raised(source["foot"], flat)}
    off = {name: _between(way, result["foot"]) for name, way in ways.items()}
    heels, touch = after.contacts[:, [0, 2]], after.contacts.reshape(-1, 2, 2).any(-1)
    change = result["knee"] - source["knee"]
    medians = [
        float(result["knee"][heel, i].median() - source["knee"][heel, i].median())
        for i, heel in enumerate(heels.T)
        if heel.sum() >= ENOUGH
    ]
    steps = [its["knee"].diff(dim=0).abs() for its in (source, result)]
    knees, hips = (
        [_acceleration(its[part]) for its in (source, result)] for part in ("knee", "hips")
    )
    return {
        "frames": len(before),
        **{f"foot direction{name}, median (deg)": _worst(each, 0.5) for name, each in off.items()},
        **{f"foot direction{name}, 95 % (deg)": _worst(each, 0.95) for name, each in off.items()},
        "stance knee, change of median (deg)": max(medians, key=abs, default=math.nan),
        "stance knee, mean change (deg)": float(change[touch].abs().mean()),
        "knee jump beyond source's (deg)": float((steps[1] - steps[0]).max()),
        "largest knee jump beyond source's (deg)": float(steps[1].max() - steps[0].max()),
        "knee acceleration over source's": max(knees[1], CALM) / max(knees[0], CALM),
        "least knee (deg)": float(result["knee"].min()),
        "hips acceleration over source's": hips[1] / hips[0],
        **_planted(after),
    }


def _planted(motion: Motion) -> dict[str, float]:
    """What is held, and the floor."""
    points, contacts = motion.positions(), motion.contacts
    step = points[:, foot_points(motion.skeleton)].diff(dim=0).norm(dim=-1)
    held = step[contacts[1:] & contacts[:-1]]
    return {
        "held joint's largest step (cm)": 100 * float(held.max()) if len(held) else 0.0,
        "skate (cm/s)": float(feet.foot_skate(points, contacts, motion.skeleton, FPS)),
        "penetration (cm)": float(feet.penetration(points, motion.skeleton).max()),
        "contact share": float(contacts.float().mean()),
    }


def _acceleration(values: Tensor) -> float:
    """Root mean square of the second differences of values (frames, ...)."""
    return float(values.diff(n=2, dim=0).square().mean().sqrt())


def _worst(degrees: Tensor, share: float) -> float:
    """Quantile over frames of angles (frames, 2), of the worse foot."""
    return float(degrees.quantile(share, dim=0).max())


def _between(a: Tensor, b: Tensor) -> Tensor:
    """Degrees (...,) between ways (..., 3)."""
    return torch.rad2deg(torch.atan2(torch.linalg.cross(a, b).norm(dim=-1), (a * b).sum(-1)))


def _raised(ways: Tensor, degrees: float) -> Tensor:
    """Ways (..., 3) of feet that point so much less far down: turned upwards where they point."""
    level = ways[..., [0, 2]].norm(dim=-1).clamp(min=1e-6)
    height = torch.deg2rad(degrees - _down(ways))
    length = ways.norm(dim=-1)
    out = (length * height.cos() / level)[..., None] * ways
    out[..., 1] = length * height.sin()
    return out


# -- a source -------------------------------------------------------------------------------------


def columns(clips: dict[str, dict[str, float]]) -> dict[str, list]:
    """The names of clips, and each measure of them in the same order; a third as long as a table a clip."""
    measures = next(iter(clips.values()))
    return {
        "name": list(clips),
        **{measure: [row[measure] for row in clips.values()] for measure in measures},
    }


def summary(clips: dict[str, dict[str, float]]) -> dict:
    """Medians and worst values over clips, and the names of those that miss each target."""
    finite = lambda measure: torch.tensor(
        [float(row[measure]) for row in clips.values() if math.isfinite(row[measure])]
    )
    over = {}
    for measure in next(iter(clips.values())):
        values = finite(measure)
        over[measure] = {
            "median": float(values.median()),
            "90 %": float(values.quantile(0.9)),
            "least": float(values.min()),
            "most": float(values.max()),
        }
    return {
        "clips": len(clips),
        "minutes": sum(row["frames"] for row in clips.values()) / FPS / 60,
        "miss": {
            measure: sorted(name for name, row in clips.items() if misses(row[measure]))
            for measure, misses in TARGETS.items()
        },
        "over clips": over,
    }


if __name__ == "__main__":
    record.run(main)
