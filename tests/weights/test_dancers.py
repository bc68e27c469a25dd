"""The dancers that ship dance on for as long as the book says.

    DANCE_FRAMES=20000 pytest tests/weights/test_dancers.py

2000 frames of each if it is not told otherwise; CI takes all of the book's.
"""

import json
import math
import os
from pathlib import Path

import pytest
import torch
from scipy.stats import binom

import motionlab
from experiments.common.rollouts import Judge

FRAMES = int(os.environ.get("DANCE_FRAMES", 2_000))
RESULT = Path(__file__).parents[2] / "results" / "dances_rollouts.json"
UNLIKELY = 1e-3


@pytest.mark.slow
@pytest.mark.parametrize("style", ["martial", "indian", "hybrid", "walking"])
@torch.no_grad()
def test_a_dancer_lasts_as_the_book_says(style):
    told = json.loads(RESULT.read_text(encoding="utf-8"))["dancers"][f"aclstm-{style}"]
    model = motionlab.load(f"aclstm-{style}")
    features = model.generate(FRAMES, model.starts)
    assert features.isfinite().all()

    judge = Judge.from_config(told["limits"], model.encoding.skeleton)
    failures = [judge.failures(model.encoding.positions(its)) for its in features]
    alive = sum(math.isinf(min(its.values())) for its in failures)
    seconds = [math.inf if its is None else its for its in told["failed (s)"]]
    lasting = sum(its > FRAMES / model.fps for its in seconds)
    share = (lasting + 1) / (len(seconds) + 2)  # Laplace's: none of twenty is not never
    assert binom.cdf(alive, len(failures), share) > UNLIKELY, f"{alive} alive: {failures}"
