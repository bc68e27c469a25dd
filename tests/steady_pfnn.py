"""A PFNN that says the same whatever it sees, so that the walk is known."""

import torch

from motionlab import Skeleton
from motionlab.encodings import Normalizer
from motionlab.models.pfnn.layout import Layout, join, size
from motionlab.models.pfnn.network import Pfnn

PACE, TURN, STRIDE = 0.04, 0.02, 1 / 33  # metres, radians to the left, cycles; a frame
REST = Skeleton.canonical().rest_points[:21] + torch.tensor([0.0, 0.9, 0.0])


def steady(layout: Layout, **values) -> Pfnn:
    """A network that says `values` whatever it sees; other parts are those of a steady bend."""
    n = layout.points // 2
    ahead = torch.arange(n) * float(layout.stride)
    usual = {
        "step": torch.tensor([0.0, PACE]), "turn": torch.tensor([-TURN]),
        "phase": torch.tensor([STRIDE]), "contacts": torch.tensor([0.9, 0.6, 0.4, 0.0]),
        "places": torch.stack([bend(k) for k in ahead.tolist()], dim=-1),
        "directions": torch.stack([(TURN * ahead).sin(), (TURN * ahead).cos()]),
        "joints": REST, "velocities": torch.zeros(21, 3), "rotations": torch.zeros(21, 3),
    }  # fmt: skip
    said = Normalizer(size(layout.said))
    said.mean.copy_(join(layout.said, usual | values))
    network = Pfnn(layout, width=2, said=said)
    for parameter in network.parameters():
        torch.nn.init.zeros_(parameter)
    return network.eval().requires_grad_(False)


def bend(frames: float) -> torch.Tensor:
    """x and z after some frames, each a step ahead and then a turn; steps add up to this, exactly."""
    turned = torch.arange(int(frames)) * TURN
    return PACE * torch.stack([turned.sin().sum(), turned.cos().sum()])


def layout(**more) -> Layout:
    return Layout(Skeleton.canonical(), **{"fps": 30, "reach": 30, "stride": 5, **more})
