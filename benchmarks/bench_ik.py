"""Position inverse kinematics: `solve` for all frames at once against a loop over frames.

    python benchmarks/bench_ik.py [--frames 2000] [--loop 20] [--rounds 3] [--threads 1] [--save]

The loops are timed on the first few frames only and scaled up. Targets are the points of a walking
gait, as they are and with 5 mm of noise; SciPy solves the same least-squares problem.
"""

from __future__ import annotations

from dataclasses import dataclass

import roma
import torch
import tyro
from interleaved import medians, save, table
from scipy.optimize import least_squares

from motionlab import Skeleton, forward_kinematics
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
    if options.save:
        save("bench_ik", numbers)


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
