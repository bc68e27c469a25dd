"""`motionlab clean --denoise`: what is told, what is written, what the report shows."""

from __future__ import annotations

import re
from dataclasses import replace

import any_rig
import pytest
import rig_names
import torch

from motionlab import Motion, corrupt, read_bvh, write_bvh
from motionlab.__main__ import main
from motionlab.commands.clean_report import write_report
from motionlab.datasets import gaits
from motionlab.solvers.denoise_seen import held_frames

WALK = gaits.make(seconds=2, speed=1.2, name="walk")
WILD = [20, 41]


def with_wild(motion):
    """Two frames in which the body is elsewhere."""
    places = motion.root_positions.clone()
    places[WILD] += torch.tensor([0.6, 0.0, 0.4])
    return replace(motion, root_positions=places)


def knees(motion):
    """Angles (frames, 2) of both knees; 0 is straight."""
    points, role = motion.positions(), motion.skeleton.role
    found = []
    for side in ("left", "right"):
        hip, knee, foot = (
            points[:, role(f"{side}_{part}")] for part in ("upper_leg", "lower_leg", "foot")
        )
        cosine = torch.cosine_similarity(knee - hip, foot - knee, dim=-1)
        found.append(cosine.clamp(-1, 1).arccos().rad2deg())
    return torch.stack(found, 1)


def test_frames_that_jump_are_told_and_alone_changed(here, capsys):
    write_bvh(with_wild(WALK), "wild.bvh")
    assert (
        main(["clean", "wild.bvh", "--denoise", "auto", "--out", "x.bvh", "--report", "x.html"])
        == 0
    )
    said = capsys.readouterr().out
    assert "2 frames not believed (20, 41)" in said and "only these frames were changed" in said
    near, far = map(
        float, re.search(r"by up to ([\d.]+) cm, those .* by ([\d.]+) cm", said).groups()
    )
    assert near < 1 and 60 < far < 90
    moved = (read_bvh("x.bvh").positions() - WALK.positions()).norm(dim=-1).amax(1)
    assert moved.max() < 0.05
    moved[WILD] = 0
    assert moved.max() < 1e-4
    page = (here / "x.html").read_text()
    assert "2 frames that were not believed" in page and page.count('class="wild"') >= 2


def held(motion, first=25, after=37):
    """A stretch that a program wrote as the last frame before it, as cameras had lost the body."""
    before = torch.arange(len(motion))
    before[first:after] = first - 1
    return replace(
        motion,
        root_positions=motion.root_positions[before],
        rotations=motion.rotations[before],
        contacts=None,
    )


def test_a_pose_that_is_held_while_cameras_tremble_is_filled(here, capsys):
    seen = corrupt.tremble(WALK, 0.01, 0.03, generator=torch.Generator().manual_seed(0))
    write_bvh(held(seen), "held.bvh")
    assert main(["clean", "held.bvh", "--denoise", "auto", "--out", "x.bvh"]) == 0
    said = capsys.readouterr().out
    assert "12 frames not believed, as all is held there and trembles elsewhere (25, 26, 27" in said
    off = lambda file: (
        100 * (read_bvh(file).positions() - WALK.positions())[25:37].norm(dim=-1).mean()
    )
    assert off("x.bvh") < 0.5 * off("held.bvh")


def test_a_pose_that_is_held_in_a_calm_clip_may_be_somebody_who_stands(here, capsys):
    write_bvh(held(WALK), "held.bvh")
    assert main(["clean", "held.bvh", "--denoise", "auto", "--out", "x.bvh"]) == 0
    assert "held there" not in capsys.readouterr().out


def test_a_pose_that_is_held_to_the_end_is_none_that_was_lost():
    seen = corrupt.tremble(WALK, 0.01, 0.03, generator=torch.Generator().manual_seed(0))
    assert held_frames(held(seen, 30, 40)).nonzero()[:, 0].tolist() == [*range(30, 40)]
    assert not held_frames(held(seen, 50, len(seen))).any()
    assert not held_frames(seen).any() and not held_frames(held(seen, 1, len(seen))).any()


def test_a_reference_tells_how_a_rig_stands(here, capsys):
    """A handstand on a rig whose rest pose is no body: its own frames say that the head is below."""
    axes = any_rig.random_axes(21, 4)
    stance = Motion(WALK.skeleton, torch.zeros(9, 3), torch.eye(3).repeat(9, 21, 1, 1), 30)
    upside = torch.diag(torch.tensor([1.0, -1.0, -1.0]))
    turned = WALK.rotations.clone()
    turned[:, 0] = upside @ turned[:, 0]
    on_hands = replace(WALK, rotations=turned, contacts=None)
    noisy = corrupt.tremble(on_hands, 0.01, 0.03, generator=torch.Generator().manual_seed(0))
    write_bvh(any_rig.drawn(noisy, axes), "hands.bvh")
    write_bvh(any_rig.drawn(stance, axes), "stands.bvh")
    names = [f"its{name}" for name in WALK.skeleton.names]
    write_bvh(rig_names.renamed(WALK, names), "other.bvh")
    command = ["clean", "hands.bvh", "--denoise", "auto", "--out", "x.bvh", "--force"]
    assert main(command) == 0
    assert "pass --reference, a motion" in capsys.readouterr().out
    assert main([*command, "--reference", "stands.bvh"]) == 0
    assert "--reference" not in capsys.readouterr().out
    assert main([*command, "--reference", "other.bvh"]) == 1
    assert "The reference other is of another rig" in capsys.readouterr().err
    assert main(["clean", "hands.bvh", "--out", "y.bvh", "--reference", "stands.bvh"]) == 1
    assert "goes with --denoise" in capsys.readouterr().err


def test_three_frames_are_refused_in_words(here, capsys):
    write_bvh(WALK[:3], "short.bvh")
    assert main(["clean", "short.bvh", "--denoise", "auto", "--out", "x.bvh"]) == 1
    said = capsys.readouterr().err
    assert "Clip 'short' has 3 frames, too few to tell noise from motion; 8 are needed" in said
    assert "Motion(" not in said


@pytest.mark.parametrize(("units", "hint"), [("m", "--units=mm"), ("mm", "--units=m.")])
def test_a_body_of_no_ones_size_is_told_of_a_unit_that_mends_it(units, hint, here, capsys):
    write_bvh(WALK, "walk.bvh")
    assert (
        main(["clean", "walk.bvh", "--denoise", "auto", f"--units={units}", "--out", "x.bvh"]) == 1
    )
    said = capsys.readouterr().err
    assert hint in said and "read_bvh" not in said and "frame/s" not in said


def test_feet_that_are_held_after_it_leave_knees_as_they_are(here):
    """Legs nearly straight, on a rig that is no other's: the body does not come down for its feet."""
    skeleton = WALK.skeleton
    legs = torch.tensor(["Leg" in name or "Foot" in name for name in skeleton.names])
    rig = replace(skeleton, offsets=torch.where(legs[:, None], 1.12, 0.97) * skeleton.offsets)
    truth = replace(WALK, skeleton=rig, root_positions=1.1 * WALK.root_positions, contacts=None)
    seen = corrupt.tremble(truth, 0.01, 0.04, generator=torch.Generator().manual_seed(0))
    write_bvh(seen, "noisy.bvh")
    assert main(["clean", "noisy.bvh", "--denoise", "auto", "--out", "calm.bvh"]) == 0
    assert main(["clean", "noisy.bvh", "--denoise", "auto", "--feet", "--out", "held.bvh"]) == 0
    calm, held = read_bvh("calm.bvh"), read_bvh("held.bvh")
    off = lambda motion: 100 * float((motion.positions() - truth.positions()).norm(dim=-1).mean())
    assert off(held) < off(calm) + 0.3 < off(seen)
    assert (knees(held) - knees(calm)).abs().mean() < 5
    assert (held.root_positions - calm.root_positions)[:, 1].min() > -0.015


def test_a_true_walk_is_left_as_it_is_within_millimetres(here):
    """Toes rise and sink a little as feet roll: no reason for the body to come down, nor for knees to pop."""
    bobs = 0.012 * torch.sin(5 * torch.pi * torch.arange(len(WALK)) / WALK.fps)
    slides = 0.006 * torch.sin(3 * torch.pi * torch.arange(len(WALK)) / WALK.fps)
    moves = torch.stack([slides, bobs, slides], 1)
    truth = replace(WALK, root_positions=WALK.root_positions + moves, contacts=None)
    write_bvh(truth, "true.bvh")
    assert main(["clean", "true.bvh", "--out", "x.bvh"]) == 0
    truth, found = read_bvh("true.bvh"), read_bvh("x.bvh")
    assert (found.root_positions - truth.root_positions).abs().max() < 0.007
    assert (found.positions() - truth.positions()).norm(dim=-1).mean() < 0.006
    assert (knees(found) - knees(truth)).abs().mean() < 3
    steps = lambda its: knees(its).diff(dim=0).abs().max()
    assert steps(found) < 1.05 * steps(truth)


@pytest.mark.parametrize("wild", [[], WILD])
def test_curves_are_scaled_by_frames_that_were_believed(wild, tmp_path):
    """A frame that is 72 cm off would press a tremble of a centimetre flat; the table leaves it out."""
    seen = corrupt.tremble(WALK, 0.01, 0.0, generator=torch.Generator().manual_seed(0))
    write_report(with_wild(seen), WALK, ["said"], tmp_path / "x.html", wild)
    page = (tmp_path / "x.html").read_text()
    highest = float(re.search(r'<span class="high">(\d+) cm', page)[1])
    most = [
        float(row) for row in re.findall(r"<tr><td>[^<]+</td><td>[\d.]+</td><td>([\d.]+)", page)
    ]
    assert len(most) == WALK.skeleton.joints
    assert (highest < 5 and max(most) < 5) if wild else (highest > 60 and min(most) > 60)
