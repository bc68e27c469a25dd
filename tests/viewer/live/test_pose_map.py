"""The map of poses: what a page is given."""

import json
import math
import re

import pytest
import torch

from motionlab import Skeleton
from motionlab.errors import ViewerError
from motionlab.viewer import pose_map

BODY = Skeleton.canonical()


def poses(rows=2, columns=3):
    chance = torch.Generator().manual_seed(0)
    return torch.rand(rows, columns, BODY.joints, 3, generator=chance)


def test_the_page_has_every_pose_and_dot_where_it_belongs():
    some = poses()
    dots = torch.tensor([[0.0, 1.0], [0.25, 0.5], [1.0, 0.0]])
    page = pose_map(some, BODY, dots=dots, labels=["walk", "a < b", "walk"], caption="x < y").html
    given = json.loads(re.search(r"} = ({\"rows\".*?});", page)[1])
    assert (given["rows"], given["columns"]) == (2, 3)
    assert given["parents"] == list(BODY.parents)
    found = torch.tensor(given["poses"]).unflatten(0, (2, 3)).unflatten(-1, (-1, 3)) / 1000
    assert torch.allclose(found, some, atol=6e-4)
    assert given["dots"] == [[0.0, 1.0, 0], [0.25, 0.5, 1], [1.0, 0.0, 0]]
    assert len(given["colors"]) == 2 and "a &lt; b" in page and "x &lt; y" in page


def test_two_maps_of_a_page_have_their_own_names():
    first, second = (
        re.search(r'id="(pose-map-\w+)"', pose_map(poses(), BODY).html)[1] for _ in range(2)
    )
    assert first != second


def test_maps_that_make_no_sense():
    with pytest.raises(ViewerError, match="two or more"):
        pose_map(poses(1), BODY)
    with pytest.raises(ViewerError, match="must be"):
        pose_map(poses()[..., :5, :], BODY)
    with pytest.raises(ViewerError, match="NaN"):
        pose_map(poses() * math.nan, BODY)
    with pytest.raises(ViewerError, match="beyond"):
        pose_map(poses(), BODY, dots=torch.tensor([[0.0, 1.1]]))
    with pytest.raises(ViewerError, match="label"):
        pose_map(poses(), BODY, dots=torch.zeros(2, 2), labels=["one"])
    with pytest.raises(ViewerError, match="2000"):
        pose_map(poses(40, 51), BODY)
