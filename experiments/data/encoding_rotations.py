"""Which numbers for joint rotations? Four ways to write them, measured on real clips.

    python -m experiments.data.encoding_rotations

Fitted on the training split of `locomotion`, judged on its validation split; the test split is not
touched. Writes results/encoding_rotations.json. About a minute once `locomotion` is cached.

The rule, fixed before the first run: an encoding in which a joint jumps (see `jumps`) more than once
in a million joint frames is out. Of the others the one with the smallest error of points one step
ahead is the default; if errors are within 2 % of the smallest, the one with the fewest numbers a
frame, and of equally many the one with the smaller error under noise.

Added after the first run, and no part of the rule: `same_inputs_error_cm`, the error one step ahead
where all encodings are predicted from the numbers of all four. More numbers are more to regress on,
which a network with hidden layers makes for itself; here only what is predicted differs.
"""

from __future__ import annotations

import json
import platform
import time
from collections.abc import Callable
from pathlib import Path

import roma
import torch
from torch import Tensor

import motionlab
from motionlab import Motion, Skeleton, datasets
from motionlab.datasets import registry, splits
from motionlab.encodings import JointAngles, Normalizer

TARGET = Path(__file__).parents[2] / "results" / "encoding_rotations.json"
NOISE = 0.05  # of the RNN-GAN paper, in units of the standard deviation
RIDGE = 1e-3  # times the number of rows
JUMP_RATIO, JUMP_LEAST = 5.0, 0.5

Splits = tuple[list[Tensor], list[Tensor]]  # clips to fit on, clips to judge by


def main() -> None:
    begin = time.perf_counter()
    torch.manual_seed(0)
    skeleton = Skeleton.canonical()
    rest = torch.eye(3).repeat(skeleton.joints, 1, 1)
    encodings = {
        "vector, mean pose": JointAngles(skeleton),
        "vector, rest pose": JointAngles(skeleton, mean_pose=rest),
        "euler": JointAngles(skeleton, rotation="euler"),
        "6d": JointAngles(skeleton, rotation="6d"),
    }
    training = datasets.load("locomotion", "train")
    validation = datasets.load("locomotion", "val")
    rows, normal, decoders = {}, {}, {}
    for name, encoding in encodings.items():
        train, val = ([encoding.encode(m) for m in motions] for motions in (training, validation))
        normalizer = Normalizer.fit(train)
        rows[name] = {
            "numbers": encoding.dim,
            **jumps(encoding, val, validation),
            **distances(encoding, val, validation),
            "noise_error_cm": noise_error(encoding, normalizer, val),
        }
        normal[name] = tuple([normalizer(f) for f in clips] for clips in (train, val))
        decode = lambda f, e=encoding, n=normalizer: e.positions(n.inverse(f.float()))
        rows[name]["step_error_cm"] = step_error(decode, normal[name], normal[name])
        decoders[name] = decode
    everything = tuple(
        [torch.cat(clip, dim=1) for clip in zip(*clips, strict=True)]
        for clips in zip(*normal.values(), strict=True)
    )
    for name, decode in decoders.items():
        rows[name]["same_inputs_error_cm"] = step_error(decode, everything, normal[name])
    for name, row in rows.items():
        print(f"{name:<18}", *(f"{key} {value:.4g}" for key, value in row.items()), sep="  ")
    clips = registry.members("locomotion")
    record = {
        "command": "python -m experiments.data.encoding_rotations",
        "code_version": motionlab.__version__,
        "data_hash": splits.digest((c.source, c.where, c.split) for c in clips),
        "rule": __doc__.split("\n\n")[3].replace("\n", " ").strip(),
        "rule_gives": choose(rows),
        "encodings": rows,
        "training": {"clips": len(training), "frames": sum(map(len, training))},
        "validation": {"clips": len(validation), "frames": sum(map(len, validation))},
        "settings": {"noise": NOISE, "ridge": RIDGE, "jump": [JUMP_RATIO, JUMP_LEAST], "seed": 0},
        "torch": torch.__version__,
        "machine": platform.machine(),
        "seconds": round(time.perf_counter() - begin, 1),
    }
    TARGET.parent.mkdir(exist_ok=True)
    TARGET.write_text(json.dumps(record, indent=1) + "\n", encoding="utf-8")
    print(f"the rule gives: {record['rule_gives']}")


def choose(rows: dict[str, dict]) -> str:
    """The rule of the first lines."""
    steady = {n: r for n, r in rows.items() if r["jumps_per_million"] <= 1}
    least = min(row["step_error_cm"] for row in steady.values())
    close = {n: r for n, r in steady.items() if r["step_error_cm"] <= 1.02 * least}
    return min(close, key=lambda n: (close[n]["numbers"], close[n]["noise_error_cm"]))


def jumps(encoding: JointAngles, features: list[Tensor], motions: list[Motion]) -> dict:
    """How often a joint's numbers leap though the joint does not.

    A leap is a step of the numbers more than `JUMP_RATIO` times as long as the angle between the two
    rotations, in units of the median of this ratio, and longer than `JUMP_LEAST` (radians).
    """
    steps = torch.cat([joints(encoding, f).diff(dim=0).norm(dim=-1) for f in features])
    angles = torch.cat([turn(m.rotations[:-1, 1:], m.rotations[1:, 1:]) for m in motions])
    moving = angles > 0.01
    unit = (steps[moving] / angles[moving]).median()
    leaps = (steps / unit > JUMP_RATIO * angles) & (steps / unit > JUMP_LEAST)
    return {
        "jumps": int(leaps.sum()),
        "jumps_per_million": 1e6 * float(leaps.double().mean()),
        "largest_step": float((steps / unit).max()),
    }


def distances(encoding: JointAngles, features: list[Tensor], motions: list[Motion]) -> dict:
    """How faithful distances are: length of the difference of two poses' numbers over the angle
    between them, for each joint in 20 000 random pairs of frames. 1 is the median."""
    numbers = torch.cat([joints(encoding, f) for f in features])
    rotations = torch.cat([motion.rotations[:, 1:] for motion in motions])
    a, b = torch.randint(len(numbers), (2, 20_000))
    apart = turn(rotations[a], rotations[b])
    ratio = ((numbers[a] - numbers[b]).norm(dim=-1) / apart)[apart > 0.05]
    ratio = ratio / ratio.median()
    keys = ("distance_p1", "distance_p99", "distance_spread")
    low, high = (ratio.kthvalue(max(1, int(q * len(ratio)))).values for q in (0.01, 0.99))
    return dict(zip(keys, (float(low), float(high), float(high / low)), strict=True))


def step_error(decode: Callable, inputs: Splits, features: Splits) -> float:
    """Mean distance in cm of points one frame ahead, by ridge regression of the step of normalised
    features on the inputs of two frames; the frame before is where it was."""
    past, steps = lagged(inputs[0]), differences(features[0])
    gram = past.T @ past + RIDGE * len(past) * torch.eye(past.shape[1]).double()
    weights = torch.linalg.solve(gram, past.T @ steps)
    now = torch.cat([clip[1:-1] for clip in features[1]]).double()
    pair = lambda step: torch.stack([now, now + step], dim=1)
    found, truth = pair(lagged(inputs[1]) @ weights), pair(differences(features[1]))
    return 100 * float((decode(found) - decode(truth))[:, 1].norm(dim=-1).mean())


def lagged(clips: list[Tensor]) -> Tensor:
    """Rows ``[x_t, x_t-1, 1]`` in float64."""
    rows = [torch.cat([c[1:-1], c[:-2], torch.ones(len(c) - 2, 1)], dim=1) for c in clips]
    return torch.cat(rows).double()


def differences(clips: list[Tensor]) -> Tensor:
    """Rows ``x_t+1 - x_t`` to those of `lagged`, in float64."""
    return torch.cat([c[2:] - c[1:-1] for c in clips]).double()


def noise_error(encoding: JointAngles, normalizer: Normalizer, val: list[Tensor]) -> float:
    """Mean distance in cm between points of a pose and of the pose with noise on its features."""
    features = torch.cat(val)
    normal = normalizer(features)
    noisy = normalizer.inverse(normal + NOISE * torch.randn(normal.shape))
    # one frame a sequence: noise does not add up along the path
    found, truth = (encoding.positions(f[:, None])[:, 0] for f in (noisy, features))
    return 100 * float((found - truth).norm(dim=-1).mean())


def joints(encoding: JointAngles, features: Tensor) -> Tensor:
    """Numbers of each joint (frames, joints, 3 or 6)."""
    return features[:, encoding.slices["pose"]].unflatten(1, (encoding.skeleton.joints - 1, -1))


def turn(a: Tensor, b: Tensor) -> Tensor:
    """Angle in radians between rotations (..., 3, 3)."""
    return roma.rotmat_geodesic_distance(a.double(), b.double()).float()


if __name__ == "__main__":
    main()
