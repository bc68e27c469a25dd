"""Pictures: what is drawn is where it should be, by both painters; videos; machines without VTK."""

from dataclasses import replace

import imageio_ffmpeg
import numpy as np
import pytest
import torch
from PIL import Image
from scipy.ndimage import label

from motionlab import Motion, MotionLabError, Skeleton
from motionlab.errors import ViewerError
from motionlab.kinematics import yaw_matrix
from motionlab.viewer import filmstrip, stack, still, video
from motionlab.viewer.pictures import probe as probe_
from motionlab.viewer.pictures.picture import Camera, Figure, Floor, Picture, capsules, unit
from motionlab.viewer.pictures.stills import open_painter
from motionlab.viewer.pictures.take import Take

BACKENDS = ["matplotlib", "vtk"]


def stroll(frames: int = 24, speed: float = 1.2, contacts: bool = False) -> Motion:
    """A T-pose that slides along +z and lifts its arms, 12 fps."""
    skeleton = Skeleton.canonical()
    time = torch.arange(frames) / 12.0
    root = torch.zeros(frames, 3)
    root[:, 1], root[:, 2] = 0.95, speed * time
    turns = torch.eye(3).repeat(frames, skeleton.joints, 1, 1)
    angle = time / 2
    lift = torch.eye(3).repeat(frames, 1, 1)
    lift[:, 0, 0] = lift[:, 1, 1] = angle.cos()
    lift[:, 1, 0], lift[:, 0, 1] = angle.sin(), -angle.sin()
    turns[:, skeleton.roles["left_upper_arm"]] = lift
    feet = torch.ones(frames, 4, dtype=torch.bool) if contacts else None
    return Motion(skeleton, root, turns, 12.0, name="stroll", contacts=feet)


@pytest.fixture(autouse=True)
def _vtk_or_skip(request):
    backend = getattr(request.node, "callspec", None)
    if backend and backend.params.get("backend") == "vtk" and probe_.why_not():
        pytest.skip("VTK cannot render here: apt-get install libegl1 libgl1-mesa-dri libosmesa6")


def solid(image: Image.Image) -> np.ndarray:
    """Where the body is: opaque pixels (the floor is never opaque)."""
    return np.asarray(image)[..., 3] > 250


def ball(at, radius=0.2) -> Figure:
    points = np.array([at, at], dtype=float) + [[0, 0, 0], [0, 1e-9, 0]]
    return Figure(points, np.array([[0, 1, radius, radius]]), np.array([0.8, 0.2, 0.2]))


@pytest.mark.parametrize("backend", BACKENDS)
@pytest.mark.parametrize("perspective", [True, False])
def test_a_ball_is_drawn_where_the_camera_projects_it(backend, perspective):
    camera = Camera(np.array([0.0, 1, 0]), unit(np.array([1.0, 0.3, 1])), 3.0, perspective)
    floor = Floor(np.zeros(3), np.array([0.0, 0, 1]), (1.5, 1.5))
    at = np.array([0.3, 1.4, -0.5])
    with open_painter((300, 200), backend) as paint:
        image = paint(Picture([ball(at)], floor, camera, (300, 200)))
    rows, cols = np.nonzero(image[..., 3] > 250)
    right, up, _ = camera.project(at)
    assert cols.mean() + 0.5 == pytest.approx(150 + right * 200 / 3, abs=1)
    assert rows.mean() + 0.5 == pytest.approx(100 - up * 200 / 3, abs=1)
    assert len(rows) == pytest.approx(np.pi * (0.2 * 200 / 3) ** 2, rel=0.12)


def test_both_painters_agree():
    if probe_.why_not():
        pytest.skip("VTK cannot render here: apt-get install libegl1 libgl1-mesa-dri libosmesa6")
    one, other = (solid(still(stroll(), 5, backend=backend)) for backend in BACKENDS)
    assert (one & other).sum() / (one | other).sum() > 0.94


def test_a_capsule_has_the_volume_of_a_capsule():
    bones = np.array([[0, 1, 0.2, 0.2]])
    figure = Figure(np.array([[0, 0, 0], [0.6, 0.8, 0.0]]), bones, np.ones(3))
    vertices, normals, triangles = capsules(figure, sides=60, cap=20)
    a, b, c = vertices[triangles].transpose(1, 0, 2)
    volume = (np.cross(a, b) * c).sum() / 6  # divergence theorem: positive if faces look outwards
    assert volume == pytest.approx(np.pi * 0.04 + 4 / 3 * np.pi * 0.008, rel=0.01)
    np.testing.assert_allclose(np.linalg.norm(normals, axis=-1), 1)


@pytest.mark.parametrize("backend", BACKENDS)
def test_still(backend):
    image = still(stroll(), 0, size=(320, 240), backend=backend)
    assert (image.mode, image.size) == ("RGBA", (320, 240))
    alpha = np.asarray(image)[..., 3]
    assert alpha[0].max() == 0, "the background is transparent"
    parts, count = label(solid(image))
    assert count == 1 and np.ptp(np.nonzero(parts)[0]) > 180, "one body, filling the height"
    again = still(stroll(), 0, size=(320, 240), backend=backend)
    assert np.array_equal(np.asarray(image), np.asarray(again))


def test_the_view_is_relative_to_where_the_body_faces():
    # In T-pose the arms are wide from the front and hidden from the side.
    motion = stroll(1)
    front, side = (
        np.ptp(np.nonzero(solid(still(motion, view=view, backend="matplotlib")))[1])
        for view in ("front", "side")
    )
    assert front > 2.5 * side
    turned = motion.rotations.clone()
    turned[:, 0] = torch.tensor([[0.0, 0, 1], [0, 1, 0], [-1, 0, 0]])
    turned = Motion(motion.skeleton, motion.root_positions, turned, 12.0)
    width = np.ptp(np.nonzero(solid(still(turned, view="front", backend="matplotlib")))[1])
    assert width == pytest.approx(front, abs=3)


@pytest.mark.parametrize("backend", BACKENDS)
def test_filmstrip_of_a_body_in_place_sets_poses_apart(backend):
    motion = stroll(speed=0.0)
    strip = filmstrip(motion, [0, 6, 12, 18, 23], width=900, labels=False, backend=backend)
    assert strip.width == 900
    assert label(solid(strip))[1] == 5, "five bodies that do not touch"


def test_filmstrip_of_travel_keeps_true_distances():
    # In T-pose along +z, seen from the side: pelvis widths apart by speed * time.
    motion = stroll(36, speed=1.0)
    strip = filmstrip(motion, [0, 12, 30], labels=False, backend="matplotlib")
    parts, count = label(solid(strip)[: strip.height // 2])
    middles = sorted(np.nonzero(parts == k + 1)[1].mean() for k in range(count))
    assert count == 3
    near, far = np.diff(middles)
    assert far / near == pytest.approx(1.5, rel=0.03)


@pytest.mark.parametrize("backend", BACKENDS)
def test_a_body_far_from_the_origin_makes_the_same_strip(backend):
    """A parallel view whose eye stood among the bodies drew none of them."""
    here, yaw = stroll(36, speed=1.5), torch.tensor(-0.46)  # off the axes
    turn = yaw_matrix(yaw)
    rotations = here.rotations.clone()
    rotations[:, 0] = turn @ rotations[:, 0]
    here = replace(here, rotations=rotations, root_positions=here.root_positions @ turn.T)
    there = replace(here, root_positions=here.root_positions + torch.tensor([-1.2, 0.0, 16.0]))
    near, far = (filmstrip(m, 12, width=600, labels=False, backend=backend) for m in (here, there))
    assert near.size == far.size and solid(near).mean() > 0.02
    assert abs(solid(near).mean() - solid(far).mean()) < 0.002


def scaled(motion: Motion, factor: float) -> Motion:
    body = motion.skeleton
    small = replace(body, offsets=factor * body.offsets, end_offsets=factor * body.end_offsets)
    return replace(motion, skeleton=small, root_positions=factor * motion.root_positions)


@pytest.mark.parametrize("factor", [0.05, 0.001])
def test_metres_read_as_centimetres_make_the_same_picture(factor):
    """Not one bone of such a body is 8 mm long; how large it is, the lines on the floor tell."""
    small = scaled(stroll(), factor)
    bodies = [solid(still(motion, backend="matplotlib")) for motion in (stroll(), small)]
    assert (bodies[0] & bodies[1]).sum() / (bodies[0] | bodies[1]).sum() > 0.95
    large, small = Take.of(stroll()), Take.of(small)
    assert (large.grid, large.body.magnified) == (0.5, 1)
    assert small.grid / small.height == pytest.approx(0.5 / (factor * large.height), rel=1e-3)


def test_a_hand_alone_is_seen():
    names = ("Wrist", "Thumb1", "Thumb2", "Index1", "Index2")
    offsets = 1e-4 * torch.tensor([[0, 0, 0], [8, 0, 2], [3, 0, 0], [8, 0, -2], [3, 0, 0]])
    hand = Skeleton(names, (-1, 0, 1, 0, 3), offsets, (2, 4), 2e-4 * torch.eye(3)[[0, 0]])
    turns = torch.eye(3).expand(2, 5, 3, 3)
    motion = Motion(hand, torch.tensor([[0.0, 0.01, 0.0]]).expand(2, 3), turns, 30)
    for image in (still(motion), filmstrip(motion, 2, width=300)):
        assert solid(image).mean() > 0.02


def test_labels_add_a_band_with_text():
    motion = stroll(speed=0.0)
    plain = filmstrip(motion, 3, labels=False, backend="matplotlib")
    labelled = filmstrip(motion, 3, backend="matplotlib")
    band = np.asarray(labelled)[plain.height :, :, 3]
    assert label(band.max(axis=0) > 0)[1] >= 9, "three times, each of several letters"


def test_a_stack_has_every_picture_under_its_name():
    red, blue = (Image.new("RGBA", (w, 20), c) for w, c in ((60, "red"), (200, "blue")))
    sheet = np.asarray(stack({"one": red, "another": blue}))
    assert sheet.shape[1] == 200
    reds, blues = (np.all(sheet == c, axis=-1) for c in ((255, 0, 0, 255), (0, 0, 255, 255)))
    assert (reds.sum(), blues.sum()) == (60 * 20, 200 * 20)
    between = slice(np.nonzero(reds)[0].max() + 1, np.nonzero(blues)[0].min())
    assert label(sheet[between, :, 3].max(axis=0) > 0)[1] >= 5, "the letters of a name"


def test_contacts_ring_the_feet():
    motion = stroll(contacts=True)
    plain, ringed = (
        np.asarray(still(motion, color="#ff0000", contacts=ring, backend="matplotlib")).astype(int)
        for ring in (False, True)
    )
    redder = (ringed[..., 0] - ringed[..., 2] > 80) & ~(plain[..., 0] - plain[..., 2] > 80)
    assert redder.sum() > 30
    with pytest.raises(ViewerError, match=r"dataclasses\.replace\(motion, contacts="):
        still(stroll(), contacts=True)


def test_positions_are_drawn_like_the_motion():
    motion = stroll()
    positions = motion.positions()
    one = still(motion, 3, backend="matplotlib")
    other = still(positions, 3, skeleton=motion.skeleton, backend="matplotlib")
    assert np.array_equal(np.asarray(one), np.asarray(other))
    with pytest.raises(MotionLabError, match="skeleton"):
        still(positions)


def test_video(tmp_path):
    motion = stroll(12)
    one, two = (video(motion, tmp_path / f"{n}.mp4", size=(96, 64)) for n in "ab")
    frames, seconds = imageio_ffmpeg.count_frames_and_secs(one)
    assert (frames, seconds) == (12, pytest.approx(1.0, abs=0.01))
    assert one.read_bytes() == two.read_bytes()
    half = video(motion, tmp_path / "half.gif", size=(96, 64), fps=6, backend="matplotlib")
    with Image.open(half) as gif:
        assert (gif.n_frames, gif.size) == (6, (96, 64))


@pytest.mark.parametrize(
    "call, message",
    [
        (lambda m: still(m, 24), "24 frames"),
        (lambda m: still(m, view="below"), "three-quarter"),
        (lambda m: still(m, size=(0, 10)), "pixels"),
        (lambda m: still(m, color="blu"), "blu"),
        (lambda m: still(m, backend="povray"), "backend"),
        (lambda m: filmstrip(m, []), "frame"),
        (lambda m: still(m[:0]), "frame"),
        (lambda m: still(m.positions() * torch.nan, skeleton=m.skeleton), "NaN"),
        (lambda m: still(m.positions()[:, 1:], skeleton=m.skeleton), "needs"),
        (lambda m: video(m, "film.avi"), ".mp4"),
        (lambda m: video(m, "film.mp4", size=(33, 32)), "even"),
        (lambda m: video(m, "nodir/film.mp4"), "no folder 'nodir'"),
        (lambda m: video(m, "nodir/film.gif"), "no folder 'nodir'"),
        (lambda m: video(m, "film.mp4", fps=0), "fps is 0"),
        (lambda m: video(m, "film.mp4", fps=-5), "fps is -5"),
        (lambda m: video(m, "film.mp4", fps=float("nan")), "fps is nan"),
        (lambda m: video(m, "film.mp4", fps="30"), "fps is '30'"),
        (lambda m: video(m, "film.mp4", background="blu"), "^background: 'blu'"),
        (lambda m: stack({}), "no picture"),
        (lambda m: filmstrip(m, 0), "0 bodies"),
        (lambda m: filmstrip(m, -1), "-1 bodies"),
        (lambda m: filmstrip(m, 2.5), "2.5 bodies"),
        (lambda m: still(m, 1.5), "frame 1.5 is not a whole number"),
        (lambda m: still([m, m]), "one motion at a time"),
        (lambda m: still(scaled(m, 0.0)), "no bone with a length"),
        (lambda m: still(m, color="blu"), "^color: 'blu'"),
    ],
)
def test_what_cannot_be_drawn_is_said(call, message):
    with pytest.raises(ViewerError, match=message):
        call(stroll())


def test_a_short_motion_makes_a_short_filmstrip():
    strip = filmstrip(stroll(3, speed=0.0), 8, labels=False, backend="matplotlib")
    assert label(solid(strip))[1] == 3


@pytest.fixture
def fresh_probe(monkeypatch):
    monkeypatch.delenv("MOTIONLAB_BACKEND", raising=False)
    for cached in (probe_.why_not, probe_._warn_once):
        cached.cache_clear()
    yield
    for cached in (probe_.why_not, probe_._warn_once):
        cached.cache_clear()


def test_where_vtk_crashes_matplotlib_draws_and_the_remedy_is_named(fresh_probe, monkeypatch):
    monkeypatch.setattr(probe_, "TRIAL", "import os; os.abort()")
    with pytest.warns(UserWarning, match="libegl1.*libosmesa6.*mesalib"):
        image = still(stroll(), size=(64, 48))
    assert solid(image).any()


def test_the_warning_comes_once(fresh_probe, monkeypatch, recwarn):
    monkeypatch.setattr(probe_, "TRIAL", "raise SystemExit(3)")
    assert [probe_.choose() for _ in range(3)] == ["matplotlib"] * 3
    assert len(recwarn) == 1


def test_a_trial_that_hangs_is_given_up(fresh_probe, monkeypatch):
    monkeypatch.setattr(probe_, "TRIAL", "import time; time.sleep(60)")
    monkeypatch.setattr(probe_, "SECONDS", 0.3)
    with pytest.warns(
        UserWarning, match="within 0.3 s, perhaps because the machine is busy"
    ) as said:
        assert probe_.choose() == "matplotlib"
    assert "apt install" not in str(said[0].message) and "MOTIONLAB_BACKEND=vtk" in str(
        said[0].message
    )


def test_without_pyvista_the_remedy_is_to_install_it(fresh_probe, monkeypatch):
    monkeypatch.setattr(probe_, "find_spec", lambda name: None)
    with pytest.warns(UserWarning, match="pip install pyvista"):
        assert probe_.choose() == "matplotlib"


def test_the_environment_can_choose(fresh_probe, monkeypatch):
    monkeypatch.setenv("MOTIONLAB_BACKEND", "matplotlib")
    assert probe_.choose() == "matplotlib"
    assert probe_.choose("vtk") == "vtk"


def test_a_gif_lasts_as_long_as_the_motion(tmp_path):
    motion = Motion(
        Skeleton.canonical(), torch.zeros(30, 3), torch.eye(3).expand(30, 21, 3, 3), fps=30
    )
    path = video(motion, tmp_path / "a.gif", size=(64, 48), backend="matplotlib")
    with Image.open(path) as gif:
        lengths = 0
        for page in range(gif.n_frames):
            gif.seek(page)
            lengths += gif.info["duration"]
    assert lengths == 1000
