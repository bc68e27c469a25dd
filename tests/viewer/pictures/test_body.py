"""The body that is drawn around a skeleton stays near it, however strange the skeleton is."""

from __future__ import annotations

import pytest
import torch

from motionlab.skeleton import Skeleton
from motionlab.viewer.pictures.body import body

LEGS = ("Hips", "LeftUpLeg", "LeftLeg", "LeftFoot", "LeftToeBase", "RightUpLeg", "RightLeg", "RightFoot")  # fmt: skip
TREES = {  # names, parents, and who is carried by the hips without a bone
    "a neck beside the head": (("Hips", "Head", "Neck"), (-1, 0, 0), "Head"),
    "a forearm beside its hand": (("Hips", "LeftHand", "LeftForeArm"), (-1, 0, 0), "LeftHand"),
    "toes beside their foot": (LEGS, (-1, 0, 1, 2, 0, 0, 5, 6), "LeftToeBase"),
}


@pytest.mark.parametrize("tree", TREES)
def test_what_does_not_carry_a_point_draws_no_line_through_it(tree):
    """The line from such a point, as long as the bones between them say, once led 1500 bodies away."""
    names, parents, near = TREES[tree]
    places = torch.linspace(-1.0, 1.0, 3 * len(names)).view(-1, 3)
    places[[0, names.index(near)]] = 0.0
    skeleton = Skeleton(names, parents, places, (), torch.zeros(0, 3))
    drawn = body(skeleton).points(skeleton.rest_points)
    assert drawn.abs().max() < 1.5 * skeleton.rest_points.abs().max()
