"""Small products and lengths are those of torch, and turns bring directions where they should."""

from __future__ import annotations

import roma
import torch
from hypothesis import example, given, settings
from hypothesis import strategies as st

from motionlab.ik.turns import dot, length, product, shortest_turn, unit


def drawn(*shape, seed=0):
    return torch.randn(*shape, generator=torch.Generator().manual_seed(seed))


def test_products_and_lengths_are_those_of_torch_in_any_layout():
    vectors, matrices = drawn(3, 2, 5).permute(2, 1, 0), drawn(3, 3, 5).permute(2, 0, 1)
    assert torch.allclose(length(vectors), vectors.norm(dim=-1))
    assert torch.allclose(length(vectors, keepdim=True), vectors.norm(dim=-1, keepdim=True))
    assert torch.allclose(dot(vectors, vectors.flip(0)), (vectors * vectors.flip(0)).sum(-1))
    assert torch.allclose(product(matrices, matrices.mT), matrices @ matrices.mT, atol=1e-6)


def test_vectors_without_length_have_no_slope():
    zero = torch.zeros(3, requires_grad=True)
    (length(zero) + unit(zero).sum()).backward()
    assert length(zero) < 1e-12 and zero.grad.isfinite().all()


@settings(deadline=None, max_examples=60)
@given(seed=st.integers(0, 10_000), off=st.sampled_from([1e-3, 1e-2, 0.1, 1.0]))
@example(seed=888, off=1e-3)  # drawn aside along the start
def test_the_shortest_turn_brings_one_direction_to_another_also_near_opposite_ones(seed, off):
    start, aside = unit(drawn(2, 3, seed=seed))
    aside = unit(aside - dot(aside, start) * start)  # else `off` may be far less than it says
    end = unit(-start + off * aside)
    turn = shortest_turn(start, end)
    assert torch.allclose(turn @ start, end, atol=1e-5 / off)  # what is between them is rounded
    assert torch.allclose(turn @ turn.mT, torch.eye(3), atol=2e-6) and torch.det(turn) > 0.99
    assert torch.allclose(
        roma.rotmat_geodesic_distance(turn, torch.eye(3)),
        2 * torch.atan2((end - start).norm(), (end + start).norm()),
        atol=2e-5 / off,
    )
