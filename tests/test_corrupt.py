"""What is made wrong is as large as asked, where asked, and the same for the same seed."""

import pytest
import roma
import torch

from motionlab import corrupt
from motionlab.datasets import gaits
from motionlab.errors import MotionError, SkeletonError


@pytest.fixture(scope="module")
def walk():
    return gaits.make(seconds=20.0)


def chance(seed=0):
    return torch.Generator().manual_seed(seed)


def off(motion, truth):
    """How far roots (frames, 3) and rotations (frames, joints, 3) are off."""
    turns = roma.rotmat_to_rotvec(truth.rotations.mT @ motion.rotations)
    return motion.root_positions - truth.root_positions, turns


@pytest.mark.parametrize("memory", [0.0, 0.3])
def test_tremble_is_as_large_as_asked_and_remembers(walk, memory):
    found = corrupt.tremble(walk, 0.03, 0.1, memory=memory, generator=chance())
    root, turns = off(found, walk)
    assert float(root.std()) == pytest.approx(0.03, rel=0.2 if memory else 0.05)
    assert float(turns.std()) == pytest.approx(0.1, rel=0.05)
    kept = float((turns[1:] * turns[:-1]).mean() / turns.square().mean())
    wanted = torch.tensor(-1 / (walk.fps * memory)).exp() if memory else 0.0
    assert kept == pytest.approx(float(wanted), abs=0.04)


def test_the_same_seed_is_the_same_noise(walk):
    for make in (
        lambda seed: corrupt.tremble(walk, memory=0.1, generator=chance(seed)),
        lambda seed: corrupt.outliers(walk, generator=chance(seed))[0],
        lambda seed: corrupt.gap(walk, 0.5, generator=chance(seed))[0],
        lambda seed: corrupt.sway(walk, generator=chance(seed)),
    ):
        assert torch.equal(make(1).root_positions, make(1).root_positions)
        assert not torch.equal(make(1).root_positions, make(2).root_positions)


@pytest.mark.parametrize("share", [0.01, 0.05])
def test_outliers_are_a_share_and_the_rest_is_untouched(walk, share):
    found, wrong = corrupt.outliers(walk, share, generator=chance())
    assert int(wrong.sum()) == round(share * len(walk)) and not wrong[[0, -1]].any()
    root, turns = off(found, walk)
    assert root[~wrong].abs().max() == 0 and turns[~wrong].abs().max() < 1e-3
    assert (turns[wrong].norm(dim=-1).mean(-1) > 0.5).all()


def test_what_is_lost_holds_still(walk):
    for found, missing in (
        corrupt.dropped(walk, 0.1, generator=chance()),
        corrupt.gap(walk, 0.5, generator=chance()),
    ):
        assert missing.shape == (len(walk),)
        for frame in missing.nonzero()[:, 0].tolist():
            assert torch.equal(found.rotations[frame], found.rotations[frame - 1])
            assert torch.equal(found.root_positions[frame], found.root_positions[frame - 1])
        assert torch.equal(found.rotations[~missing], walk.rotations[~missing])
    assert int(missing.sum()) == round(0.5 * walk.fps) and int(missing.diff().sum()) == 2


def test_a_lost_foot_is_a_foot_and_its_toes(walk):
    found, missing = corrupt.lost_foot(walk, 1.0, "right", generator=chance())
    skeleton = walk.skeleton
    lost = missing.any(0).nonzero()[:, 0].tolist()
    assert lost == sorted([skeleton.role("right_foot"), skeleton.role("right_toes")])
    assert int(missing.any(1).sum()) == round(walk.fps)
    assert torch.equal(found.root_positions, walk.root_positions)
    assert torch.equal(found.rotations[~missing], walk.rotations[~missing])
    rows = missing.any(1).nonzero()[:, 0]
    held = found.rotations[rows][:, lost]
    assert torch.equal(held, held[:1].expand_as(held))
    with pytest.raises(SkeletonError):
        corrupt.lost_foot(walk, 1.0, "middle")


def test_sway_slides_feet_over_the_ground_alone(walk):
    found = corrupt.sway(walk, 0.03, 1.0, generator=chance())
    root, turns = off(found, walk)
    assert root[:, 1].abs().max() == 0 and turns.abs().max() < 1e-3
    assert float(root[:, [0, 2]].std()) == pytest.approx(0.03 / 2**0.5, rel=0.15)
    assert root[:, [0, 2]].diff(n=2, dim=0).norm(dim=1).max() * walk.fps**2 < 6  # m/s²


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        (lambda m: corrupt.tremble(m, -1.0), "root is -1.0; it must be a number from 0"),
        (lambda m: corrupt.tremble(m, memory=float("nan")), "memory is nan"),
        (lambda m: corrupt.outliers(m, 0.0), "A share of 0.0"),
        (lambda m: corrupt.dropped(m[:2]), "of 2 frames"),
        (lambda m: corrupt.gap(m, 11.0), "no more than half"),
        (lambda m: corrupt.gap(m, 0.0), "a frame or more"),
        (lambda m: corrupt.sway(m, 0.1, 0.0), "positive numbers"),
    ],
)
def test_nonsense_is_refused(walk, wrong, said):
    with pytest.raises(MotionError, match=said):
        wrong(walk)
