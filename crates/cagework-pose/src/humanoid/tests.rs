use cagework_core::rig::{Joint, Rig};
use glam::{Vec3, vec3};

use super::*;

/// Bones of [`rig_of`], each with the index of its parent in this list and its place; those of a side on the left.
const FIGURE: [(Bone, usize, [f32; 3]); 13] = [
    (Bone::Hips, 0, [0.0, 1.0, 0.0]),
    (Bone::Spine, 0, [0.0, 1.1, 0.0]),
    (Bone::Chest, 1, [0.0, 1.3, 0.0]),
    (Bone::Neck, 2, [0.0, 1.5, 0.0]),
    (Bone::Head, 3, [0.0, 1.6, 0.0]),
    (Bone::LeftShoulder, 2, [0.05, 1.45, 0.0]),
    (Bone::LeftUpperArm, 5, [0.18, 1.45, 0.0]),
    (Bone::LeftLowerArm, 6, [0.45, 1.45, 0.0]),
    (Bone::LeftHand, 7, [0.7, 1.45, 0.0]),
    (Bone::LeftUpperLeg, 0, [0.1, 0.95, 0.0]),
    (Bone::LeftLowerLeg, 9, [0.1, 0.5, 0.0]),
    (Bone::LeftFoot, 10, [0.1, 0.1, 0.0]),
    (Bone::LeftToes, 11, [0.1, 0.02, 0.15]),
];

/// Number of bones in the middle, which precede those of a side.
const MIDDLE: usize = 5;

/// A rig with joints at the places of [`FIGURE`]. `names`: one per row, separated by a comma and a blank, with `{}`
/// for the side; joints without a name are left out. `sides`: words for left and right.
pub(crate) fn rig_of(names: &str, sides: [&str; 2]) -> Rig {
    let names: Vec<&str> = names.split(", ").collect();
    let mut joints: Vec<Joint> = Vec::new();
    for (side, word) in sides.into_iter().enumerate() {
        let mut number: Vec<Option<u32>> = Vec::new();
        for (k, (_, parent, at)) in FIGURE.into_iter().enumerate() {
            let is_middle = k < MIDDLE;
            let name = names[k].replace("{}", word);
            let known = joints.iter().position(|joint| joint.name == name).filter(|_| is_middle);
            let above = number.get(parent).copied().flatten();
            let own = if name.is_empty() { above } else { Some(known.unwrap_or(joints.len()) as u32) };
            number.push(own);
            if !name.is_empty() && known.is_none() {
                let mirrored = if side == 1 { -at[0] } else { at[0] };
                joints.push(Joint { name, parent: above, at: vec3(mirrored, at[1], at[2]), bone: None });
            }
        }
    }
    Rig { joints, first: vec![0], influences: Vec::new() }
}

/// Checks the joint of each bone of [`FIGURE`], on the left and on the right.
fn check(label: &str, names: &str, sides: [&str; 2], source: BoneSource) {
    let rig = rig_of(names, sides);
    let names: Vec<&str> = names.split(", ").collect();
    let humanoid = Humanoid::of_rig(&rig, &[]).unwrap_or_else(|error| panic!("{label}: {error}"));
    assert_eq!(humanoid.source(), source, "{label}");
    let joint = |bone: Bone| humanoid.joint(bone).map(|joint| rig.joints[joint as usize].name.clone());
    for (k, (bone, ..)) in FIGURE.into_iter().enumerate() {
        let expected =
            |side: usize| Some(names[k].replace("{}", sides[side])).filter(|name| !name.is_empty());
        let is_required = REQUIRED.contains(&bone);
        if is_required || source == BoneSource::Names {
            assert_eq!(joint(bone), expected(0), "{label}: {bone}");
        }
        if k >= MIDDLE {
            let right = bone.to_string().replace("left", "right").parse::<Bone>().unwrap();
            if is_required || source == BoneSource::Names {
                assert_eq!(joint(right), expected(1), "{label}: {right}");
            }
        }
    }
}

/// Maker, words for left and right, and the names of [`FIGURE`] as its exporters write them.
const MAKERS: [(&str, [&str; 2], &str); 15] = [
    (
        "Mixamo",
        ["Left", "Right"],
        "mixamorig:Hips, mixamorig:Spine, mixamorig:Spine1, mixamorig:Neck, mixamorig:Head, \
         mixamorig:{}Shoulder, mixamorig:{}Arm, mixamorig:{}ForeArm, mixamorig:{}Hand, \
         mixamorig:{}UpLeg, mixamorig:{}Leg, mixamorig:{}Foot, mixamorig:{}ToeBase",
    ),
    (
        "VRoid",
        ["L", "R"],
        "J_Bip_C_Hips, J_Bip_C_Spine, J_Bip_C_Chest, J_Bip_C_Neck, J_Bip_C_Head, \
         J_Bip_{}_Shoulder, J_Bip_{}_UpperArm, J_Bip_{}_LowerArm, J_Bip_{}_Hand, \
         J_Bip_{}_UpperLeg, J_Bip_{}_LowerLeg, J_Bip_{}_Foot, J_Bip_{}_ToeBase",
    ),
    (
        "Unreal",
        ["l", "r"],
        "pelvis, spine_01, spine_02, neck_01, head, clavicle_{}, upperarm_{}, lowerarm_{}, \
         hand_{}, thigh_{}, calf_{}, foot_{}, ball_{}",
    ),
    (
        "Blender's metarig",
        ["L", "R"],
        "pelvis, spine, chest, neck, head, shoulder.{}, upper_arm.{}, forearm.{}, hand.{}, \
         thigh.{}, shin.{}, foot.{}, toe.{}",
    ),
    (
        "Unity",
        ["Left", "Right"],
        "Hips, Spine, Chest, Neck, Head, {}Shoulder, {}UpperArm, {}LowerArm, {}Hand, {}UpperLeg, \
         {}LowerLeg, {}Foot, {}Toes",
    ),
    (
        "VRChat (Cats)",
        ["Left", "Right"],
        "Hips, Spine, Chest, Neck, Head, {} shoulder, {} arm, {} elbow, {} wrist, {} leg, \
         {} knee, {} ankle, {} toe",
    ),
    (
        "MMD",
        ["左", "右"],
        "下半身, 上半身, 上半身2, 首, 頭, {}肩, {}腕, {}ひじ, {}手首, {}足, {}ひざ, {}足首, {}つま先",
    ),
    (
        "3ds Max",
        ["L", "R"],
        "Bip01_Pelvis, Bip01_Spine, Bip01_Spine1, Bip01_Neck, Bip01_Head, Bip01_{}_Clavicle, \
         Bip01_{}_UpperArm, Bip01_{}_Forearm, Bip01_{}_Hand, Bip01_{}_Thigh, Bip01_{}_Calf, \
         Bip01_{}_Foot, Bip01_{}_Toe0",
    ),
    (
        "Valve",
        ["L", "R"],
        "ValveBiped.Bip01_Pelvis, ValveBiped.Bip01_Spine, ValveBiped.Bip01_Spine1, \
         ValveBiped.Bip01_Neck1, ValveBiped.Bip01_Head1, ValveBiped.Bip01_{}_Clavicle, \
         ValveBiped.Bip01_{}_UpperArm, ValveBiped.Bip01_{}_Forearm, ValveBiped.Bip01_{}_Hand, \
         ValveBiped.Bip01_{}_Thigh, ValveBiped.Bip01_{}_Calf, ValveBiped.Bip01_{}_Foot, \
         ValveBiped.Bip01_{}_Toe0",
    ),
    (
        "Character Creator",
        ["L", "R"],
        "CC_Base_Hip, , , , CC_Base_Head, CC_Base_{}_Clavicle, CC_Base_{}_Upperarm, \
         CC_Base_{}_Forearm, CC_Base_{}_Hand, CC_Base_{}_Thigh, CC_Base_{}_Calf, \
         CC_Base_{}_Foot, CC_Base_{}_ToeBase",
    ),
    (
        "Daz",
        ["l", "r"],
        "pelvis, , , , head, {}Collar, {}ShldrBend, {}ForearmBend, {}Hand, {}ThighBend, {}Shin, \
         {}Foot, {}Toe",
    ),
    (
        "ARKit",
        ["left", "right"],
        "hips_joint, , , neck_1_joint, head_joint, {}_shoulder_1_joint, {}_arm_joint, \
         {}_forearm_joint, {}_hand_joint, {}_upLeg_joint, {}_leg_joint, {}_foot_joint, \
         {}_toes_joint",
    ),
    (
        "Quaternius",
        ["L", "R"],
        "Hips, Abdomen, Torso, Neck, Head, Shoulder.{}, UpperArm.{}, LowerArm.{}, Palm.{}, \
         UpperLeg.{}, LowerLeg.{}, Foot.{}, ",
    ),
    (
        "KayKit",
        ["l", "r"],
        "hips, spine, chest, , head, , upperarm.{}, lowerarm.{}, hand.{}, upperleg.{}, \
         lowerleg.{}, foot.{}, toes.{}",
    ),
    (
        "an armature of Maya",
        ["l", "r"],
        "c_pelvis_jnt, c_spine_jnt, c_chest_jnt, c_neck_jnt, c_head_jnt, {}_clavicle_jnt, \
         {}_upperArm_jnt, {}_lowerArm_jnt, {}_hand_jnt, {}_thigh_jnt, {}_shin_jnt, {}_ankle_jnt, \
         {}_ball_jnt",
    ),
];

#[test]
fn bones_have_the_names_of_sixteen_makers() {
    for (label, sides, names) in MAKERS {
        check(label, names, sides, BoneSource::Names);
    }
}

/// Rigify calls hips, neck and head "spine".
#[test]
fn a_rigify_spine_begins_with_the_hips_and_ends_with_the_head() {
    let names = "DEF-spine, DEF-spine.001, DEF-spine.002, DEF-spine.005, DEF-spine.006, DEF-shoulder.{}, \
         DEF-upper_arm.{}, DEF-forearm.{}, DEF-hand.{}, DEF-thigh.{}, DEF-shin.{}, DEF-foot.{}, \
         DEF-toe.{}";
    let rig = rig_of(names, ["L", "R"]);
    let humanoid = Humanoid::of_rig(&rig, &[]).unwrap();
    let name = |bone| humanoid.joint(bone).map(|joint| rig.joints[joint as usize].name.as_str());
    let found = [Bone::Hips, Bone::Neck, Bone::Head].map(name);
    assert_eq!(found, [Some("DEF-spine"), Some("DEF-spine.005"), Some("DEF-spine.006")]);
}

/// Names in German, Spanish and Korean.
#[test]
fn bones_without_known_names_are_found_by_the_shape() {
    let german = "Huefte, Wirbel, Brust, Hals, Kopf, Schulter {}, Oberarm {}, Unterarm {}, Hand {}x, \
         Oberschenkel {}, Unterschenkel {}, Fuss {}, Zehen {}";
    let spanish = "cadera, columna, pecho, cuello, cabeza, clavicula_{}, brazo_{}, antebrazo_{}, mano_{}, \
         muslo_{}, pantorrilla_{}, pie_{}, dedos_{}";
    let korean =
        "골반, 척추, 가슴, 목, 머리, 어깨{}, 위팔{}, 아래팔{}, 손{}, 허벅지{}, 종아리{}, 발{}, 발가락{}";
    check("German", german, ["links", "rechts"], BoneSource::Shape);
    check("Spanish", spanish, ["izq", "der"], BoneSource::Shape);
    check("Korean", korean, ["_1", "_2"], BoneSource::Shape);
}

const UNITY: &str = "Hips, Spine, Chest, Neck, Head, {}Shoulder, {}UpperArm, {}LowerArm, {}Hand, {}UpperLeg, \
    {}LowerLeg, {}Foot, {}Toes";

/// A rig of a figure with the names of Unity.
pub(crate) fn unity_rig() -> Rig {
    rig_of(UNITY, ["Left", "Right"])
}

#[test]
fn the_bones_of_a_vrm_precede_names() {
    let mut rig = unity_rig();
    let names = std::mem::take(&mut rig.joints).into_iter().map(|joint| {
        let bone = format!("{}{}", joint.name[..1].to_lowercase(), &joint.name[1..]);
        Joint { name: format!("node {}", joint.name.len()), bone: Some(bone), ..joint }
    });
    rig.joints = names.collect();
    let humanoid = Humanoid::of_rig(&rig, &[]).unwrap();
    assert_eq!(humanoid.source(), BoneSource::Vrm);
    assert_eq!(humanoid.bones_of_joints(&rig)[0], Some(Bone::Hips));
}

#[test]
fn a_given_joint_replaces_what_is_found() {
    let mut rig = unity_rig();
    let hand = rig.joints.iter().position(|joint| joint.name == "LeftHand").unwrap();
    rig.joints[hand].name = "Grip".to_owned();
    rig.joints.push(Joint { name: "Strap".into(), parent: Some(hand as u32), at: Vec3::X, bone: None });
    // The only joint below the forearm is the hand.
    assert_eq!(Humanoid::of_rig(&rig, &[]).unwrap().joint(Bone::LeftHand), Some(hand as u32));
    let given = |name: &str| Humanoid::of_rig(&rig, &[(Bone::LeftHand, name.to_owned())]);
    assert_eq!(given("Strap").unwrap().joint(Bone::LeftHand), Some(rig.joints.len() as u32 - 1));
    assert!(matches!(given("Claw"), Err(HumanoidError::NoJoint { bone: Bone::LeftHand, .. })));
}

#[test]
fn what_is_missing_is_named() {
    assert_eq!(Humanoid::of_rig(&Rig::default(), &[]), Err(HumanoidError::NoRig));
    let mut rig = unity_rig();
    for joint in &mut rig.joints {
        joint.at = Vec3::ZERO;
    }
    assert!(matches!(Humanoid::of_rig(&rig, &[]), Err(HumanoidError::NoLength(..))));
    rig.joints.truncate(5);
    let Err(HumanoidError::Missing { missing, .. }) = Humanoid::of_rig(&rig, &[]) else { panic!() };
    assert!(missing.contains(&Bone::LeftHand) && !missing.contains(&Bone::Head));
    rig.joints[0].parent = Some(4);
    assert!(matches!(Humanoid::of_rig(&rig, &[]), Err(HumanoidError::Rig(_))));
}
