"""What is in the data set "locomotion", and what retargeting did to it: results/locomotion.json.

    MOTIONLAB_DATA=folder python -m experiments.data.locomotion_table

Errors are distances in centimetres between an end of the body and where the scaled source has it:
hands relative to their shoulder, scaled by the ratio of the arms' lengths; ankles and toe joints
relative to the middle of the hip joints, scaled by that of the legs' (the height scaling of the
whole motion). `error_cm` pools these. Beside them stand ankles relative to their own hip joint,
which also tells how much narrower the canonical pelvis is, and hands and head relative to the hips
at the scale of the legs, where the proportions of trunk, shoulders and arms count as errors too.

Foot sliding is measured before (the source scaled as the legs are) and after on the same labels:
those held still by retargeting, and those that the speed rule finds on the source alone.
"""

from __future__ import annotations

import hashlib
import json
import platform
import time
from collections import defaultdict
from collections.abc import Callable, Iterable
from pathlib import Path

import numpy as np
import torch
from tqdm import tqdm

import motionlab
from motionlab import Motion, contacts, datasets
from motionlab.datasets import registry
from motionlab.metrics import feet, gait
from motionlab.roles import SIDES
from motionlab.skeleton import Skeleton

RESULT = Path(__file__).parents[2] / "results/locomotion.json"
LIMBS = {"hand": ("upper_arm", "lower_arm", "hand"), "foot": ("upper_leg", "lower_leg", "foot")}


def limb_length(skeleton: Skeleton, parts: tuple[str, ...]) -> float:
    points, roles = skeleton.rest_points, skeleton.roles
    total = 0.0
    for side in SIDES:
        a, b, c = (points[roles[f"{side}_{part}"]] for part in parts)
        total += float((b - a).norm() + (c - b).norm()) / len(SIDES)
    return total


def errors(source: Motion, result: Motion) -> dict[str, torch.Tensor]:
    """Centimetres (frames, 2) or (frames, 1) by what is measured."""
    before, after = source.positions(), result.positions()
    theirs, ours = source.skeleton.roles, result.skeleton.roles
    ratio = {
        end: limb_length(result.skeleton, parts) / limb_length(source.skeleton, parts)
        for end, parts in LIMBS.items()
    }

    def compare(scale: float, start: Callable[[str], list[str]], ends: list[str]) -> torch.Tensor:
        apart = []
        for end in ends:
            at = [
                p[:, r[end]] - torch.stack([p[:, r[name]] for name in start(end)]).mean(0)
                for p, r in ((before, theirs), (after, ours))
            ]
            apart.append(100 * (scale * at[0] - at[1]).norm(dim=-1))
        return torch.stack(apart, -1)

    pair = lambda part: [f"{side}_{part}" for side in SIDES]
    found = {
        end: compare(ratio[end], lambda e, s=parts[0]: [f"{e.split('_')[0]}_{s}"], pair(end))
        for end, parts in LIMBS.items()
    }
    middle = lambda _: pair("upper_leg")
    for end in ("hand", "foot", "toes"):
        found[f"{end}_from_hips"] = compare(ratio["foot"], middle, pair(end))
    found["head_from_hips"] = compare(ratio["foot"], middle, ["head"])
    return found


def knee_bend(motion: Motion) -> torch.Tensor:
    """Degrees (frames, 2), negative if backwards."""
    points, world, roles = motion.positions(), motion.orientations(), motion.skeleton.roles
    bends = []
    for side in SIDES:
        hip, knee, foot = (roles[f"{side}_{part}"] for part in LIMBS["foot"])
        thigh, shank = points[:, knee] - points[:, hip], points[:, foot] - points[:, knee]
        sine = (torch.linalg.cross(thigh, shank) * world[:, hip, :, 0]).sum(-1)
        bends.append(torch.rad2deg(torch.atan2(sine, (thigh * shank).sum(-1))))
    return torch.stack(bends, -1)


def compare(source: Motion, result: Motion) -> dict[str, float | torch.Tensor]:
    """One clip before and after."""
    source = source.resample(result.fps)
    scale = limb_length(result.skeleton, LIMBS["foot"]) / limb_length(
        source.skeleton, LIMBS["foot"]
    )
    before, after = scale * source.positions(), result.positions()
    skate = lambda points, labels, skeleton: float(
        feet.foot_skate(points, labels, skeleton, result.fps)
    )
    rule = contacts.label_positions(before, source.skeleton, result.fps)
    heights = after[:, contacts.foot_points(result.skeleton), 1]
    return {
        "errors": errors(source, result),
        "knee": float(knee_bend(result).min()),
        "skate": [
            skate(before, result.contacts, source.skeleton),
            skate(after, result.contacts, result.skeleton),
            skate(before, rule, source.skeleton),
            skate(after, rule, result.skeleton),
        ],
        "held": [int(result.contacts.sum()), int(rule.sum())],
        "penetration": float(feet.penetration(after, result.skeleton).max()),
        "lowest_toe": float(100 * heights[:, [1, 3]].min()),
        "stance_heights": 100 * heights[:, :2][result.contacts[:, :2].all(-1)],
        "scale": scale,
    }


def summary(rows: list[dict]) -> dict:
    """What retargeting did, over the clips of one source."""
    errors = {
        name: torch.cat([row["errors"][name].flatten() for row in rows])
        for name in rows[0]["errors"]
    }
    ends = torch.cat([errors[name] for name in ("hand", "foot_from_hips", "toes_from_hips")])
    flat = torch.cat([row["stance_heights"] for row in rows])
    held = np.array([row["held"] for row in rows], float)
    skate = np.array([row["skate"] for row in rows], float)
    mean = lambda i, weight: float(np.nansum(skate[:, i] * weight) / weight[skate[:, i] >= 0].sum())
    return {
        "scale": [min(r["scale"] for r in rows), max(r["scale"] for r in rows)],
        "error_cm": {"median": float(ends.median()), "95%": quantile(ends, 0.95)},
        "error_cm_by_end": {
            name: {"median": float(e.median()), "95%": quantile(e, 0.95)}
            for name, e in errors.items()
        },
        "least_knee_bend_deg": min(row["knee"] for row in rows),
        "skate_cm_s": {
            "held": {"before": mean(0, held[:, 0]), "after": mean(1, held[:, 0])},
            "speed_rule": {"before": mean(2, held[:, 1]), "after": mean(3, held[:, 1])},
        },
        "deepest_penetration_cm": max(row["penetration"] for row in rows),
        "lowest_toe_joint_cm": min(row["lowest_toe"] for row in rows),
        "flat_foot_heights_cm": flat.mean(0).tolist(),
        "clips_that_slide_more": sum(row["skate"][3] > row["skate"][2] + 0.5 for row in rows),
    }


def quantile(values: torch.Tensor, q: float) -> float:
    return float(np.quantile(values.numpy(), q))


def describe(motions: Iterable[Motion]) -> dict[str, float]:
    """Row of the table: how much, how fast, how it turns, how much contact."""
    motions = list(motions)
    points = [motion.positions() for motion in motions]
    speed = torch.cat([gait.speed(p, m.fps) for p, m in zip(points, motions, strict=True)])
    turn = torch.cat(
        [gait.turn_rate(p, m.skeleton, m.fps) for p, m in zip(points, motions, strict=True)]
    )
    share = torch.cat([motion.contacts for motion in motions]).float().mean(0)
    return {
        "clips": len(motions),
        "minutes": sum(motion.seconds for motion in motions) / 60,
        "speed_m_s": {"mean": float(speed.mean()), "sd": float(speed.std())},
        "turn_rate_rad_s": {
            "mean": float(turn.mean()),
            "mean_size": float(turn.abs().mean()),
            "95%_size": quantile(turn.abs(), 0.95),
        },
        "contact_share": {"heel": float(share[[0, 2]].mean()), "toe": float(share[[1, 3]].mean())},
    }


def main() -> None:
    begin = time.perf_counter()
    torch.set_num_threads(1)  # clips are too small to share
    clips = registry.members("locomotion")
    motions = dict(zip(clips, datasets.load("locomotion"), strict=True))
    groups: dict[tuple[str, str, str], list[Motion]] = defaultdict(list)
    for clip, motion in motions.items():
        groups[clip.source, clip.action, clip.style].append(motion)
    table = [
        {"source": source, "action": action, "style": style, **describe(members)}
        for (source, action, style), members in sorted(groups.items())
    ]
    sources = {}
    for name in sorted({clip.source for clip in clips}):
        members = [clip for clip in clips if clip.source == name]
        raw = datasets.load(name, clips=[clip.name for clip in members])
        rows = [
            compare(before, motions[clip])
            for clip, before in tqdm(list(zip(members, raw, strict=True)), desc=name, leave=False)
        ]
        sources[name] = {
            "licence": members[0].licence,
            "commercial": members[0].commercial,
            **describe(motions[clip] for clip in members),
            **summary(rows),
        }
        print(name, json.dumps(sources[name], indent=1))
    facts = "\n".join(f"{clip.source} {clip.where} {clip.sha256} {clip.split}" for clip in clips)
    record = {
        "command": "python -m experiments.data.locomotion_table",
        "code_version": motionlab.__version__,
        "data_hash": hashlib.sha256(facts.encode()).hexdigest(),
        "machine": platform.platform(),
        "seconds": round(time.perf_counter() - begin, 1),
        "all": describe(motions.values()),
        "sources": sources,
        "table": table,
    }
    RESULT.parent.mkdir(exist_ok=True)
    RESULT.write_text(json.dumps(rounded(record), indent=1) + "\n", encoding="utf-8")


def rounded(value):
    """Numbers to four digits, which is more than they mean."""
    if isinstance(value, dict):
        return {key: rounded(inner) for key, inner in value.items()}
    if isinstance(value, list):
        return [rounded(inner) for inner in value]
    return float(f"{value:.4g}") if isinstance(value, float) else value


if __name__ == "__main__":
    main()
