"""What a foot that stands tells: contact from hovering; and what is held, and let go of."""

from __future__ import annotations

from dataclasses import replace

import pytest
import roma
import torch
from pitched_feet import FPS, FRAMES, SOLE, pitch, pitched, standing

from motionlab.feet.planting import Foot, Sole, find_contacts, let_go, plant


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
    found = let_go(plant(ankle, foot, foot, contacts, sole, FPS), hip, stretch, 0.8, FPS)
    assert ((hip - found.ankle).norm(dim=-1) - stretch).abs().max() < 1e-3
    assert (found.ankle + found.reach)[:, 1].min() > 0.025


def test_what_turns_a_flat_foot_is_forgotten_in_the_air():
    """A dancer's foot, seconds in the air, was off by what its last stance was."""
    contacts = torch.zeros(10 * FPS, 2, dtype=torch.bool)
    contacts[:FPS] = True
    drawn = pitched(15, len(contacts))
    ankle = torch.tensor([0.0, 0.1, 0.0]).expand(len(contacts), 3)
    sole = Sole(SOLE, torch.tensor([0.0, 0.0, 0.06]), torch.tensor([0.1, 0.0251]))
    turned = torch.rad2deg(roma.rotmat_geodesic_distance(
        plant(ankle, drawn, drawn, contacts, sole, FPS).foot, drawn
    ))  # fmt: skip
    assert (turned[:FPS] - 15).abs().max() < 0.1 and turned[2 * FPS :].max() < 0.1
    assert turned.diff().abs().max() < 1  # degrees in a frame


def on_toes_after_heels() -> tuple[Foot, torch.Tensor, torch.Tensor]:
    """A foot that stands flat, then on its toes, under hips too low for the leg that is wanted; and
    the hips, and how long the leg should be."""
    contacts = torch.ones(FRAMES, 2, dtype=torch.bool)
    contacts[30:, 0] = False
    ankle = torch.tensor([0.0, 0.1, 0.0]).expand(FRAMES, 3)
    sole = Sole(SOLE, torch.tensor([0.0, 0.0, 0.06]), torch.tensor([0.1, 0.0251]))
    hip = torch.tensor([0.0, 0.86, 0.05]).expand(FRAMES, 3)
    stretch = (hip - ankle).norm(dim=-1) - 0.015  # which the heel, risen, would give at once
    return plant(ankle, pitched(0), pitched(0), contacts, sole, FPS), hip, stretch


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
