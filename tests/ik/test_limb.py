"""two_bone: exact in reach, clamped beyond it, the knee in front, differentiable."""

import pytest
import torch

from motionlab.errors import IkError
from motionlab.ik import two_bone

UPPER = torch.tensor([0.0, -0.39, 0.0], dtype=torch.float64)
LOWER = torch.tensor([0.0, -0.41, 0.0], dtype=torch.float64)
AHEAD = torch.tensor([0.0, 0.0, 1.0], dtype=torch.float64)


def limb(hip, target, knee, upper=UPPER, lower=LOWER, parent=None, hinge=(1.0, 0.0, 0.0)):
    """Knee and end of the solved limb, by forward kinematics."""
    first, second = two_bone(hip, target, knee, upper, lower, parent, hinge)
    first = first if parent is None else parent @ first
    bent = hip + first @ upper
    return bent, bent + first @ second @ lower, first, second


def random_targets(count, shortest=0.15, longest=0.79):
    generator = torch.Generator().manual_seed(3)
    draw = lambda *shape: torch.randn(*shape, generator=generator, dtype=torch.float64)
    way = draw(count, 3)
    way[:, 1] = -way[:, 1].abs() - 0.3  # below the hip, as legs are
    distance = shortest + (longest - shortest) * torch.rand(count, 1, generator=generator)
    hip = draw(count, 3)
    return hip, hip + distance * way / way.norm(dim=-1, keepdim=True), AHEAD + 0.2 * draw(count, 3)


def test_reaches_what_is_in_reach():
    hip, target, knee = random_targets(500)
    bent, end, first, second = limb(hip, target, knee)
    torch.testing.assert_close(end, target, rtol=0, atol=1e-9)
    for turn in (first, second):
        torch.testing.assert_close(turn.mT @ turn, torch.eye(3).double().expand_as(turn))
        assert (torch.linalg.det(turn) > 0).all()


def test_knee_points_where_it_is_told_and_bends_one_way():
    hip, target, knee = random_targets(500)
    bent, *_, second = limb(hip, target, knee)
    along = (target - hip) / (target - hip).norm(dim=-1, keepdim=True)
    beside = (bent - hip) - ((bent - hip) * along).sum(-1, keepdim=True) * along
    asked = knee - (knee * along).sum(-1, keepdim=True) * along
    cosine = torch.cosine_similarity(beside, asked, dim=-1)
    torch.testing.assert_close(cosine, torch.ones_like(cosine))
    # A hinge: the knee turns about its own x axis only, forwards by no amount.
    torch.testing.assert_close(second[:, 0, 0], torch.ones(500).double())
    assert (torch.atan2(second[:, 2, 1], second[:, 1, 1]) > 0).all()


@pytest.mark.parametrize("distance", [0.0, 0.005, 0.81, 5.0])
def test_out_of_reach_points_at_the_target(distance):
    hip = torch.zeros(1, 3, dtype=torch.float64)
    way = torch.tensor([[0.1, -0.9, 0.3]], dtype=torch.float64)
    way = way / way.norm()
    _, end, first, second = limb(hip, distance * way, AHEAD.expand(1, 3))
    assert torch.isfinite(first).all() and torch.isfinite(second).all()
    if distance > 0.02:
        assert torch.cosine_similarity(end, way).item() == pytest.approx(1, abs=1e-9)
        assert end.norm().item() == pytest.approx(0.80, abs=2e-4)
    elif distance > 0:
        assert end.norm().item() == pytest.approx(0.02, abs=2e-4)


def test_parent_orientation_and_other_rest_directions():
    # Bandai's legs point along x: the same leg in another rest pose, under a turned pelvis.
    hip, target, knee = random_targets(50)
    turn = torch.linalg.qr(torch.randn(50, 3, 3, dtype=torch.float64)).Q
    parent = turn * torch.linalg.det(turn)[:, None, None]
    upper, lower = (
        torch.tensor([length, 0.0, 0.0], dtype=torch.float64) for length in (0.39, 0.41)
    )
    bent, end, *_ = limb(hip, target, knee, upper, lower, parent, hinge=(0.0, 0.0, 1.0))
    plain, *_ = limb(hip, target, knee)
    torch.testing.assert_close(end, target, rtol=0, atol=1e-9)
    torch.testing.assert_close(bent, plain, rtol=0, atol=1e-9)


def test_bones_without_length_are_refused():
    hip = torch.zeros(3).double()
    for upper, lower in ((0 * UPPER, LOWER), (UPPER, 0 * LOWER), (UPPER, torch.nan * LOWER)):
        with pytest.raises(IkError, match="no length"):
            two_bone(hip, AHEAD, AHEAD, upper, lower)


def test_gradients_agree_with_finite_differences():
    hip, target, knee = (x[:4].clone().requires_grad_() for x in random_targets(4))
    assert torch.autograd.gradcheck(
        lambda h, t, k: two_bone(h, t, k, UPPER, LOWER), (hip, target, knee), eps=1e-7, atol=1e-5
    )


def test_gradients_are_finite_beyond_reach():
    hip = torch.zeros(2, 3, dtype=torch.float64)
    target = torch.tensor([[0.0, -0.9, 0.2], [0.0, -0.01, 0.0]]).double().requires_grad_()
    sum(turn.sum() for turn in two_bone(hip, target, AHEAD.expand(2, 3), UPPER, LOWER)).backward()
    assert torch.isfinite(target.grad).all()
