"""What is said of motion that a command brought to a rig."""

from __future__ import annotations

from dataclasses import replace

from motionlab.commands.rig import brought_onto
from motionlab.datasets import gaits


def test_what_dips_below_the_floor_is_told():
    """Feet are kept on the floor; hands of a body with arms three times as long are not."""
    walk = gaits.make(seconds=1)
    offsets, roles = walk.skeleton.offsets.clone(), walk.skeleton.roles
    for side in ("left", "right"):
        for part in ("lower_arm", "hand"):
            offsets[roles[f"{side}_{part}"]] *= 3
    ape = replace(walk, skeleton=replace(walk.skeleton, offsets=offsets), name="ape")
    moved, said = brought_onto(walk, ape)
    hands = [roles["left_hand"], roles["right_hand"]]
    lowest = -100 * moved.positions()[:, hands, 1].min()
    assert lowest > 10
    assert len(said) == 2 and said[1].endswith(" s)")
    assert f"Hand up to {lowest:.0f} cm below the floor (at 0." in said[1]
    assert len(brought_onto(ape, None)[1]) == 1  # on arms of a person's length they are above it
    assert len(brought_onto(walk, replace(ape, skeleton=walk.skeleton))[1]) == 1
