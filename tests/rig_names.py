"""How programs call the joints of a body: the canonical 21 under many names, and whole rigs."""

from __future__ import annotations

from dataclasses import replace

import torch

from motionlab import Motion, Skeleton

CANONICAL = Skeleton.canonical()

# Trunk from hips to head, then shoulder to hand and upper leg to toes; @ is where the side stands,
# and the last words are the sides. A space in a name is written ~.
CONVENTIONS = {
    "accurig": "CC_Base_Hip CC_Base_Waist CC_Base_Spine02 CC_Base_NeckTwist01 CC_Base_Head "
    "CC_Base_@_Clavicle CC_Base_@_Upperarm CC_Base_@_Forearm CC_Base_@_Hand "
    "CC_Base_@_Thigh CC_Base_@_Calf CC_Base_@_Foot CC_Base_@_ToeBase L R",
    "advanced skeleton": "Root_M Spine1_M Chest_M Neck_M Head_M Scapula_@ Shoulder_@ Elbow_@ "
    "Wrist_@ Hip_@ Knee_@ Ankle_@ Toes_@ L R",
    "arkit": "hips_joint spine_1_joint spine_7_joint neck_1_joint head_joint @_shoulder_1_joint "
    "@_arm_joint @_forearm_joint @_hand_joint @_upLeg_joint @_leg_joint @_foot_joint @_toes_joint "
    "left right",
    "auto-rig pro": "root.x spine_01.x spine_02.x neck.x head.x shoulder.@ arm_stretch.@ "
    "forearm_stretch.@ hand.@ thigh_stretch.@ leg_stretch.@ foot.@ toes_01.@ l r",
    "biped": "Bip001~Pelvis Bip001~Spine Bip001~Spine1 Bip001~Neck Bip001~Head Bip001~@~Clavicle "
    "Bip001~@~UpperArm Bip001~@~Forearm Bip001~@~Hand Bip001~@~Thigh Bip001~@~Calf Bip001~@~Foot "
    "Bip001~@~Toe0 L R",
    "biped, underscored": "Bip01_Pelvis Bip01_Spine Bip01_Spine1 Bip01_Neck Bip01_Head "
    "Bip01_@_Clavicle Bip01_@_UpperArm Bip01_@_Forearm Bip01_@_Hand Bip01_@_Thigh Bip01_@_Calf "
    "Bip01_@_Foot Bip01_@_Toe0 L R",
    "blender": "hips.001 spine.001 chest.001 neck.001 head.001 shoulder.@.001 upper_arm.@.001 "
    "forearm.@.001 hand.@.001 thigh.@.001 shin.@.001 foot.@.001 toe.@.001 L R",
    "cascadeur": "pelvis stomach chest neck head clavicle_@ arm_@ forearm_@ hand_@ thigh_@ calf_@ "
    "foot_@ toe_@ l r",
    "cmu": "Hips LowerBack Spine1 Neck1 Head @Shoulder @Arm @ForeArm @Hand @UpLeg @Leg @Foot "
    "@ToeBase Left Right",
    "daz genesis 8": "hip abdomenLower chestUpper neckLower head @Collar @ShldrBend @ForearmBend "
    "@Hand @ThighBend @Shin @Foot @Toe l r",
    "daz genesis 9": "hip spine1 spine4 neck1 head @_shoulder @_upperarm @_forearm @_hand @_thigh "
    "@_shin @_foot @_toes l r",
    "humanik": "Character1_Hips Character1_Spine Character1_Spine1 Character1_Neck Character1_Head "
    "Character1_@Shoulder Character1_@Arm Character1_@ForeArm Character1_@Hand Character1_@UpLeg "
    "Character1_@Leg Character1_@Foot Character1_@ToeBase Left Right",
    "kebab": "hips spine chest neck head @-shoulder @-upper-arm @-lower-arm @-hand @-upper-leg "
    "@-lower-leg @-foot @-toes left right",
    "kinect azure": "PELVIS SPINE_NAVEL SPINE_CHEST NECK HEAD CLAVICLE_@ SHOULDER_@ ELBOW_@ "
    "WRIST_@ HIP_@ KNEE_@ ANKLE_@ FOOT_@ LEFT RIGHT",
    "low": "hips spine chest neck head @shoulder @upperarm @lowerarm @hand @thigh @shin @foot @toe "
    "l r",
    "low, long": "hips spine chest neck head @shoulder @arm @forearm @hand @upleg @leg @foot "
    "@toebase left right",
    "makehuman": "root spine05 spine01 neck01 head clavicle.@ upperarm01.@ lowerarm01.@ wrist.@ "
    "upperleg01.@ lowerleg01.@ foot.@ toe1-1.@ L R",
    "low, with a prefix": "mixamorighips mixamorigspine mixamorigspine2 mixamorigneck mixamorighead "
    "mixamorig@shoulder mixamorig@arm mixamorig@forearm mixamorig@hand mixamorig@upleg "
    "mixamorig@leg mixamorig@foot mixamorig@toebase left right",
    "low, with a suffix": "hipsjnt spinejnt spine2jnt neckjnt headjnt @shoulderjnt @upperarmjnt "
    "@lowerarmjnt @handjnt @upperlegjnt @lowerlegjnt @footjnt @toesjnt left right",
    "maya, nested": "a:b:Hips a:b:Spine a:b:Spine1 a:b:Neck a:b:Head a:b:@Shoulder a:b:@Arm "
    "a:b:@ForeArm a:b:@Hand a:b:@UpLeg a:b:@Leg a:b:@Foot a:b:@ToeBase Left Right",
    "mixamo": "mixamorig1:Hips mixamorig1:Spine mixamorig1:Spine2 mixamorig1:Neck mixamorig1:Head "
    "mixamorig1:@Shoulder mixamorig1:@Arm mixamorig1:@ForeArm mixamorig1:@Hand mixamorig1:@UpLeg "
    "mixamorig1:@Leg mixamorig1:@Foot mixamorig1:@ToeBase Left Right",
    "mixamo, no colon": "mixamorigHips mixamorigSpine mixamorigSpine2 mixamorigNeck mixamorigHead "
    "mixamorig@Shoulder mixamorig@Arm mixamorig@ForeArm mixamorig@Hand mixamorig@UpLeg "
    "mixamorig@Leg mixamorig@Foot mixamorig@ToeBase Left Right",
    "mmd": "下半身 上半身 Chest 首 頭 @肩 @腕 @ひじ @手首 @足 @ひざ @足首 @つま先 左 右",
    "momentum": "b_root b_spine0 b_spine3 b_neck0 b_head b_@_clavicle b_@_arm b_@_forearm "
    "b_@_wrist b_@_upleg b_@_leg b_@_talocrural b_@_ball l r",
    "motive": "Hip Ab Chest Neck Head @Shoulder @UArm @FArm @Hand @Thigh @Shin @Foot @Toe L R",
    "mvn": "Pelvis L5 T8 Neck Head @Shoulder @UpperArm @ForeArm @Hand @UpperLeg @LowerLeg @Foot "
    "@Toe Left Right",
    "mvn, bvh": "Hips Chest Chest2 Neck Head @Collar @Shoulder @Elbow @Wrist @Hip @Knee @Ankle "
    "@Toe Left Right",
    "opensim": "mPelvis mTorso mChest mNeck mHead mCollar@ mShoulder@ mElbow@ mWrist@ mHip@ mKnee@ "
    "mAnkle@ mFoot@ Left Right",
    "poser": "hip:1 abdomen:1 chest:1 neck:1 head:1 @Collar:1 @Shldr:1 @ForeArm:1 @Hand:1 "
    "@Thigh:1 @Shin:1 @Foot:1 @Toe:1 l r",
    "poser, in words": "Hip Abdomen Chest Neck Head @~Collar @~Shoulder @~Forearm @~Hand @~Thigh "
    "@~Shin @~Foot @~Toe Left Right",
    "rigify": "ORG-spine ORG-spine.001 ORG-spine.003 ORG-spine.004 ORG-spine.006 ORG-shoulder.@ "
    "ORG-upper_arm.@ ORG-forearm.@ ORG-hand.@ ORG-thigh.@ ORG-shin.@ ORG-foot.@ ORG-toe.@ L R",
    "roblox": "LowerTorso UpperTorso Chest Neck Head @Collar @UpperArm @LowerArm @Hand @UpperLeg "
    "@LowerLeg @Foot @Toes Left Right",
    "skyrim": "NPC~Pelvis~[Pelv] NPC~Spine~[Spn0] NPC~Spine2~[Spn2] NPC~Neck~[Neck] NPC~Head~[Head] "
    "NPC~@~Clavicle~[@Clv] NPC~@~UpperArm~[@Uar] NPC~@~Forearm~[@Lar] NPC~@~Hand~[@Hnd] "
    "NPC~@~Thigh~[@Thg] NPC~@~Calf~[@Clf] NPC~@~Foot~[@ft] NPC~@~Toe0~[@Toe] L R",
    "smpl": "Pelvis Spine1 Spine3 Neck Head @_Collar @_Shoulder @_Elbow @_Wrist @_Hip @_Knee "
    "@_Ankle @_Foot L R",
    "smpl-x": "pelvis spine1 spine3 neck head @_collar @_shoulder @_elbow @_wrist @_hip @_knee "
    "@_ankle @_foot left right",
    "soma": "Hips Spine1 Chest Neck1 Head @Shoulder @Arm @ForeArm @Hand @Leg @Shin @Foot @ToeBase "
    "Left Right",
    "suffixes": "Hips_jnt Spine_bind Chest_jnt Neck_jnt Head_jnt @_shoulder_jnt @_upArm_bind "
    "@_loArm_bind @_hand_jnt @_upLeg_bind @_loLeg_bind @_foot_jnt @_toe_jnt lft rgt",
    "unreal": "pelvis spine_01 spine_03 neck_01 head clavicle_@ upperarm_@ lowerarm_@ hand_@ "
    "thigh_@ calf_@ foot_@ ball_@ l r",
    "valve": "ValveBiped.Bip01_Pelvis ValveBiped.Bip01_Spine ValveBiped.Bip01_Spine2 "
    "ValveBiped.Bip01_Neck1 ValveBiped.Bip01_Head1 ValveBiped.Bip01_@_Clavicle "
    "ValveBiped.Bip01_@_UpperArm ValveBiped.Bip01_@_Forearm ValveBiped.Bip01_@_Hand "
    "ValveBiped.Bip01_@_Thigh ValveBiped.Bip01_@_Calf ValveBiped.Bip01_@_Foot "
    "ValveBiped.Bip01_@_Toe0 L R",
    "vicon": "Pelvis Spine Thorax Neck Head @Clavicle @Humerus @Radius @Hand @Femur @Tibia @Foot "
    "@Toes L R",
    "vrm": "J_Bip_C_Hips J_Bip_C_Spine J_Bip_C_UpperChest J_Bip_C_Neck J_Bip_C_Head "
    "J_Bip_@_Shoulder J_Bip_@_UpperArm J_Bip_@_LowerArm J_Bip_@_Hand J_Bip_@_UpperLeg "
    "J_Bip_@_LowerLeg J_Bip_@_Foot J_Bip_@_ToeBase L R",
}


# The same where names tell sides and little more: bones have to.
FOREIGN = {
    "german": "Becken Lende Rücken Hals Kopf Schlüsselbein_@ Oberarm_@ Unterarm_@ Hand_@ "
    "Oberschenkel_@ Unterschenkel_@ Fuß_@ Zehen_@ links rechts",
    "korean": "골반 척추 가슴 목 머리 어깨_@ 위팔_@ 아래팔_@ 손_@ 허벅지_@ 종아리_@ 발_@ 발가락_@ L R",
    "mgear": "spine_C0_pelvis_jnt spine_C0_01_jnt spine_C0_03_jnt neck_C0_0_jnt neck_C0_head_jnt "
    "shoulder_@0_0_jnt arm_@0_0_jnt arm_@0_1_jnt arm_@0_end_jnt leg_@0_0_jnt leg_@0_1_jnt "
    "leg_@0_end_jnt foot_@0_0_jnt L R",
    "numbers": "Kn_M_01 Kn_M_02 Kn_M_03 Kn_M_04 Kn_M_05 arm_@_01 arm_@_02 arm_@_03 arm_@_04 "
    "leg_@_01 leg_@_02 leg_@_03 leg_@_04 L R",
}


def names_of(convention: str) -> list[str]:
    """The names of the canonical skeleton's joints, in its order."""
    *words, left, right = convention.replace("~", "\0").split()
    words = [word.replace("\0", " ") for word in words]
    trunk, arm, leg = words[:5], words[5:9], words[9:]
    sided = lambda limb: [[name.replace("@", side) for name in limb] for side in (left, right)]
    return trunk + sum(sided(arm), []) + sum(sided(leg), [])


def renamed(motion: Motion, names: list[str]) -> Motion:
    """The motion with its joints called otherwise."""
    return replace(motion, skeleton=replace(motion.skeleton, names=names))


# Whole rigs, a joint a word, as deep as it has dots before it; = and the role that it has. What is
# @ stands there twice, with all that hangs on it, for both sides.
RIGS = {
    "unreal, with helpers": "root .pelvis=hips ..spine_01=spine ...spine_02 ....spine_03=chest "
    ".....clavicle_@=shoulder ......upperarm_@=upper_arm .......upperarm_twist_01_@ "
    ".......lowerarm_@=lower_arm ........lowerarm_twist_01_@ ........hand_@=hand "
    ".........index_01_@ ..........index_02_@ .........thumb_01_@ .....neck_01=neck ......head=head "
    "..thigh_@=upper_leg ...thigh_twist_01_@ ...calf_@=lower_leg ....calf_twist_01_@ "
    "....foot_@=foot .....ball_@=toes .ik_foot_root ..ik_foot_@ .ik_hand_root ..ik_hand_gun "
    "...ik_hand_@ l r",
    "character creator": "RL_BoneRoot .CC_Base_Hip ..CC_Base_Pelvis=hips "
    "...CC_Base_@_Thigh=upper_leg ....CC_Base_@_ThighTwist01 ....CC_Base_@_Calf=lower_leg "
    ".....CC_Base_@_CalfTwist01 .....CC_Base_@_KneeShareBone .....CC_Base_@_Foot=foot "
    "......CC_Base_@_ToeBase=toes .......CC_Base_@_BigToe1 ......CC_Base_@_ToeBaseShareBone "
    "..CC_Base_Waist=spine ...CC_Base_Spine01 ....CC_Base_Spine02=chest .....CC_Base_@_Breast "
    ".....CC_Base_@_Clavicle=shoulder ......CC_Base_@_Upperarm=upper_arm "
    ".......CC_Base_@_UpperarmTwist01 .......CC_Base_@_Forearm=lower_arm "
    "........CC_Base_@_ForearmTwist01 ........CC_Base_@_ElbowShareBone ........CC_Base_@_Hand=hand "
    ".........CC_Base_@_Thumb1 .....CC_Base_NeckTwist01=neck ......CC_Base_NeckTwist02 "
    ".......CC_Base_Head=head ........CC_Base_JawRoot ........CC_Base_@_Eye L R",
    "daz genesis 8": "hip .pelvis=hips ..@ThighBend=upper_leg ...@ThighTwist ....@Shin=lower_leg "
    ".....@Foot=foot ......@Metatarsals .......@Toe=toes ........@SmallToe1 ........@BigToe "
    ".......@Heel .abdomenLower=spine ..abdomenUpper ...chestLower ....chestUpper=chest "
    ".....@Collar=shoulder ......@ShldrBend=upper_arm .......@ShldrTwist "
    "........@ForearmBend=lower_arm .........@ForearmTwist ..........@Hand=hand ...........@Thumb1 "
    "...........@Carpal1 ............@Index1 .....neckLower=neck ......neckUpper .......head=head "
    "........lowerJaw ....@Pectoral l r",
    "acclaim": "root=hips .@hipjoint ..@femur=upper_leg ...@tibia=lower_leg ....@foot=foot "
    ".....@toes=toes .lowerback=spine ..upperback ...thorax=chest ....lowerneck=neck .....upperneck "
    "......head=head ....@clavicle=shoulder .....@humerus=upper_arm ......@radius=lower_arm "
    ".......@wrist=hand ........@hand .........@fingers ........@thumb l r",
    "kinect": "SpineBase=hips .SpineMid=spine ..SpineShoulder=chest ...Neck=neck ....Head=head "
    "...Shoulder@=upper_arm ....Elbow@=lower_arm .....Wrist@=hand ......Hand@ .......HandTip@ "
    "......Thumb@ .Hip@=upper_leg ..Knee@=lower_leg ...Ankle@=foot ....Foot@=toes Left Right",
    "mvn": "Pelvis=hips .L5=spine ..L3 ...T12 ....T8=chest .....Neck=neck ......Head=head "
    ".....@Shoulder=shoulder ......@UpperArm=upper_arm .......@ForeArm=lower_arm "
    "........@Hand=hand .@UpperLeg=upper_leg ..@LowerLeg=lower_leg ...@Foot=foot ....@Toe=toes "
    "Left Right",
    "rigify, as deformed": "root .DEF-spine=hips ..DEF-spine.001=spine ...DEF-spine.002 "
    "....DEF-spine.003=chest .....DEF-spine.004=neck ......DEF-spine.005 .......DEF-spine.006=head "
    ".....DEF-shoulder.@=shoulder ......DEF-upper_arm.@=upper_arm .......DEF-upper_arm.@.001 "
    "........DEF-forearm.@=lower_arm .........DEF-forearm.@.001 ..........DEF-hand.@=hand "
    "...........DEF-palm.01.@ ............DEF-f_index.01.@ .....DEF-breast.@ ..DEF-pelvis.@ "
    "..DEF-thigh.@=upper_leg ...DEF-thigh.@.001 ....DEF-shin.@=lower_leg .....DEF-shin.@.001 "
    "......DEF-foot.@=foot .......DEF-toe.@=toes L R",
    "makehuman": "root=hips .pelvis.@ ..upperleg01.@=upper_leg ...upperleg02.@ "
    "....lowerleg01.@=lower_leg .....lowerleg02.@ ......foot.@=foot .......toe1-1.@=toes "
    "........toe1-2.@ .......toe2-1.@ .spine05=spine ..spine04 ...spine03 ....spine02 "
    ".....spine01=chest ......clavicle.@=shoulder .......shoulder01.@ ........upperarm01.@=upper_arm "
    ".........upperarm02.@ ..........lowerarm01.@=lower_arm ...........lowerarm02.@ "
    "............wrist.@=hand .............finger1-1.@ ......neck01=neck .......neck02 "
    "........head=head .........jaw .........eye.@ L R",
    "vrm, with hair": "Root .J_Bip_C_Hips=hips ..J_Sec_@_SkirtFront1 ..J_Bip_C_Spine=spine "
    "...J_Bip_C_Chest ....J_Bip_C_UpperChest=chest .....J_Bip_C_Neck=neck ......J_Bip_C_Head=head "
    ".......J_Sec_Hair1_01 ........J_Sec_Hair2_01 .........J_Sec_Hair3_01 .......J_Adj_@_FaceEye "
    ".....J_Bip_@_Shoulder=shoulder ......J_Bip_@_UpperArm=upper_arm "
    ".......J_Bip_@_LowerArm=lower_arm ........J_Bip_@_Hand=hand .........J_Bip_@_Index1 "
    "..J_Bip_@_UpperLeg=upper_leg ...J_Bip_@_LowerLeg=lower_leg ....J_Bip_@_Foot=foot "
    ".....J_Bip_@_ToeBase=toes L R",
    "humanik, with rolls": "Reference .Hips=hips ..@UpLeg=upper_leg ...@UpLegRoll "
    "....@Leg=lower_leg .....@LegRoll ......@Foot=foot .......@ToeBase=toes ........@ToeBaseEnd "
    "..Spine=spine ...Spine1 ....Spine2=chest .....@Shoulder=shoulder ......@Arm=upper_arm "
    ".......@ArmRoll ........@ForeArm=lower_arm .........@ForeArmRoll ..........@Hand=hand "
    "...........@HandIndex1 ...........@HandProp .....Neck=neck ......Head=head .......HeadTop_End "
    ".@FootIK .@FootPole .@HandTarget Left Right",
    "momentum": "body_world .b_root=hips ..b_@_upleg=upper_leg ...b_@_leg=lower_leg "
    "....b_@_talocrural=foot .....b_@_subtalar ......b_@_ball=toes ..b_spine0=spine ...b_spine1 "
    "....b_spine2 .....b_spine3=chest ......b_@_clavicle=shoulder .......b_@_arm=upper_arm "
    "........b_@_forearm=lower_arm .........b_@_wrist_twist ..........b_@_wrist=hand "
    "...........b_@_index1 ......b_neck0=neck .......b_head=head ........b_@_eye l r",
    "biped, legs on the spine": "Bip01 .Bip01~Footsteps .Bip01~Pelvis ..Bip01~Spine=hips "
    "...Bip01~@~Thigh=upper_leg ....Bip01~@~Calf=lower_leg .....Bip01~@~Foot=foot "
    "......Bip01~@~Toe0=toes .......Bip01~@~Toe0Nub ...Bip01~Spine1=spine ....Bip01~Spine2=chest "
    ".....Bip01~Neck=neck ......Bip01~Head=head .......Bip01~HeadNub ......Bip01~@~Clavicle=shoulder "
    ".......Bip01~@~UpperArm=upper_arm ........Bip01~@~Forearm=lower_arm .........Bip01~@~Hand=hand "
    "..........Bip01~@~Finger0 L R",
    "mmd": "全ての親 .センター ..グルーブ ...腰 ....下半身=hips .....@足=upper_leg ......@ひざ=lower_leg .......@足首=foot "
    "........@つま先=toes ....上半身=spine .....上半身2=chest ......首=neck .......頭=head ......@肩=shoulder "
    ".......@腕=upper_arm ........@腕捩 .........@ひじ=lower_arm ..........@手首=hand .@足ＩＫ ..@つま先ＩＫ 左 右",
    "mpi": "pelvis=hips .spine=spine ..spine2 ...spine3 ....spine4=chest .....neck=neck "
    "......head=head .......head_top .....@_clavicle=shoulder ......@_shoulder=upper_arm "
    ".......@_elbow=lower_arm ........@_wrist=hand .........@_hand .@_hip=upper_leg "
    "..@_knee=lower_leg ...@_ankle=foot ....@_foot .....@_toe=toes left right",
    "thigh, leg and hip joints": "hips=hips .@_hip ..@_leg=upper_leg ...@_knee=lower_leg "
    "....@_foot=foot .....@_toe=toes .spine=spine ..chest=chest ...neck=neck ....head=head "
    "...@_scapula=shoulder ....@_shoulder=upper_arm .....@_elbow=lower_arm ......@_hand=hand "
    "left right",
    "ears and ribs": "Hips=hips .Lumbar=spine ..Ribs=chest ...Neck=neck ....Head=head .....Rear "
    "...LUpperArm=upper_arm ....LLowerArm=lower_arm .....LHand=hand ...RUpperArm=upper_arm "
    "....RLowerArm=lower_arm .....RHand=hand .LUpperLeg=upper_leg ..LLowerLeg=lower_leg "
    "...LFoot=foot .RUpperLeg=upper_leg ..RLowerLeg=lower_leg ...RFoot=foot L R",
}


def rig(text: str) -> tuple[Skeleton, dict[str, str]]:
    """A skeleton without lengths, and the joint of each role."""
    *words, left, right = text.split()
    names, parents, roles, way = [], [], {}, {}
    for word, side in _twice([word.replace("~", " ") for word in words], (left, right)):
        depth = len(word) - len(word.lstrip("."))
        name, _, role = word.lstrip(".").partition("=")
        way[depth] = len(names)
        names.append(name.replace("@", side))
        parents.append(way[depth - 1] if depth else -1)
        if role:
            which = {left: "left_", right: "right_", "": ""}[side or _first(name, role)]
            roles[which + role] = names[-1]
    return Skeleton(names, parents, torch.zeros(len(names), 3)), roles


def _first(name: str, role: str) -> str:
    central = role in ("hips", "spine", "chest", "neck", "head")
    return "" if central else name[0]


def _twice(words: list[str], sides: tuple[str, str]) -> list[tuple[str, str]]:
    """Each word with its side; what is @ with all that hangs on it once for each side."""
    depth = lambda word: len(word) - len(word.lstrip("."))
    found, at = [], 0
    while at < len(words):
        end = at + 1
        if "@" in words[at]:
            while end < len(words) and depth(words[end]) > depth(words[at]):
                end += 1
        for side in sides if "@" in words[at] else ("",):
            found += [(word, side if "@" in word else "") for word in words[at:end]]
        at = end
    return found
