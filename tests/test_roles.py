"""Which joint is which: by names as programs write them, by the tree, and as it is said."""

from __future__ import annotations

from dataclasses import replace

import pytest
import rig_names
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from motionlab import Motion, Skeleton, contacts, joint_names, roles
from motionlab.datasets import gaits
from motionlab.errors import RetargetError, SkeletonError

CANONICAL = Skeleton.canonical()


@pytest.fixture(scope="module")
def gait() -> Motion:
    """On a body of another size, so that retargeting has something to do."""
    walk = gaits.make(seconds=1, turn_rate=0.5)
    body = replace(walk.skeleton, offsets=1.1 * walk.skeleton.offsets)
    return replace(walk, skeleton=body, root_positions=1.1 * walk.root_positions)


# -- names ----------------------------------------------------------------------------------------


@pytest.mark.parametrize("convention", rig_names.CONVENTIONS)
def test_every_convention_is_understood(gait, convention):
    motion = rig_names.renamed(gait, rig_names.names_of(rig_names.CONVENTIONS[convention]))
    assert motion.skeleton.roles == CANONICAL.roles
    assert motion.skeleton.mirror_partners == CANONICAL.mirror_partners
    assert torch.equal(motion.mirror().positions(), gait.mirror().positions())  # and no warning
    # SMPL-X calls toes left_foot: that is a name here, and no role
    assert torch.equal(contacts.label(motion), contacts.label(gait))


@pytest.mark.parametrize("name", rig_names.RIGS)
def test_whole_rigs(name):
    skeleton, wanted = rig_names.rig(rig_names.RIGS[name])
    assert {role: skeleton.names[joint] for role, joint in skeleton.roles.items()} == wanted
    partners = skeleton.mirror_partners
    assert [partners[p] for p in partners] == list(range(skeleton.joints))
    assert not skeleton.without_partner
    assert skeleton.joints - sum(p == j for j, p in enumerate(partners)) >= 12


@pytest.mark.parametrize(
    "pair",
    "LeftUpLeg/RightUpLeg leftUpLeg/rightUpLeg lUpLeg/rUpLeg LUpLeg/RUpLeg UpLeg_L/UpLeg_R "
    "upleg.l/upleg.r l_upleg/r_upleg rig:LeftUpLeg/rig:RightUpLeg lft_leg/rgt_leg Leg_LT/Leg_RT "
    "LF_Arm/RT_Arm lf-knee/rt-knee upper_arm.L.001/upper_arm.R.001 LUArm/RUArm LFArm/RFArm "
    "lshoulder/rshoulder lftthigh/rgtthigh lthumb/rthumb lhandthumb/rhandthumb LEFT_EYE/RIGHT_EYE "
    "LFOOT/RFOOT Bip01~L~Thigh/Bip01~R~Thigh Bip01FBXASC032LFBXASC032Toe0/Bip01FBXASC032RFBXASC032Toe0 thighL/thighR lMid1/rMid1 "
    "leftSword/rightSword LeftHandIndex1/RightHandIndex1 lLeg/rLeg lhipjoint/rhipjoint".split(),
)
def test_sides(pair):
    names = pair.replace("~", " ").split("/")
    assert roles.sided(names) == (True, True) and roles.partners(names, {}) == (1, 0)
    assert joint_names.readings(tuple(names))[0][0] == "left"


@pytest.mark.parametrize(
    "name",
    "ROOT root LowerLeg lowerleg Lumbar lumbar ribs Ribs rear Rear L5 R L lips Reference roll "
    "LowerBack Collar shoulder skull rump tail left right Rlook head_L_R".split(),
)
def test_no_sides(name):
    assert roles.sided([name]) == (False,)


def test_every_word_is_in_the_documentation():
    said = set(roles.__doc__.replace(",", " ").replace(";", " ").split())
    words = {*joint_names.LIMB_OF, *joint_names.TRUNK_OF}
    assert len(words) > 60 and words <= said


def test_names_that_say_more_have_no_role():
    names = (
        "Hips LeftHandThumb1 LeftFootIK LeftKneePole ik_foot_l HeadTop_End LeftToe_End hand_prop"
    )
    assert roles.find(names.split(), [-1] + [0] * 7) == {"hips": 0}


def test_names_of_other_letters_and_endless_ones():
    names = ["нога", "πόδι", "", "l" + "toebase" * 40 + "q", "::", "123"]
    assert roles.find(names, [-1, 0, 0, 0, 0, 0]) == {}
    assert roles.partners(names, {}) == tuple(range(6))
    chain = [f"left_leg_{i}" for i in range(2000)]
    assert roles.find(chain, range(-1, 1999)) == {}  # which of them?
    assert len(roles.find(chain[:2], [-1, 0])) == 2


# -- the tree -------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("chain", "wanted"),
    [
        ("thigh leg foot toe", "upper_leg lower_leg foot toes"),
        ("leg shin foot toe", "upper_leg lower_leg foot toes"),
        ("leg knee ankle foot", "upper_leg lower_leg foot toes"),
        ("hip leg ankle foot", "upper_leg lower_leg foot toes"),
        ("hip knee foot ball", "upper_leg lower_leg foot toes"),
        ("hip thigh knee ankle", "- upper_leg lower_leg foot"),
        ("thigh shin ankle foot toe", "upper_leg lower_leg foot - toes"),
        ("leg1 leg2 foot toe", "upper_leg lower_leg foot toes"),
        ("thigh calf b17 ball", "upper_leg lower_leg foot toes"),
        ("thigh b17 ankle toe", "upper_leg lower_leg foot toes"),
        ("thigh b1 b2 toe", "upper_leg - - toes"),
        ("clavicle b1 forearm hand", "shoulder upper_arm lower_arm hand"),
        ("leg foot", "lower_leg foot"),
        ("shoulder arm forearm hand", "shoulder upper_arm lower_arm hand"),
        ("collar shoulder elbow wrist hand", "shoulder upper_arm lower_arm hand -"),
        ("shoulder elbow wrist", "upper_arm lower_arm hand"),
        ("collar shoulder", "shoulder upper_arm"),
        ("shoulder", "shoulder"),
        ("shoulder hand", "shoulder hand"),
        ("shoulder upperarm", "shoulder upper_arm"),
        ("clavicle scapula arm elbow hand", "shoulder - upper_arm lower_arm hand"),
        ("upperarm arm hand", "upper_arm lower_arm hand"),
        ("shoulder upperarm upperarm_twist forearm forearm_roll hand",
         "shoulder upper_arm - lower_arm - hand"),
    ],
)  # fmt: skip
def test_limbs_down_a_chain(chain, wanted):
    names = ["root", *(f"{part}_l" for part in chain.split())]
    found = roles.find(names, range(-1, len(names) - 1))
    named = {joint: role for role, joint in found.items() if role != "hips"}
    assert [named.get(j, "left_-") for j in range(1, len(names))] == [
        f"left_{part}" for part in wanted.split()
    ]


def test_of_two_hips_the_leg_hangs_on_the_one_that_says_no_more():
    """CMU's clips have a joint between root and hip that does not move: LHipJoint, or lhipjoint."""
    names = ["Hips", "LHipJoint", "LeftHip", "LeftKnee", "RHipJoint", "RightHip", "RightKnee"]
    found = roles.find(names, [-1, 0, 1, 2, 0, 4, 5])
    assert found["left_upper_leg"] == 2 and found["right_upper_leg"] == 5
    joints = ["Hips_jnt", "LeftHip_jnt", "LeftHip_twist", "LeftKnee_jnt"]
    assert roles.find(joints, [-1, 0, 1, 1])["left_upper_leg"] == 1


def test_a_helper_need_not_have_the_letters_before_all_other_names():
    names = rig_names.names_of(rig_names.CONVENTIONS["low, with a prefix"])
    found = roles.find([*names, "pelvis", "ik_foot_l"], [*CANONICAL.parents, 0, 0])
    assert found == CANONICAL.roles


def test_what_nearly_all_names_have_is_no_more_than_a_name():
    """mHipLeft says no more than a hip; Left_hip_joint, on which it hangs, does."""
    names = [
        "mPelvis",
        "Left_hip_joint",
        "mHipLeft",
        "mKneeLeft",
        "mAnkleLeft",
        "mFootLeft",
        "mHead",
    ]
    found = roles.find(names, [-1, 0, 1, 2, 3, 4, 0])
    assert found["left_upper_leg"] == 2


def test_of_toes_the_upper_one_is_the_joint_of_all():
    found = roles.find(["hips", "foot_l", "toe_jnt_l", "big_toe_1_l"], [-1, 0, 1, 2])
    assert found["left_toes"] == 2
    assert roles.find(["hips", "foot_l", "big_toe_l"], [-1, 0, 1])["left_toes"] == 2


def test_what_carries_arms_on_a_neck_is_no_chest():
    names = [*CANONICAL.names[:3], "Neck_base", *CANONICAL.names[3:]]
    parents = [p + (p > 2) for p in CANONICAL.parents]
    parents.insert(3, 2)
    for name in ("Neck", "LeftShoulder", "RightShoulder"):
        parents[names.index(name)] = 3
    found = roles.find(names, parents)
    assert names[found["chest"]] == "Chest" and names[found["neck"]] == "Neck"


def test_a_root_above_the_pelvis_is_not_the_hips():
    names = ["root", "pelvis", *CANONICAL.names[1:]]
    parents = [-1, *(parent + 1 for parent in CANONICAL.parents)]
    assert roles.find(names, parents) == {role: j + 1 for role, j in CANONICAL.roles.items()}
    bare = names[:7]  # without legs names alone tell
    assert roles.find(bare, parents[:7])["hips"] == 1


# -- as it is said --------------------------------------------------------------------------------


def without_names(skeleton: Skeleton = CANONICAL) -> Skeleton:
    return replace(skeleton, names=[f"bone {i}" for i in range(skeleton.joints)])


def test_what_names_do_not_say_is_said(gait):
    odd = replace(gait, skeleton=without_names(gait.skeleton))
    assert odd.skeleton.roles == {}
    with pytest.raises(RetargetError, match=r"Understood: none\. .*roles=\{'hips': 'NAME'\}"):
        odd.retarget()
    given = {role: f"bone {joint}" for role, joint in CANONICAL.roles.items()}
    said = replace(odd, skeleton=replace(odd.skeleton, roles=given))
    assert said.skeleton.roles == CANONICAL.roles
    assert said.skeleton.mirror_partners == CANONICAL.mirror_partners
    assert torch.equal(said.retarget().positions(), gait.retarget().positions())
    # legs and arms are enough to tell hips, spine and chest
    limbs = {role: name for role, name in given.items() if "_" in role}
    trunk = replace(odd.skeleton, roles=limbs).roles
    assert [trunk[role] for role in ("hips", "spine", "chest")] == [0, 1, 2]


def test_what_is_said_wins_and_stays():
    names = [name.replace("Foot", "Flipper").replace("Toes", "Foot") for name in CANONICAL.names]
    alike = CANONICAL.offsets.clone()
    alike[CANONICAL.role("left_foot")] /= 2  # of a shin so short bones tell nothing
    wrong = replace(CANONICAL, names=names, offsets=alike)
    assert names[wrong.roles["left_foot"]] == "LeftFoot"
    given = {"left_foot": "LeftFlipper", "right_foot": "RightFlipper"}
    skeleton = replace(wrong, roles=given)
    assert names[skeleton.roles["left_foot"]] == "LeftFlipper"
    assert names[skeleton.roles["left_toes"]] == "LeftFoot"  # which a foot below a foot is
    bare = replace(skeleton, roles={**given, "left_toes": ""})
    assert "left_toes" not in bare.roles and "right_toes" in bare.roles
    for kept in (
        skeleton.mirrored(), skeleton.without_end_sites(), replace(skeleton, offsets=skeleton.offsets),
        Skeleton(names, skeleton.parents, skeleton.offsets, roles=skeleton.roles),
    ):  # fmt: skip
        assert kept.roles == skeleton.roles and kept.roles.given == given
    assert skeleton.matches(wrong.without_end_sites()) is False and skeleton.matches(
        replace(wrong, roles={"left_hand": "LeftHand"})
    )


def test_partners_are_who_is_said():
    names = list(CANONICAL.names)
    names[16], names[20] = "Bone.L.001", "Bone.R.002"
    skeleton = replace(CANONICAL, names=names)
    assert skeleton.mirror_partners[16] == 16
    said = replace(skeleton, roles={"left_toes": names[16], "right_toes": names[20]})
    assert said.mirror_partners == CANONICAL.mirror_partners
    swapped = roles.partners(
        ["LeftHand", "RightHand", "LeftGlove"], {"left_hand": 2, "right_hand": 1}
    )
    assert swapped == (0, 2, 1)


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"left_paw": "LeftFoot"}, r"'left_paw', which is no role; roles: hips, .*right_toes"),
        ({"left_foot": "Paw"}, r"left_foot is 'Paw', but there is no such joint; joints: Hips, "),
        ({"left_foot": 15}, "no such joint"),
        ({"left_foot": "Head", "head": "Head"}, "'Head' two roles"),
        (["left_foot"], "joints by role"),
        ("LeftFoot", "joints by role"),
    ],
)
def test_what_can_not_be_said(given, words):
    with pytest.raises(SkeletonError, match=words):
        replace(CANONICAL, roles=given)


def test_a_table_is_read(tmp_path):
    toml, json = tmp_path / "rig.toml", tmp_path / "rig.JSON"
    toml.write_text('\ufeff# feet\nleft_foot = "LFüße"\nleft_toes = ""\n', encoding="utf-8")
    json.write_text('{"left_foot": "LFüße", "left_toes": ""}', encoding="utf-8")
    assert roles.read(toml) == roles.read(str(json)) == {"left_foot": "LFüße", "left_toes": ""}


@pytest.mark.parametrize(
    ("name", "content", "words"),
    [
        ("none.toml", None, "can't be opened"),
        ("a.toml", b"left_foot = LFoot", "is no TOML: .*line 1"),
        ("a.toml", b"left_foot = '\xff'", "is no TOML"),
        ("a.json", b"left_foot = 'LFoot'", "is no JSON: .*line 1"),
        ("a.json", b'["LFoot"]', "flat table"),
        ("a.toml", b"left_foot = 3", "flat table"),
        ("a.toml", b"[roles]\nleft_foot = 'LFoot'", "flat table"),
    ],
)
def test_a_table_that_can_not_be_read(tmp_path, name, content, words):
    if content is not None:
        (tmp_path / name).write_bytes(content)
    with pytest.raises(SkeletonError, match=words):
        roles.read(tmp_path / name)


# -- the mirror -----------------------------------------------------------------------------------


def test_joints_without_partner_are_told(gait):
    with pytest.warns(UserWarning, match="bone 6, bone 7.*roles=") as told:
        replace(gait, skeleton=without_names(gait.skeleton)).mirror()
    assert len(told) == 1
    names = [name.replace("LeftToes", "Paw") for name in gait.skeleton.names]
    lame = rig_names.renamed(gait, names)
    with pytest.warns(UserWarning, match="belongs to Paw, RightToes is not known"):
        lame.mirror()
    # whichever way the body faces
    turned = replace(lame.skeleton, offsets=lame.skeleton.offsets[:, [2, 1, 0]])
    assert turned.without_partner == lame.skeleton.without_partner == (16, 20)


def test_a_rest_pose_along_the_bones_tells_no_middle():
    offsets = torch.zeros(21, 3)
    offsets[:, 0] = CANONICAL.offsets.norm(dim=-1)  # every bone along its parent's x
    assert replace(CANONICAL, offsets=offsets).without_partner == ()


# -- any names at all -----------------------------------------------------------------------------

SYNONYMS = {
    "Hips": ["hips", "pelvis", "hip", "root"],
    "Spine": ["spine", "abdomen", "lower back", "waist"],
    "Chest": ["chest", "thorax", "upper chest", "spine 2"],
    "Neck": ["neck"],
    "Head": ["head"],
}
LIMBS = [
    ["shoulder", "upper arm", "lower arm", "hand"], ["shoulder", "arm", "fore arm", "hand"],
    ["collar", "shoulder", "elbow", "wrist"], ["clavicle", "upper arm", "forearm", "hand"],
    ["scapula", "humerus", "radius", "wrist"], ["collar", "shldr", "fore arm", "hand"],
]  # fmt: skip
LEGS = [
    ["upper leg", "lower leg", "foot", "toes"], ["up leg", "leg", "foot", "toe base"],
    ["thigh", "shin", "foot", "toe"], ["hip", "knee", "ankle", "foot"], ["leg", "shin", "foot", "ball"],
    ["femur", "tibia", "ankle", "toes"], ["hip", "leg", "ankle", "toe"], ["thigh", "calf", "foot", "toe 0"],
]  # fmt: skip
CASES = [str.lower, str.upper, str.title, str.capitalize]


@st.composite
def conventions(draw) -> list[str]:
    """Names of the canonical joints, in a style that a program or a person might have."""
    pick = lambda *of: draw(st.sampled_from(of))
    prefix, suffix = (
        pick("", "rig", "Bip01", "b", "m avg", "a:b:", "hero1:"),
        pick("", "jnt", "bind", "001"),
    )
    separator, case = pick("", " ", "_", "-", "."), pick(*CASES)
    sides, place = pick("left right", "l r", "lft rgt").split(), pick("first", "last")
    arm, leg = pick(*LIMBS), pick(*LEGS)
    names = [[pick(*SYNONYMS[name])] for name in CANONICAL.names[:5]]
    for limb in (arm, leg):
        for side in sides:
            names += [[side, part] if place == "first" else [part, side] for part in limb]
    made = []
    for words in names:
        words = " ".join(
            [*words, suffix] if prefix.endswith(":") else [prefix, *words, suffix]
        ).split()
        body = separator.join(case(word) for word in words)
        made.append(prefix + body if prefix.endswith(":") else body)
    return made


def test_nearly_all_of_them_are_understood_and_none_wrongly():
    understood = []

    @settings(max_examples=500, deadline=None, derandomize=True, database=None)
    @given(conventions())
    def count(names):
        found = replace(CANONICAL, names=names).roles
        assert found.items() <= CANONICAL.roles.items() and not found.placed
        understood.append(len(found) == len(CANONICAL.roles))

    count()
    assert sum(understood) > 0.95 * len(understood)


@pytest.fixture(scope="module")
def wanted(gait) -> Motion:
    return gait.retarget()


@settings(max_examples=25, deadline=None)
@given(names=conventions())
def test_right_or_refused_and_never_mirrored_wrongly(gait, wanted, names):
    motion = rig_names.renamed(gait, names)
    try:
        found = motion.retarget()
        assert (found.positions() - wanted.positions()).norm(dim=-1).max() < 0.02
    except RetargetError as error:
        assert "roles=" in str(error)
    if motion.skeleton.mirror_partners == CANONICAL.mirror_partners:
        motion.mirror()
    else:
        with pytest.warns(UserWarning, match="keep their side"):
            motion.mirror()
