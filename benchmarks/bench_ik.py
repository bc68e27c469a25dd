"""Position inverse kinematics: `solve` for all frames at once against a loop over frames.

Then what joints cost: a rig of 101 against one of 31, with exact and with noisy targets.

    python benchmarks/bench_ik.py [--frames 2000] [--loop 20] [--rounds 3] [--threads 1] [--save]

The loops are timed on the first few frames only and scaled up. Targets are the points of a walking
gait, as they are and with 5 mm of noise; SciPy solves the same least-squares problem.
"""

from __future__ import annotations

from dataclasses import dataclass

import roma
import torch
import tyro
from interleaved import medians, save, table, verdict
from scipy.optimize import least_squares

from motionlab import Motion, Skeleton, forward_kinematics
from motionlab.datasets import gaits
from motionlab.ik import solve

CANONICAL = Skeleton.canonical()


@dataclass
class Options:
    frames: int = 2000
    loop: int = 20
    rounds: int = 3
    threads: int = 1
    save: bool = False


def main(options: Options) -> None:
    torch.set_num_threads(options.threads)
    seconds = options.frames / 30
    walk = gaits.make(speed=1.3, seconds=seconds, fps=30)
    draw = torch.randn(walk.positions().shape, generator=torch.Generator().manual_seed(0))
    numbers = {}
    for label, noise in (("exact", 0.0), ("noisy", 0.005)):
        targets = walk.positions() + noise * draw
        few = targets[: options.loop]
        times = medians(
            {
                "solve": lambda t=targets: solve(CANONICAL, t, limits="human"),
                "loop": lambda t=few: [solve(CANONICAL, f[None], limits="human") for f in t],
                "scipy": lambda t=few: [by_scipy(f) for f in t[:3]],
            },
            options.rounds,
        )
        rates = {
            "solve": len(targets) / times["solve"],
            "loop": len(few) / times["loop"],
            "scipy": 3 / times["scipy"],
        }
        rows = [(name, f"{rate:.1f}", "frames/s") for name, rate in rates.items()]
        rows += [
            (f"  solve / {n}", f"{rates['solve'] / rates[n]:.0f} x", "") for n in ("loop", "scipy")
        ]
        table(f"{label} targets, {len(targets)} frames, {options.threads} thread(s)", rows)
        numbers[label] = {"frames_per_second": rates}
    numbers["joints"] = cost_of_joints(walk, options.rounds)
    if options.save:
        save("bench_ik", numbers)


def cost_of_joints(walk: Motion, rounds: int) -> dict[str, float]:
    """How many times longer 101 joints take than 31."""
    rigs = [with_fingers(walk, joints) for joints in (31, 101)]
    chance, found = torch.Generator().manual_seed(0), {}
    for label, noise in (("exact", 0.0), ("noisy", 0.005)):
        jobs = {}
        for rig in rigs:
            points = rig.positions()
            targets = points + noise * torch.randn(points.shape, generator=chance)
            jobs[f"{rig.skeleton.joints}"] = lambda s=rig.skeleton, t=targets: solve(s, t)
        times = medians(jobs, rounds)
        found[label] = times["101"] / times["31"]
    table(
        "101 joints / 31 joints",
        [(name, f"{ratio:.1f} x", verdict(ratio, 5.0)) for name, ratio in found.items()],
    )
    return found


def with_fingers(motion: Motion, joints: int) -> Motion:
    """The motion on a rig with chains of three more joints on its hands and head, which bend."""
    s = motion.skeleton
    names, parents, offsets = list(s.names), list(s.parents), list(s.offsets)
    hosts = [s.role(role) for role in ("left_hand", "right_hand", "head")]
    chance = torch.Generator().manual_seed(0)
    for new in range(s.joints, joints):
        chain, knuckle = divmod(new - s.joints, 3)
        names.append(f"Finger{chain}_{knuckle}")
        parents.append(new - 1 if knuckle else hosts[chain % 3])
        offsets.append(0.05 * torch.randn(3, generator=chance))
    rig = Skeleton(tuple(names), tuple(parents), torch.stack(offsets), s.end_parents, s.end_offsets)
    bends = 0.3 * torch.randn(1, joints - s.joints, 3, generator=chance)
    bends = bends * torch.sin(torch.arange(len(motion)) / 10)[:, None, None]
    turns = torch.cat([motion.rotations, roma.rotvec_to_rotmat(bends)], 1)
    return Motion(rig, motion.root_positions, turns, motion.fps)


def by_scipy(target: torch.Tensor) -> torch.Tensor:
    """One frame from the rest pose by SciPy's trust region with numeric derivatives."""

    def residuals(x):
        x = torch.from_numpy(x)
        turns = roma.rotvec_to_rotmat(x[3:].reshape(-1, 3))
        s = CANONICAL
        places, _ = forward_kinematics(
            s.parents, s.offsets, x[:3], turns, s.end_parents, s.end_offsets
        )
        return (places - target.double()).flatten().numpy()

    first = torch.zeros(3 + 3 * CANONICAL.joints, dtype=torch.float64)
    first[:3] = target[0]
    return least_squares(residuals, first.numpy(), max_nfev=50).x


if __name__ == "__main__":
    main(tyro.cli(Options, description=__doc__))
