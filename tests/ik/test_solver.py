"""solve: rotations from points, on gaits, real clips and random poses."""

import math

import pytest
import roma
import torch
from hypothesis import given, settings
from hypothesis import strategies as st
from other_rigs import with_more_joints
from scipy.optimize import least_squares

from motionlab import Motion, Skeleton, read_bvh, write_bvh
from motionlab.datasets import gaits
from motionlab.errors import IkError
from motionlab.ik import refine, solve, twist_error
from motionlab.ik.limits import HUMAN, read_limits
from motionlab.ik.turns import place
from motionlab.io.bvh import parse_bvh
from motionlab.roles import SIDES

CANONICAL = Skeleton.canonical()
REST = torch.eye(3, dtype=torch.float64).expand(CANONICAL.joints, 3, 3)


@pytest.fixture(scope="module")
def walk():
    return gaits.make(speed=1.3, seconds=2, fps=30)


def steps(motion):
    """Degrees (frames - 1, joints) that each joint's orientation turns from frame to frame."""
    world = motion.orientations().double()
    return torch.rad2deg(roma.rotmat_geodesic_distance(world[1:], world[:-1]))


def recovered(motion, **options):
    root, rotations = solve(motion.skeleton, motion.positions(), **options)
    return Motion(motion.skeleton, root, rotations, motion.fps)


def gap(a, b):
    """Millimetres (frames, points) between two motions' points."""
    return 1000 * (a.positions() - b.positions()).norm(dim=-1)


def neutral_of(motion):
    """A clip's mean pose: raw skeletons have rest poses in which nobody could stand."""
    return roma.special_procrustes(motion.rotations.double().mean(0))


@pytest.mark.parametrize("limits", [None, "human"])
@pytest.mark.parametrize(
    "options", [{"speed": 0.9}, {"speed": 3.2}, {"speed": 1.2, "turn_rate": 0.9}]
)
def test_gaits_come_back(options, limits):
    source = gaits.make(seconds=2, fps=30, **options)
    found = recovered(source, limits=limits)
    direction, twist = twist_error(found.rotations, source.rotations, source.skeleton)
    assert gap(source, found).max() < 1  # a gait's knee may be a hair beyond straight
    assert direction.nanmedian() < 0.01
    assert direction[~direction.isnan()].max() < 0.5
    assert (steps(found).amax(0) < steps(source).amax(0) + (1 if limits else 3)).all()
    if limits:
        thighs = [CANONICAL.index(f"{side}_upper_leg") for side in SIDES]
        assert twist[:, thighs].max() < 5


SOURCES = ["accad", "aclstm-cmu", "bandai-actions", "bandai-locomotion", "cmu"]


@pytest.mark.filterwarnings("ignore:.*units")
@pytest.mark.parametrize("source", SOURCES)
def test_real_clips_come_back(real_clips, source):
    for name, data in real_clips[source].items():
        clip = parse_bvh(data, name, tpose_first=True).resample(30)[:200]
        found = recovered(clip, prior=neutral_of(clip))
        direction, twist = twist_error(found.rotations, clip.rotations, clip.skeleton)
        assert direction.nanmedian() < 0.01
        assert gap(clip, found).max() < 0.1
        assert torch.isfinite(twist).all()


@pytest.mark.parametrize("source", ["accad", "bandai-actions", "bandai-locomotion"])
def test_canonical_clips_neither_tremble_nor_jump(real_clips, source):
    for name, data in real_clips[source].items():
        clip = parse_bvh(data, name, tpose_first=True).resample(30)[:200].retarget()
        found = recovered(clip, limits="human")
        direction, twist = twist_error(found.rotations, clip.rotations, CANONICAL)
        assert gap(clip, found).max() < 5, name
        assert direction.nanmedian() < 0.01
        ours, theirs = steps(found), steps(clip)
        most = theirs.amax(0)
        head = [CANONICAL.index("neck"), CANONICAL.index("head")]
        most[head] = most[head].maximum(most[CANONICAL.index("chest")])  # it turns with the chest
        assert (ours.amax(0) < most + 7).all(), name
        shake, true_shake = (x.diff(dim=0).abs() for x in (ours, theirs))
        body = [j for j in range(CANONICAL.joints) if j not in head]
        assert (shake.mean(0) < 1.3 * true_shake.mean(0) + 0.1)[body].all(), name
        assert (shake.mean(0) < 2 * true_shake.mean(0) + 0.3).all(), name
        thighs = [CANONICAL.index(f"{side}_upper_leg") for side in SIDES]
        assert twist[:, thighs].median() < 2


def test_found_motion_survives_a_file(walk, tmp_path):
    found = recovered(walk, limits="human")
    write_bvh(found, tmp_path / "found.bvh")
    assert gap(found, read_bvh(tmp_path / "found.bvh")).max() < 0.1


def test_joints_alone_are_enough(walk):
    joints = CANONICAL.joints
    root, rotations = solve(CANONICAL, walk.positions()[:, :joints], limits="human")
    found = Motion(CANONICAL, root, rotations, walk.fps)
    assert gap(walk, found)[:, :joints].max() < 1
    hands = [CANONICAL.index(f"{side}_hand") for side in SIDES]
    torch.testing.assert_close(rotations[:, hands], torch.eye(3).expand(60, 2, 3, 3))  # the prior's


@pytest.mark.parametrize("seed", range(3))
def test_a_rig_of_many_joints_is_solved_in_closed_form(walk, seed):
    """Least squares need not begin, though children in the same place turn by themselves."""
    source = with_more_joints(walk, 101, seed)
    assert gap(source, recovered(source, iterations=0)).max() < 0.1


def test_frames_that_have_arrived_stop(walk, monkeypatch):
    source = with_more_joints(walk, 60)
    start = source.rotations @ roma.rotvec_to_rotmat(0.01 * torch.ones(source.skeleton.joints, 3))
    frames = []
    step = refine.tree_step
    monkeypatch.setattr(
        refine, "tree_step", lambda *a, **k: (frames.append(len(a[1])), step(*a, **k))[1]
    )
    assert gap(source, recovered(source, start=start)).max() < 0.1
    assert len(frames) < 8 and frames[-1] <= frames[0] == len(walk)


def test_batch_equals_loop(walk):
    clips = torch.stack([walk.positions()[i : i + 20] for i in (0, 10, 20, 30)])
    clips = clips + 0.01 * torch.randn(clips.shape, generator=torch.Generator().manual_seed(0))
    root, rotations = solve(CANONICAL, clips.reshape(2, 2, 20, -1, 3), limits="human")
    assert root.shape == (2, 2, 20, 3) and rotations.shape == (2, 2, 20, 21, 3, 3)
    for i, clip in enumerate(clips):
        alone = solve(CANONICAL, clip, limits="human")
        torch.testing.assert_close(root[i // 2, i % 2], alone[0], rtol=0, atol=1e-5)
        torch.testing.assert_close(rotations[i // 2, i % 2], alone[1], rtol=0, atol=1e-4)


def test_frames_alone_without_smoothing(walk):
    together = solve(CANONICAL, walk.positions(), limits="human", smooth=0)
    alone = solve(CANONICAL, walk.positions()[7:8], limits="human")
    torch.testing.assert_close(together[1][7:8], alone[1], rtol=0, atol=1e-5)


def test_world_turned_and_moved_turns_and_moves_the_result(walk):
    turn = roma.rotvec_to_rotmat(torch.tensor([0.3, 2.0, -0.4]))
    root, rotations = solve(CANONICAL, walk.positions(), limits="human")
    moved, turned = solve(CANONICAL, walk.positions() @ turn.T + 3, limits="human")
    torch.testing.assert_close(moved, root @ turn.T + 3, rtol=0, atol=1e-5)
    torch.testing.assert_close(turned[:, 1:], rotations[:, 1:], rtol=0, atol=1e-3)
    torch.testing.assert_close(turned[:, 0], turn @ rotations[:, 0], rtol=0, atol=1e-3)


def test_noise_is_not_made_worse(walk):
    draw = torch.randn(walk.positions().shape, generator=torch.Generator().manual_seed(1))
    worst = 0.0
    for size in (0.001, 0.003, 0.01):
        root, rotations = solve(CANONICAL, walk.positions() + size * draw, limits="human")
        error = gap(walk, Motion(CANONICAL, root, rotations, 30)).mean() / 1000
        assert (
            worst < error < 1.6 * size
        )  # noise has length 1.6 size, and fixed bones take some away
        worst = float(error)


def test_bones_a_little_too_long_cost_little(walk):
    stretched = walk.positions().clone()
    for point, parent in enumerate(CANONICAL.point_parents):
        if parent >= 0:
            bone = walk.positions()[:, point] - walk.positions()[:, parent]
            stretched[:, point] = stretched[:, parent] + (1 + 0.02 * (-1) ** point) * bone
    root, rotations = solve(CANONICAL, stretched, limits="human")
    found = place(CANONICAL, root, rotations)[0]
    assert (found - stretched).norm(dim=-1).max() < 0.012
    direct = (found - stretched).norm(dim=-1).mean()
    pointed = solve(CANONICAL, stretched, limits="human", iterations=0)
    assert direct < 0.8 * (place(CANONICAL, *pointed)[0] - stretched).norm(dim=-1).mean()


@pytest.mark.parametrize("scale", [0.0, 0.3, 3.0, 100.0])
def test_out_of_reach_stays_finite(walk, scale):
    root, rotations = solve(CANONICAL, scale * walk.positions()[:10], limits="human")
    assert torch.isfinite(root).all() and torch.isfinite(rotations).all()
    product = rotations @ rotations.mT
    torch.testing.assert_close(product, torch.eye(3).expand_as(product), rtol=0, atol=1e-5)


def test_targets_without_weight_are_ignored(walk):
    weights = torch.ones(CANONICAL.points)
    elbow = CANONICAL.index("left_lower_arm")
    weights[elbow] = 0
    targets = walk.positions().clone()
    targets[:, elbow] = math.nan
    root, rotations = solve(CANONICAL, targets, weights=weights, limits="human")
    off = gap(walk, Motion(CANONICAL, root, rotations, 30))
    assert off[:, weights > 0].max() < 1
    assert off[:, elbow].max() < 100


def test_hands_and_feet_alone(walk):
    weights = torch.zeros(CANONICAL.points)
    asked = ["hips", "head", "left_hand", "right_hand", "left_foot", "right_foot"]
    weights[[CANONICAL.index(role) for role in asked]] = 1
    root, rotations = solve(CANONICAL, walk.positions(), weights=weights, limits="human")
    found = Motion(CANONICAL, root, rotations, 30)
    assert gap(walk, found)[:, weights > 0].max() < 5
    assert (steps(found) < 25).all()


def test_nothing_asked_gives_the_prior():
    root, rotations = solve(CANONICAL, torch.ones(2, CANONICAL.points, 3), weights=torch.zeros(1))
    torch.testing.assert_close(rotations[:, 1:], torch.eye(3).expand(2, 20, 3, 3))
    assert torch.isfinite(root).all()


def test_warm_start_needs_fewer_steps(walk):
    weights = torch.zeros(CANONICAL.points)
    weights[[0, 4, 8, 12, 15, 19]] = 1
    targets = walk.positions()[:20]
    _, solved = solve(CANONICAL, targets, weights=weights, iterations=60)
    off = lambda **how: (
        (
            (
                place(CANONICAL, *solve(CANONICAL, targets + 0.005, weights=weights, **how))[0]
                - targets
            )
            - 0.005
        )[:, weights > 0]
        .norm(dim=-1)
        .max()
    )
    assert off(start=solved, iterations=1) < 0.002 < off(iterations=1)
    assert off(iterations=60) < 0.003


def test_start_decides_what_points_leave_open(walk):
    """A forearm's twist is not seen: it stays as it starts."""
    hand = CANONICAL.index("left_hand")
    start = walk.rotations.clone()
    start[:, hand] = start[:, hand] @ roma.rotvec_to_rotmat(torch.tensor([0.7, 0.0, 0.0]))
    _, rotations = solve(CANONICAL, walk.positions(), start=start)
    torch.testing.assert_close(rotations, start, rtol=0, atol=1e-4)


def test_knees_never_bend_backwards(walk):
    """Even where the targets ask for it."""
    targets = walk.positions().clone()
    ankle = CANONICAL.index("left_foot")
    targets[:, ankle : ankle + 2, 2] += 0.6  # a metre of shank swung ahead of the knee
    root, rotations = solve(CANONICAL, targets, limits="human")
    for hinge in read_limits("human", CANONICAL, REST).hinges.values():
        bend = torch.rad2deg(hinge.bend(rotations.double()))
        low, high = HUMAN["lower_leg" if hinge.lower in (14, 18) else "lower_arm"]
        assert (bend > low - 0.01).all() and (bend < high + 0.01).all()


def test_single_frame_agrees_with_scipy(walk):
    """The same least-squares problem, solved by a general solver with numeric derivatives."""
    draw = torch.randn(walk.positions().shape, generator=torch.Generator().manual_seed(2))
    targets = (walk.positions() + 0.02 * draw)[3:4].double()
    root, rotations = solve(CANONICAL, targets, iterations=100)

    def residuals(x):
        x = torch.from_numpy(x)
        turned = roma.rotvec_to_rotmat(x[3:].reshape(-1, 3)) @ rotations[0]
        return (place(CANONICAL, root[0] + x[:3], turned)[0] - targets[0]).flatten().numpy()

    best = least_squares(residuals, torch.zeros(66).numpy(), method="trf", max_nfev=15)
    ours = 0.5 * (residuals(torch.zeros(66).double().numpy()) ** 2).sum()
    assert ours < 1.02 * best.cost + 1e-5


@settings(max_examples=12, deadline=None)
@given(st.integers(0, 10**6), st.floats(0.0, 0.8))
def test_random_poses_come_back(seed, size):
    """Any pose: points exact, bone directions exact; float64 throughout."""
    random = torch.Generator().manual_seed(seed)
    turns = size * torch.randn(3, CANONICAL.joints, 3, generator=random, dtype=torch.float64)
    turns[:, 0] *= 3
    pose = roma.rotvec_to_rotmat(turns)
    targets = place(CANONICAL, torch.randn(3, 3, generator=random).double(), pose)[0]
    root, rotations = solve(CANONICAL, targets)
    assert root.dtype == rotations.dtype == torch.float64
    assert (place(CANONICAL, root, rotations)[0] - targets).norm(dim=-1).max() < 1e-4
    direction, _ = twist_error(rotations, pose, CANONICAL)
    assert direction[~direction.isnan()].max() < 0.1


@settings(max_examples=12, deadline=None)
@given(st.integers(0, 10**6))
def test_random_human_poses_stay_human(seed):
    """Poses inside the limits come back to 5 mm, and twist above bent hinges with them."""
    random = torch.Generator().manual_seed(seed)
    rules = read_limits("human", CANONICAL, REST)
    pose = roma.rotvec_to_rotmat(0.2 * torch.randn(4, 21, 3, generator=random).double())
    for hinge in rules.hinges.values():
        bend = 0.4 + 1.2 * torch.rand(4, 1, generator=random).double()
        pose[:, hinge.lower] = roma.rotvec_to_rotmat(bend * hinge.axis)
    targets = place(CANONICAL, torch.zeros(4, 3).double(), pose)[0]
    root, rotations = solve(CANONICAL, targets, limits="human", smooth=0)
    assert (place(CANONICAL, root, rotations)[0] - targets).norm(dim=-1).max() < 0.005
    _, twist = twist_error(rotations, pose, CANONICAL)
    assert twist[:, list(rules.hinges)].max() < 3


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"targets": torch.zeros(4, 7, 3)}, "26"),
        ({"targets": torch.zeros(26, 3)}, "frames"),
        ({"targets": torch.zeros(0, 26, 3)}, "no frame"),
        ({"targets": torch.full((2, 26, 3), math.nan)}, "'Hips' at frame 0"),
        ({"targets": [[0.0]]}, "list"),
        ({"weights": torch.ones(5)}, "broadcast"),
        ({"weights": [1.0, "two"]}, "broadcast"),
        ({"weights": -torch.ones(26)}, "negative"),
        ({"start": torch.zeros(2, 21, 3)}, "`start`"),
        ({"start": torch.zeros(2, 21, 3, 3)}, "no rotations"),
        ({"prior": torch.eye(4)}, "`prior`"),
        ({"limits": "robot"}, "robot"),
        ({"limits": {"tail": 30}}, "tail"),
        ({"limits": {"lower_leg": 30}}, "pair"),
        ({"limits": {"lower_leg": (0, "wide")}}, "pair"),
        ({"limits": {"lower_leg": (0, 90, 150)}}, "pair"),
        ({"limits": {"lower_leg": (150, 0)}}, "pair"),
        ({"limits": {"spine": -5}}, "number from 0"),
        ({"limits": {"spine": "wide"}}, "number from 0"),
        ({"prior": -torch.eye(3)}, "determinant"),
        ({"smooth": -1}, "smooth is -1"),
        ({"smooth": math.nan}, "smooth is nan"),
        ({"smooth": "very"}, "smooth is 'very'"),
        ({"iterations": -1}, "iterations is -1"),
        ({"iterations": 2.5}, "iterations is 2.5"),
        ({"skeleton": "canonical"}, "takes a Skeleton"),
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)
def test_bad_input_is_named(options, words):
    options = {"skeleton": CANONICAL, "targets": torch.zeros(2, 26, 3), **options}
    with pytest.raises(IkError, match=words):
        solve(**options)


def test_human_limits_need_an_upright_neutral_pose(real_clips):
    name, data = next(iter(real_clips["bandai-locomotion"].items()))
    clip = parse_bvh(data, name)
    with pytest.raises(IkError, match="stand upright"):
        recovered(clip, limits="human")


def test_human_limits_need_a_human():
    chain = Skeleton(("Hips", "LeftUpLeg", "LeftLeg", "LeftFoot"), (-1, 0, 1, 2), torch.ones(4, 3))
    with pytest.raises(IkError, match="head"):
        solve(chain, torch.zeros(1, 4, 3), limits="human")
