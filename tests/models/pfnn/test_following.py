"""Characters led along paths, by networks that always say the same."""

import math

import pytest
import torch
from steady_pfnn import PACE, REST, layout, steady

from motionlab.errors import ModelError, WayError
from motionlab.models.pfnn.following import follow


def test_followed_paths_become_motion():
    network = steady(layout(), turn=torch.zeros(1))
    line = torch.tensor([[1.0, 1.0], [4.0, 1.0]])  # to the left
    (motion,) = follow(network, [line], 1.2)
    assert motion.fps == 30 and len(motion) == 75  # 3 m at 1.2 m/s
    assert motion.contacts[0].tolist() == [True, True, False, False]
    assert torch.allclose(motion.root_positions[0], torch.tensor([1.0, 0.9, 1.0]), atol=1e-5)
    # a body of bones: each joint where the network has it
    assert torch.allclose(motion.positions()[40, :21, 1], REST[:, 1], atol=1e-5)
    # a frame behind its root, for it says of itself that its joints do not move
    assert motion.root_positions[-1, 0] == pytest.approx(1 + 73 * PACE, abs=1e-3)


def test_many_paths_are_as_each_alone():
    torch.manual_seed(0)
    network = steady(layout())
    for parameter in network.parameters():
        torch.nn.init.normal_(parameter, std=0.02)
    lines = [
        torch.tensor([[0.0, 0.0], [0.0, 0.8]]),
        torch.tensor([[0.0, 0.0], [0.5, 0.5], [0.5, 1.0]]),
    ]
    speeds = [1.5, 1.1]
    together = follow(network, lines, speeds)
    assert len(together[0]) < len(together[1])
    for motion, line, speed in zip(together, lines, speeds, strict=True):
        (alone,) = follow(network, [line], speed)
        assert torch.allclose(alone.root_positions, motion.root_positions, atol=1e-5)
        assert torch.allclose(alone.rotations, motion.rotations, atol=1e-4)


@pytest.mark.parametrize("paths", [[], torch.tensor([[0.0, 0.0], [0.0, 1.0]])])
def test_paths_are_a_list_of_some(paths):
    with pytest.raises(ModelError, match=r"must be a list, of one path or more: \[points\]"):
        follow(steady(layout()), paths, 1.0)


def test_a_path_that_is_none():
    with pytest.raises(WayError, match="two places"):
        follow(steady(layout()), [torch.zeros(1, 2)], 1.0)


@pytest.mark.parametrize(
    "wrong, said",
    [
        ({"speed": 0.0}, "speed is 0.0"),
        ({"speed": math.nan}, "speed is nan"),
        ({"speed": math.inf}, "speed is inf"),
        ({"speed": [1.0, 2.0]}, "one for each of 1 paths"),
        ({"speed": "fast"}, "one for each of 1 paths"),
        ({"seconds": -1.0}, "seconds is -1.0"),
        ({"gait": "gallop"}, "no gait 'gallop'; there are stand, walk"),
    ],
)
def test_wishes_that_make_no_sense(wrong, said):
    with pytest.raises(ModelError, match=said):
        follow(
            steady(layout()), [torch.tensor([[0.0, 0.0], [0.0, 1.0]])], **{"speed": 1.0, **wrong}
        )
