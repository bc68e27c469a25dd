"""What a foot that stands tells: flat feet from those on their toes, and contact from hovering."""

from __future__ import annotations

from dataclasses import replace

import pytest
import roma
import torch

from motionlab.feet.planting import Foot, Sole, find_contacts, let_go, levelled, plant

FPS, FRAMES = 30, 60
SOLE = torch.tensor([0.0, -0.0749, 0.0906])


def pitched(degrees: float, frames: int = FRAMES) -> torch.Tensor:
    """Orientations (frames, 3, 3) whose toes point down by so much."""
    angle = torch.full((frames,), float(degrees))
    return roma.euler_to_rotmat("X", angle[:, None], degrees=True)


def standing(*feet: torch.Tensor, lift: float = 0.0) -> tuple[torch.Tensor, torch.Tensor]:
    """Ankles and toes (2, frames, 3) of feet whose toes rest side by side, one perhaps higher."""
    toes = torch.tensor([[0.1, 0.025, 0.0], [-0.1, 0.025 + lift, 0.0]])[:, None].expand(
        2, FRAMES, 3
    )
    reach = torch.stack([foot @ SOLE for foot in feet])
    return toes - reach, toes


def pitch(feet: torch.Tensor) -> torch.Tensor:
    """Degrees (2, frames) by which toes point down."""
    return -torch.rad2deg(torch.atan2(feet[..., 1, 2], feet[..., 1, 1]))


@pytest.mark.parametrize("tilt", [-20.0, 0.0, 12.0])
def test_a_foot_that_stands_flat_is_made_level(tilt):
    feet = (pitched(tilt), pitched(tilt))
    found = levelled(torch.stack(feet), *standing(*feet), FPS)
    assert pitch(found).abs().max() < 0.1


@pytest.mark.parametrize("stance", [None, torch.zeros(2)])
@pytest.mark.parametrize("raised", [25.0, 45.0, 80.0, 120.0])
def test_a_foot_on_its_toes_teaches_nothing(stance, raised):
    """It was turned by what it stood like: by 60 to 170 degrees in every frame of a dance."""
    feet = (pitched(0), pitched(raised))
    found = levelled(torch.stack(feet), *standing(*feet), FPS, stance)
    assert (pitch(found) - torch.tensor([[0.0], [raised]])).abs().max() < 0.1


def test_both_feet_on_their_toes_are_level_as_in_the_stance():
    feet = (pitched(60), pitched(70))
    stance = torch.deg2rad(torch.tensor([10.0, 12.0]))  # so much toes point up while it stands
    found = levelled(torch.stack(feet), *standing(*feet), FPS, stance)
    assert (pitch(found) - torch.tensor([[70.0], [82.0]])).abs().max() < 0.1


def test_a_foot_flat_for_a_while_is_level_then_though_it_mostly_stands_on_its_toes():
    foot = torch.cat([pitched(-10, 20), pitched(15, 40)])
    found = levelled(torch.stack([foot, foot]), *standing(foot, foot), FPS)
    assert pitch(found)[:, :20].abs().max() < 0.1


@pytest.mark.parametrize(("lift", "touches"), [(0.0, True), (0.03, True), (0.12, False)])
def test_a_foot_held_still_in_the_air_does_not_touch(lift, touches):
    feet = torch.stack([pitched(0), pitched(0)])
    contacts = find_contacts(*standing(*feet, lift=lift), feet, torch.zeros(FRAMES), FPS)
    assert contacts[0].all()
    assert bool(contacts[1].any()) == touches


def test_toes_that_scrape_the_floor_in_a_swing_go_up_and_the_leg_stays_as_it_was():
    sole = Sole(SOLE, torch.tensor([0.0, 0.0, 0.06]), torch.tensor([0.1, 0.0251]))
    height = torch.full((FRAMES,), 0.1)
    height[20:40] = 0.115  # in the air, toes pointing down so far that they would be in the floor
    foot = pitched(0).clone()
    foot[20:40] = pitched(20, 20)
    ankle = torch.stack([0 * height, height, 0 * height], 1)
    contacts = torch.ones(FRAMES, 2, dtype=torch.bool)
    contacts[20:40] = False
    hip = torch.tensor([0.0, 0.8, 0.0]).expand(FRAMES, 3)
    stretch = (hip - ankle).norm(dim=-1)
    found = let_go(plant(ankle, foot, foot, contacts, sole), hip, stretch, 0.8, FPS)
    assert ((hip - found.ankle).norm(dim=-1) - stretch).abs().max() < 1e-3
    assert (found.ankle + found.reach)[:, 1].min() > 0.025


def on_toes_after_heels() -> tuple[Foot, torch.Tensor, torch.Tensor]:
    """A foot that stands flat, then on its toes, under hips too low for the leg that is wanted; and
    the hips, and how long the leg should be."""
    contacts = torch.ones(FRAMES, 2, dtype=torch.bool)
    contacts[30:, 0] = False
    ankle = torch.tensor([0.0, 0.1, 0.0]).expand(FRAMES, 3)
    sole = Sole(SOLE, torch.tensor([0.0, 0.0, 0.06]), torch.tensor([0.1, 0.0251]))
    hip = torch.tensor([0.0, 0.86, 0.05]).expand(FRAMES, 3)
    stretch = (hip - ankle).norm(dim=-1) - 0.015  # which the heel, risen, would give at once
    return plant(ankle, pitched(0), pitched(0), contacts, sole), hip, stretch


def test_a_heel_that_may_rise_takes_its_time():
    planted, hip, stretch = on_toes_after_heels()
    found = let_go(planted, hip, stretch, 0.8, FPS)
    step = (hip - found.ankle).norm(dim=-1).diff().abs()
    assert step.max() < 0.006  # of 15 mm
    assert ((hip - found.ankle).norm(dim=-1) - stretch)[40:].abs().max() < 1e-3
    toe = found.ankle + found.reach
    assert toe.diff(dim=0).norm(dim=-1).max() < 1e-4


def test_one_touch_of_the_toes_turns_no_foot_long_before():
    planted, hip, stretch = on_toes_after_heels()
    contacts = torch.zeros(FRAMES, 2, dtype=torch.bool)
    contacts[50, 1] = True
    planted = replace(planted, contacts=contacts)
    found = let_go(planted, hip, stretch, 0.8, FPS)
    assert abs(pitch(found.foot)[50]) > 5
    assert pitch(found.foot)[:34].abs().max() < 0.1


def test_a_heel_sinks_into_no_floor_to_make_a_leg_longer():
    """It was lifted out of it again, and took along the toes that were to rest."""
    planted, hip, stretch = on_toes_after_heels()
    found = let_go(planted, hip, stretch + 0.045, 0.85, FPS)
    toe = found.ankle + found.reach
    assert toe.diff(dim=0).norm(dim=-1).max() < 1e-4
    assert found.contacts[:, 1].all()
