"""What is kept of a reference: found once, and anew when its numbers are others."""

import torch

from motionlab.datasets import load
from motionlab.retargeting.kept_axes import kept


def test_is_found_once_for_a_reference_and_anew_if_that_changes():
    one, other = load("gaits")[:2]
    asked = []

    def find():
        asked.append(len(asked))
        return {"hips": torch.eye(3)}

    kept(one, ("target",), find)["hips"] = None  # what is handed out is its own
    assert kept(one, ("target",), find)["hips"] is not None and len(asked) == 1
    kept(other, ("target",), find)
    kept(one, ("another",), find)
    assert len(asked) == 3
    one.root_positions.add_(0.0)
    kept(one, ("target",), find)
    assert len(asked) == 4


def test_nothing_is_kept_that_does_not_tell_of_changes():
    with torch.inference_mode():
        motion = load("gaits")[0][:3]
    found = [kept(motion, (), lambda: {"hips": torch.eye(3)})["hips"] for _ in range(2)]
    assert found[0] is not found[1]
