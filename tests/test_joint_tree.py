"""Which joint is which where names do not tell: limbs by their place in the tree and their bones."""

from __future__ import annotations

import itertools
import warnings
from dataclasses import replace

import pytest
import rig_names
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from motionlab import Skeleton, roles
from motionlab.datasets import gaits

CANONICAL = Skeleton.canonical()
ARM = {"shoulder": 0.15, "upper_arm": 0.12, "lower_arm": 0.3, "hand": 0.26}
CROWNS = [(), (0.1,), (0.1, 0.08), (0.1, 0.08, 0.18), (0.05, 0.07, 0.05), (0.05,) * 4]
LEG = {"upper_leg": 0.1, "lower_leg": 0.42, "foot": 0.44, "toes": 0.15}


def rig(
    arm: dict, leg: dict, spine: int = 3, other: dict | None = None, crown: tuple = ()
) -> tuple[list, ...]:
    """Joints (name, parent, length of offset) of a body whose names tell sides and no more; and the
    roles that they should have. arm, leg : length by role; a role after a *
    is none; crown : lengths of what goes up from the chest."""
    names, parents, lengths, wanted = ["b0"], [-1], [0.0], {"hips": 0}

    def hang(parent: int, parts: dict, side: str) -> None:
        for part, length in parts.items():
            if not part.startswith("*"):
                wanted[f"{'left' if side == 'L' else 'right'}_{part}"] = len(names)
            names.append(f"b{len(names)}_{side}")
            parents.append(parent)
            lengths.append(length)
            parent = len(names) - 1

    for _ in range(spine):
        names.append(f"b{len(names)}")
        parents.append(len(names) - 2)
        lengths.append(0.15)
    wanted |= {"spine": 1, "chest": spine} if spine > 1 else {"chest": spine}
    for side in "LR":
        hang(0, leg, side)
        hang(spine, (other or arm) if side == "R" else arm, side)
    above = spine
    for length in crown:
        names.append(f"b{len(names)}")
        parents.append(above)
        lengths.append(length)
        above = len(names) - 1
    if len(crown) == 2 or len(crown) == 3 and crown[2] > crown[1]:
        wanted |= {"neck": len(names) - len(crown), "head": len(names) - len(crown) + 1}
    return names, parents, lengths, wanted


@settings(max_examples=60, deadline=None)
@given(st.data())
def test_limbs_are_told_by_their_bones(data):
    """With or without collar, hip joint, toes and tips; long bones of some variety."""
    pick = lambda *of: data.draw(st.sampled_from(of))
    stretch = st.floats(0.94, 1.06)
    arm = {part: length * data.draw(stretch) for part, length in ARM.items()}
    leg = {part: length * data.draw(stretch) for part, length in LEG.items()}
    if pick(True, False):
        del arm["shoulder"]
    if pick(True, False):
        del leg["toes"]
    if pick(True, False):
        leg = {"*hip": 0.08} | leg
    arm |= pick({}, {"*tip": 0.15}, {"*knuckle": 0.1, "*tip": 0.1})
    leg |= pick({}, {"*tip": 0.08}) if "toes" in leg else {}
    names, parents, lengths, wanted = rig(arm, leg, pick(1, 2, 4), crown=pick(*CROWNS))
    found = roles.find(names, parents, None, lengths)
    assert found == wanted and {*found.placed} <= {*wanted}
    assert "left_upper_leg" not in roles.find(names, parents)  # names alone tell nothing


@pytest.mark.parametrize(
    ("arm", "leg", "why"),
    [
        (ARM, {"*a": 0.1, "*b": 0.21, "*c": 0.21, "*d": 0.44, "*e": 0.15}, "a thigh in two"),
        (ARM, {"*a": 0.1, "*b": 0.21, "*c": 0.21, "*d": 0.22, "*e": 0.22}, "both in two"),
        (ARM, {"*a": 0.1, "*b": 0.3}, "a leg of two joints"),
        (ARM, {"*a": 0.1, "*b": 0.42, "*c": 0.31, "*d": 0.13, "*e": 0.15}, "a joint in the shin"),
        (ARM, {"*a": 0.1, "*b": 0.42, "*c": 0.36, "*d": 0.06, "*e": 0.15}, "one at its end"),
        (ARM, {"*a": 0.1, "*b": 0.42, "*c": 0.36, "*d": 0.06}, "and no toes"),
        ({"*a": 0.1, "*b": 0.1, "*c": 0.1, "*d": 0.1}, LEG, "bones that are all alike"),
    ],
)
def test_what_leaves_a_choice_is_left_open(arm, leg, why):
    names, parents, lengths, _ = rig(arm, leg)
    assert not {"left_upper_leg", "left_upper_arm"} & {*roles.find(names, parents, None, lengths)}


def test_sides_that_differ_are_left_open():
    names, parents, lengths, _ = rig(ARM, LEG, other={"*tip": 0.1, **ARM, "*a": 0.1})
    found = roles.find(names, parents, None, lengths)
    assert "left_upper_arm" in found  # a joint more before the collar changes nothing
    without = {part: length for part, length in ARM.items() if part != "shoulder"}
    names, parents, lengths, _ = rig(ARM, LEG, other=without)
    assert "left_upper_arm" not in roles.find(names, parents, None, lengths)


def test_limbs_on_one_joint_are_left_open():
    names, parents, lengths, _ = rig(ARM, LEG, spine=0)
    assert "left_upper_leg" not in roles.find(names, parents, None, lengths)


def test_a_clear_word_in_another_place_wins():
    """A chain whose third joint is called a knee is no leg as its bones have it."""
    names, parents, lengths, wanted = rig(ARM, LEG)
    for side, end in (("left", "_L"), ("right", "_R")):
        names[wanted[f"{side}_foot"]] = "knee" + end
    found = roles.find(names, parents, None, lengths)
    assert "left_upper_leg" not in found and "left_upper_arm" in found


@pytest.mark.parametrize(
    ("names", "wanted"),
    [
        ("leg_0 leg_1 leg_end foot_0", "upper_leg lower_leg foot toes"),
        ("thigh shin b17 foot", "upper_leg lower_leg foot toes"),
        ("shoulder biceps2 forearm hand", "shoulder upper_arm lower_arm hand"),
        ("shoulder upperarm forearm hand", "shoulder upper_arm lower_arm hand"),
        ("hip shin foot toe", "upper_leg lower_leg foot toes"),
        ("thigh shin toe b1", "upper_leg lower_leg toes -"),
    ],
)
def test_bones_settle_what_words_leave_open(names, wanted):
    """A shoulder is a collar or an upper arm, a foot the ankle's joint or the toes below it."""
    parts = names.split()
    whole = [*CANONICAL.names]
    at = CANONICAL.role("left_shoulder" if "shoulder" in parts else "left_upper_leg")
    whole[at : at + 8] = [f"{part}_{side}" for side in "LR" for part in parts]
    found = {
        joint: role for role, joint in replace(CANONICAL, names=whole, roles=None).roles.items()
    }
    assert [found.get(at + i, "left_-") for i in range(4)] == [f"left_{p}" for p in wanted.split()]


def test_what_is_said_of_a_limb_and_fits_leaves_the_rest_to_the_bones():
    names, parents, lengths, wanted = rig(ARM, LEG)
    some = {role: names[wanted[role]] for role in ("left_toes", "right_foot", "left_hand")}
    assert roles.find(names, parents, some, lengths) == wanted
    none = roles.find(names, parents, {"left_toes": ""}, lengths)
    assert none == {role: joint for role, joint in wanted.items() if role != "left_toes"}
    other = {"left_foot": names[wanted["left_toes"]]}  # which the bones do not bear out
    found = roles.find(names, parents, other, lengths)
    assert "left_upper_leg" not in found and found["left_hand"] == wanted["left_hand"]


def test_chains_of_one_word_and_a_number():
    """Also where the word is a known one: leg_L_01 to leg_L_04, arm_L_01 to arm_L_04."""
    names = [*CANONICAL.names[:5]]
    for limb, side in itertools.product(("arm", "leg"), "LR"):
        names += [f"{limb}_joint_{side}_{number}" for number in range(1, 5)]
    skeleton = replace(CANONICAL, names=names, roles=None)
    assert skeleton.roles == CANONICAL.roles
    bent = replace(skeleton, offsets=100 * skeleton.offsets)  # in centimetres, too
    assert bent.roles == CANONICAL.roles
    flat = replace(skeleton, offsets=torch.zeros(21, 3))
    assert not {"left_foot", "left_upper_arm", "left_upper_leg"} & {
        *flat.roles
    }  # nor by their words


@pytest.mark.parametrize("convention", rig_names.FOREIGN)
def test_foreign_names_are_understood_and_that_is_told(convention):
    gait = gaits.make(seconds=1, turn_rate=0.5)
    large = replace(gait.skeleton, offsets=1.1 * gait.skeleton.offsets)
    gait = replace(gait, skeleton=large, root_positions=1.1 * gait.root_positions)
    motion = rig_names.renamed(gait, rig_names.names_of(rig_names.FOREIGN[convention]))
    assert motion.skeleton.roles == CANONICAL.roles
    assert motion.skeleton.mirror_partners == CANONICAL.mirror_partners
    with pytest.warns(
        UserWarning, match="by the lengths of bones it is .*left_foot = .*roles=, with a table"
    ):
        found = motion.retarget()
    assert torch.equal(found.positions(), gait.retarget().positions())
    told = {role: motion.skeleton.names[joint] for role, joint in motion.skeleton.roles.items()}
    said = replace(motion, skeleton=replace(motion.skeleton, roles=told))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        said.retarget()


def test_long_chains_take_no_long_time():
    """Each joint of the other side than the one above it, so that a limb may begin anywhere."""
    names = [f"b{joint}_{'LR'[joint % 2]}" for joint in range(1500)]
    assert "left_foot" not in roles.find(names, range(-1, 1499), None, [1.0] * 1500)


def test_words_of_other_alphabets_have_no_letters_left_alone():
    assert roles.sided(["Rücken", "Länge", "Épaule.L"]) == (False, False, True)
