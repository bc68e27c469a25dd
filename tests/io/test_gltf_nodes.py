"""Which nodes of a glTF file are a body's joints, and what is said of the others."""

from __future__ import annotations

import warnings

import numpy as np
import pytest
import torch
from gltf_files import Gltf, mixamo, skin, worlds
from scipy.spatial.transform import Rotation

from motionlab import Motion, read_gltf
from motionlab.datasets import gaits
from motionlab.errors import GltfError

STILL = np.tile(np.eye(4), (9, 1, 1))


@pytest.fixture(scope="module")
def walk() -> Motion:
    return gaits.make(seconds=0.4, speed=1.4, turn_rate=0.4, seed=3)


@pytest.fixture
def read(tmp_path):
    return lambda gltf, **options: read_gltf(gltf.save(tmp_path / "clip.glb"), **options)


def check_walks(read: Motion, walk: Motion) -> None:
    assert float((read.positions() - walk.positions()).abs().max()) < 1e-4


def turning(gltf: Gltf, *nodes: int, name: str | None = None) -> None:
    """An animation in which nodes turn about x."""
    turns = Rotation.from_euler("X", [[0], [40], [70]], degrees=True).as_quat()
    moves = {(node, "rotation"): ([0, 1 / 30, 2 / 30], turns, "LINEAR") for node in nodes}
    gltf.animate(moves, name)


def test_without_a_skin_what_moves_is_a_joint(walk, read):
    gltf = mixamo(walk)
    del gltf.json["skins"], gltf.json["nodes"][-1]["skin"]
    check_walks(read(gltf), walk)
    # an arm that does not move hangs on what does, and carries a hand
    still = [
        i for i, node in enumerate(gltf.json["nodes"]) if "LeftForeArm" in node.get("name", "")
    ]
    gltf.json["animations"][0]["channels"] = [
        channel
        for channel in gltf.json["animations"][0]["channels"]
        if channel["target"]["node"] not in still
    ]
    body = read(gltf)
    assert body.skeleton.names == read(mixamo(walk)).skeleton.names
    assert body.skeleton.end_parents == walk.skeleton.end_parents


def test_two_skins_make_one_body(walk, read):
    """As of a character whose body and clothes are two meshes, each with the joints it needs."""
    gltf = mixamo(walk)
    joints = gltf.json["skins"][0]["joints"]
    gltf.json["skins"][0]["joints"] = joints[:12]
    skin(gltf, joints[10:], STILL[:1].repeat(len(joints) - 10, 0))
    check_walks(read(gltf), walk)


def test_a_skin_that_leaves_joints_out(walk, read):
    """FBX2glTF names only the joints that carry vertices."""
    gltf = mixamo(walk)
    gltf.json["skins"][0]["joints"] = [5, 9, 16, 20]
    check_walks(read(gltf), walk)


def twice(walk: Motion) -> Gltf:
    """Two people in one file, the second 3 m to the side."""
    gltf = mixamo(walk)
    count = len(gltf.json["nodes"]) - 1
    for node in gltf.json["nodes"][:count]:
        other = dict(node, name="B" + node["name"])
        if "children" in node:
            other["children"] = [child + count + 1 for child in node["children"]]
        gltf.json["nodes"].append(other)
    gltf.json["nodes"][count + 1]["translation"] = [3, 0, 0]
    joints = [joint + count + 1 for joint in gltf.json["skins"][0]["joints"]]
    skin(gltf, joints, STILL[:1].repeat(len(joints), 0))
    first = gltf.json["animations"][0]
    channels = [
        dict(channel, target=dict(channel["target"], node=channel["target"]["node"] + count + 1))
        for channel in first["channels"]
    ]
    gltf.json["animations"].append({**first, "name": "other", "channels": channels})
    return gltf


def test_of_two_bodies_one_is_named(walk, read):
    gltf = twice(walk)
    said = r"2 bodies, .*: 'mixamorig:Hips', 'Bmixamorig:Hips'; .* root='mixamorig:Hips'"
    with pytest.raises(GltfError, match=said):
        read(gltf, animation="other")
    check_walks(read(gltf, root="mixamorig:Hips"), walk)
    second = read(gltf, root="Bmixamorig:Hips")
    aside = second.positions() - torch.tensor([3.0, 0, 0])
    assert float((aside - walk.positions()).abs().max()) < 1e-4
    assert second.skeleton.names[0] == "Bmixamorig:Hips"
    assert read(gltf, root="BArmature").skeleton.names[0] == "Bmixamorig:Hips"  # which it carries


def test_joints_beside_the_body_are_left_out(walk, read):
    """Targets of legs under the armature, as of rigs for inverse kinematics."""
    gltf = mixamo(walk)
    nodes = gltf.json["nodes"]
    nodes.append({"name": "IK_foot"})
    nodes[0]["children"].append(len(nodes) - 1)
    gltf.json["skins"][0]["joints"].append(len(nodes) - 1)
    with pytest.warns(UserWarning, match="'mixamorig:Hips'; joints beside .*: IK_foot"):
        body = read(gltf)
    check_walks(body, walk)
    for i, node in enumerate(nodes):  # names that say nothing
        node["name"] = f"x{chr(97 + i // 26)}{chr(97 + i % 26)}"
    with pytest.warns(UserWarning, match="left out"):
        check_walks(read(gltf), walk)


def test_a_root_that_carries_a_pelvis_is_folded_into_it(walk, read):
    """As of Unreal's rig: a root that stands still, the pelvis moves, targets lie beside it."""
    gltf = mixamo(walk)
    nodes = gltf.json["nodes"]
    nodes.append({"name": "ik_foot_root"})
    nodes.append({"name": "root", "children": [1, len(nodes) - 1]})
    nodes[0]["children"] = [len(nodes) - 1]
    gltf.json["skins"][0]["joints"] += [len(nodes) - 2, len(nodes) - 1]
    with pytest.warns(UserWarning, match="'mixamorig:Hips'.* 'root'.*left out: ik_foot_root"):
        check_walks(read(gltf), walk)


def test_names_that_are_missing_or_there_twice(walk, read):
    gltf = mixamo(walk)
    del gltf.json["nodes"][3]["name"]
    gltf.json["nodes"][4]["name"] = " "
    for node in (5, 6, 7):
        gltf.json["nodes"][node]["name"] = "Bone"
    body = read(gltf)
    assert body.skeleton.names[2:7] == ("node3", "node4", "Bone", "Bone.001", "Bone.002")
    check_walks(body, walk)


def test_joints_that_slide_or_are_scaled(walk, read):
    def with_(path, values):
        gltf = mixamo(walk)
        about = gltf.json["animations"][0]
        samplers, channels = about["samplers"], about["channels"]
        times = [0, 1 / 30, 2 / 30]
        samplers.append(
            {"input": gltf.add(times), "output": gltf.add(values), "interpolation": "LINEAR"}
        )
        channels.append({"sampler": len(samplers) - 1, "target": {"node": 3, "path": path}})
        return gltf

    rest = np.array(mixamo(walk).json["nodes"][3]["translation"])
    # a translation that is animated and stays
    check_walks(read(with_("translation", [rest, rest, rest])), walk)
    slide = with_("translation", [rest, rest + [2, 0, 0], rest])  # centimetres
    with pytest.raises(
        GltfError, match=r"'mixamorig:Spine2' moves .* by up to .* cm; .*rigid='mean'"
    ):
        read(slide)
    with pytest.warns(UserWarning, match="'mixamorig:Spine2' the most; .* mean offset"):
        read(slide, rigid="mean")
    grows = with_("scale", [[1, 1, 1], [1.5, 1.5, 1.5], [1, 1, 1]])
    with pytest.raises(GltfError, match="rigid='mean'"):
        read(grows)
    with pytest.warns(UserWarning) as told:
        read(grows, rigid="mean")
    assert any("changes its size, from 1 to 1.5" in str(each.message) for each in told)
    # that stays the same it is part of the bones
    same = with_("scale", np.full((3, 3), 1.25))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of a spine that hangs where it does not when at rest
        body = read(same)
    at = worlds(same, np.arange(len(walk)) / 30, 0)
    where = [node.get("name") for node in same.json["nodes"]]
    for joint, name in enumerate(body.skeleton.names):
        away = body.positions()[:, joint].numpy() - at[:, where.index(name), :3, 3]
        assert np.abs(away).max() < 1e-4


def test_uneven_scale_puts_points_where_they_are(read):
    """A stretched bone shears what turns on it: no rotation, but its points have places."""
    nodes = [{"name": "a", "scale": [1, 2, 1], "children": [1]},
             {"name": "b", "translation": [0, 1, 0], "children": [2]},
             {"name": "c", "translation": [1, 1, 0]}]  # fmt: skip
    gltf = Gltf(nodes)
    skin(gltf, [0, 1, 2], STILL[:3])
    turning(gltf, 0)
    body, at = read(gltf), worlds(gltf, np.arange(3) / 30, 0)
    np.testing.assert_allclose(body.positions(), at[:, :3, :3, 3], atol=1e-5)
    turning(gltf, 1, name="sheared")
    with pytest.raises(GltfError, match="rigid='mean'"):
        read(gltf, animation="sheared")


def test_hidden_and_mirrored_nodes(walk, read):
    gltf = mixamo(walk)
    gltf.json["nodes"][22]["scale"] = [0, 0, 0]  # a tip
    check_walks(read(gltf), walk)
    gltf.json["nodes"][0]["scale"] = [-0.01, 0.01, 0.01]
    with pytest.raises(GltfError, match="'Armature' is mirrored .*; apply scale"):
        read(gltf)


def test_neither_skin_nor_animation(walk, read):
    gltf = mixamo(walk)
    del gltf.json["animations"]
    with pytest.warns(UserWarning, match=r"clip\.glb: holds no animation; .* at rest"):
        rest = read(gltf)
    assert len(rest) == 1 and rest.skeleton.names[0] == "mixamorig:Hips"
    assert float((rest.positions() - walk.positions()[:1]).abs().max()) < 1e-4
    del gltf.json["skins"], gltf.json["nodes"][-1]["skin"]
    with pytest.raises(GltfError, match=r"clip\.glb: has neither skin nor animation.*; export it"):
        read(gltf)
    with pytest.raises(GltfError, match="neither skin nor animation"):
        read(Gltf([]))


def test_nodes_that_are_no_tree(walk, read):
    for change, words in (
        (lambda nodes: nodes[3]["children"].append(2), "hangs on two others"),
        (lambda nodes: nodes[3].update(children=[99]), "names node 99 of"),
        (lambda nodes: nodes[3].update(children=[-1]), "names node -1 of"),
        (lambda nodes: nodes.append({"name": "x", "children": [len(nodes)]}), "in a circle"),
        (lambda nodes: nodes[3].update(translation=[0, float("nan"), 0]), "not 3 numbers"),
        (lambda nodes: nodes[3].update(rotation=[0, 0, 0, 0]), "turned by no rotation"),
    ):
        gltf = mixamo(walk)
        del gltf.json["animations"]
        change(gltf.json["nodes"])
        with pytest.raises(GltfError, match=rf"clip\.glb: .*{words}"):
            read(gltf)
