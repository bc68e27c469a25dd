"""How a flat foot looks is told by the frames in which one rests, of a clip or of all clips."""

from __future__ import annotations

import pytest
import torch
from pitched_feet import FPS, pitch, pitched, standing

from motionlab.feet.flat import flat_pitch, levelled, resting


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


def test_a_foot_on_its_heel_teaches_nothing():
    """Toes up, ankle no lower: dancers stand so, and every other frame was turned by that."""
    foot = torch.cat([pitched(0, 30), pitched(-12, 30)])
    ankles, toes = standing(foot, foot)
    toes = toes + ankles[:, :1] - ankles  # ankles rest, toes rise
    ankles = ankles[:, :1].expand_as(toes)
    found = levelled(torch.stack([foot, foot]), ankles, toes, FPS)
    assert pitch(found)[:, :30].abs().max() < 0.1


def test_clips_of_one_body_tell_together_and_a_long_one_counts_no_more():
    clips = []
    for degrees, frames in ((12, 60), (-8, 20), (-7, 15)):
        feet = (pitched(degrees), pitched(degrees))
        clips.append([its[:frames] for its in resting(torch.stack(feet), *standing(*feet), FPS)])
    for some, degrees in ((clips, 7), (clips[::-1], 7), (clips[:2], 8), (clips[:1], -12)):
        assert torch.rad2deg(flat_pitch(some, FPS)).tolist() == pytest.approx(
            [degrees] * 2, abs=0.1
        )
    assert flat_pitch([[its[:2] for its in clips[0]]], FPS) is None
    assert flat_pitch([], FPS) is None
