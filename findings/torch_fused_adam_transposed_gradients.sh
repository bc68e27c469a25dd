#!/usr/bin/env bash
# Adam in one walk (fused=True) steps wrongly on a processor where a gradient lies transposed in memory.
#
# torch 2.13.0 (CPU build), Python 3.11. Seen November 2026.
#
# torch.optim.Adam(..., fused=True) reads a gradient in the order in which it lies in memory, not in its
# own order. Where the two differ, as for a gradient that came out of a transposed product, numbers get
# other numbers' steps. Nothing is said. A training still goes down, only worse: here a linear layer learns
# a map; the loss after 300 steps is printed. Without fused, and with gradients made contiguous, all is well.
# Who trains on a processor: leave fused out, or make gradients contiguous.
#
# Guessed before it was run: fused differs by rounding only. (A network of ours that learned a third as well
# as before it was switched on led here.)
#
# Exit 0: as described. Exit 1: it changed. Needs python3.11 and a network for the packages.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
python3.11 -m venv venv
venv/bin/pip install --quiet torch==2.13.0 numpy==2.4.0

cat >step.py <<'PY'
import torch

LIES = {
    "in its own order": lambda slope: slope.contiguous(),
    "transposed": lambda slope: slope.t().contiguous().t(),
}


def learned(fused, lies):
    """Loss after 300 steps of a layer that learns a map of 8 numbers to 8."""
    random = torch.Generator().manual_seed(0)
    seen, wanted = torch.randn(64, 8, generator=random), torch.randn(8, 8, generator=random)
    weight = torch.nn.Parameter(torch.zeros(8, 8))
    adam = torch.optim.Adam([weight], lr=0.05, fused=fused)
    for _ in range(300):
        loss = (seen @ weight - seen @ wanted).square().mean()
        (slope,) = torch.autograd.grad(loss, weight)
        weight.grad = lies(slope)
        adam.step()
    return loss.item()


for name, lies in LIES.items():
    for fused in (False, True):
        loss = learned(fused, lies)
        print(f"a gradient {name}, fused={fused}:", "learned" if loss < 1e-3 else "not learned")
PY
venv/bin/python step.py | tee said.txt

diff said.txt - <<'EXPECTED'
a gradient in its own order, fused=False: learned
a gradient in its own order, fused=True: learned
a gradient transposed, fused=False: learned
a gradient transposed, fused=True: not learned
EXPECTED
echo "As described: fused, a transposed gradient moves the wrong numbers."
