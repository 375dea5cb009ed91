//! Humanoid bones by the names of the joints.
//!
//! The names are those of Mixamo, VRoid, Unreal, Rigify, Blender, Unity, VRChat, MMD, 3ds Max, Valve, Character Creator, Daz,
//! ARKit, Quaternius and KayKit.

use cagework_core::rig::Rig;

use super::{Bone, Joints, N_BONES, ancestors, by_depth};

/// Part of the body without its side.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Part {
    Middle(Bone),
    Sided([Bone; 2]),
}

const SHOULDER: Part = Part::Sided([Bone::LeftShoulder, Bone::RightShoulder]);
const UPPER_ARM: Part = Part::Sided([Bone::LeftUpperArm, Bone::RightUpperArm]);
const LOWER_ARM: Part = Part::Sided([Bone::LeftLowerArm, Bone::RightLowerArm]);
const HAND: Part = Part::Sided([Bone::LeftHand, Bone::RightHand]);
const UPPER_LEG: Part = Part::Sided([Bone::LeftUpperLeg, Bone::RightUpperLeg]);
const LOWER_LEG: Part = Part::Sided([Bone::LeftLowerLeg, Bone::RightLowerLeg]);
const FOOT: Part = Part::Sided([Bone::LeftFoot, Bone::RightFoot]);
const TOES: Part = Part::Sided([Bone::LeftToes, Bone::RightToes]);

/// Names of each part in lower case, without side, prefix and separators.
const WORDS: [(Part, &[&str]); 14] = [
    (
        Part::Middle(Bone::Hips),
        &["hips", "hip", "pelvis", "roothips", "waist", "cog", "centerhips", "mhips", "下半身", "腰"],
    ),
    (Part::Middle(Bone::Spine), &["spine", "abdomen", "lowerback", "torsolower", "上半身"]),
    (Part::Middle(Bone::Chest), &["chest", "torso", "spine1", "spineb", "upperbody", "ribcage", "上半身2"]),
    (Part::Middle(Bone::UpperChest), &["upperchest", "spine2", "spinec", "上半身3"]),
    (Part::Middle(Bone::Neck), &["neck", "首"]),
    (Part::Middle(Bone::Head), &["head", "頭"]),
    (SHOULDER, &["shoulder", "clavicle", "collar", "collarbone", "肩"]),
    (UPPER_ARM, &["upperarm", "uparm", "armupper", "arm", "shldrbend", "shldr", "腕"]),
    (LOWER_ARM, &["lowerarm", "forearm", "loarm", "armlower", "elbow", "forearmbend", "ひじ"]),
    (HAND, &["hand", "wrist", "palm", "fist", "手首"]),
    (UPPER_LEG, &["upperleg", "upleg", "thigh", "legupper", "thighbend", "足"]),
    (LOWER_LEG, &["lowerleg", "loleg", "shin", "calf", "knee", "leglower", "ひざ"]),
    (FOOT, &["foot", "ankle", "足首"]),
    (TOES, &["toes", "toe", "toebase", "ball", "つま先"]),
];

/// Words of a name that say nothing about the bone.
const FILLERS: [&str; 18] = [
    "c",
    "j",
    "b",
    "adj",
    "jadj",
    "bindjnt",
    "jnt",
    "bind",
    "def",
    "jbip",
    "bip001",
    "bip01",
    "bip",
    "ccbase",
    "valvebiped",
    "bone",
    "joint",
    "drv",
];

/// Parts of a name that mark helper joints.
const HELPERS: [&str; 8] = ["ik", "pole", "target", "twist", "roll", "ctrl", "control", "slot"];

/// Least number of joints with the name "spine" of which the last one is the head (Rigify).
const SPINE_WITH_HEAD: usize = 5;

/// Side and words of a joint's name.
struct Name {
    /// 0 left, 1 right.
    side: Option<usize>,
    /// The words in lower case, joined.
    core: String,
}

impl Name {
    fn of(name: &str) -> Self {
        // Letters of full width have the same offset from ASCII each.
        let narrow = |c: char| match c {
            '\u{ff01}'..='\u{ff5e}' => char::from_u32(u32::from(c) - 0xfee0).unwrap_or(c),
            c => c,
        };
        let name: String = name.chars().map(narrow).collect();
        let name = name.rsplit([':', '|']).next().unwrap_or_default();
        let name = name.strip_prefix("CC_Base_").or(name.strip_prefix("ValveBiped.")).unwrap_or(name);
        let sided = |prefix, side| name.strip_prefix(prefix).map(|rest| (Some(side), rest));
        let (mut side, name) = sided('左', 0).or(sided('右', 1)).unwrap_or((None, name));
        let mut spaced = String::new();
        let mut was_lower = false;
        for c in name.chars() {
            if was_lower && c.is_ascii_uppercase() {
                spaced.push(' ');
            }
            was_lower = c.is_ascii_lowercase();
            spaced.extend(c.to_lowercase());
        }
        let mut core = String::new();
        for word in spaced.split(|c: char| c.is_whitespace() || "_.-".contains(c)) {
            let own = match word {
                "l" | "left" => Some(0),
                "r" | "right" => Some(1),
                _ => None,
            };
            if own.is_some() && side.is_none() {
                side = own;
            } else if !FILLERS.contains(&word) {
                core += word;
            }
        }
        Self { side, core }
    }

    /// The words without digits at the end.
    fn bare(&self) -> &str {
        self.core.trim_end_matches(|c: char| c.is_ascii_digit())
    }

    /// Whether the name is that of a helper joint or of the end of a chain. "Bend" is no end.
    fn is_helper(&self) -> bool {
        let is_end = self.core.ends_with("nub") || self.core.ends_with("end") && !self.core.ends_with("bend");
        is_end || HELPERS.iter().any(|word| self.core.contains(word))
    }
}

/// The part of the body that a name stands for.
fn part_of(name: &str) -> Option<Part> {
    WORDS.iter().find(|(_, words)| words.contains(&name)).map(|(part, _)| *part)
}

/// Finds bones by the names of the joints; of several joints with names of one bone, the closest to the root.
pub(super) fn find(rig: &Rig) -> Joints {
    let names: Vec<(usize, Name)> =
        by_depth(rig).into_iter().map(|joint| (joint, Name::of(&rig.joints[joint].name))).collect();
    let has = |side: Option<usize>, part: Part| {
        names.iter().any(|(_, name)| {
            name.side == side && part_of(name.bare()).or_else(|| part_of(&name.core)) == Some(part)
        })
    };
    let mut found: Joints = [None; N_BONES];
    for (joint, name) in names.iter().filter(|(_, name)| !name.is_helper()) {
        let part = match (name.core.as_str(), name.side) {
            // The shin if a thigh has a name of its own (Mixamo), otherwise the thigh.
            ("leg", side) => Some(if has(side, UPPER_LEG) { LOWER_LEG } else { UPPER_LEG }),
            ("shoulder", side) if !has(side, UPPER_ARM) => Some(UPPER_ARM),
            _ => part_of(&name.core).or_else(|| part_of(name.bare())),
        };
        let bone = match (part, name.side) {
            (Some(Part::Middle(bone)), None) => bone,
            (Some(Part::Sided(bones)), Some(side)) => bones[side],
            _ => continue,
        };
        let joint = *joint as u32;
        if found[bone as usize].is_none() {
            found[bone as usize] = Some(joint);
        } else if bone == Bone::Spine && name.core != "abdomen" {
            // Numbered spines: spine, spine.001, spine.002.
            let next =
                [Bone::Chest, Bone::UpperChest].into_iter().find(|next| found[*next as usize].is_none());
            if let Some(next) = next {
                found[next as usize] = Some(joint);
            }
        }
    }
    complete_rigify(rig, &names, &mut found);
    complete_ends(rig, &names, &mut found);
    found
}

/// A hand or foot without a usual name is the only joint below the forearm or shin.
fn complete_ends(rig: &Rig, names: &[(usize, Name)], found: &mut Joints) {
    let ends = [
        (Bone::LeftLowerArm, Bone::LeftHand),
        (Bone::RightLowerArm, Bone::RightHand),
        (Bone::LeftLowerLeg, Bone::LeftFoot),
        (Bone::RightLowerLeg, Bone::RightFoot),
    ];
    for (lower, end) in ends {
        let (Some(lower), None) = (found[lower as usize], found[end as usize]) else { continue };
        let is_below =
            |(joint, name): &&(usize, Name)| rig.joints[*joint].parent == Some(lower) && !name.is_helper();
        let mut below = names.iter().filter(is_below);
        if let (Some((joint, _)), None) = (below.next(), below.next()) {
            found[end as usize] = Some(*joint as u32);
        }
    }
}

/// Rigify calls hips, neck and head "spine": the first spine joint is the hips, the last two are neck and head.
fn complete_rigify(rig: &Rig, names: &[(usize, Name)], found: &mut Joints) {
    let is_spine = |name: &Name| name.side.is_none() && name.bare() == "spine";
    let spine: Vec<u32> =
        names.iter().filter(|(_, name)| is_spine(name)).map(|(joint, _)| *joint as u32).collect();
    if let [_, .., neck, head] = spine.as_slice()
        && spine.len() >= SPINE_WITH_HEAD
        && found[Bone::Head as usize].is_none()
    {
        found[Bone::Head as usize] = Some(*head);
        found[Bone::Neck as usize] = Some(*neck);
    }
    if found[Bone::Hips as usize].is_none()
        && let [Some(left), Some(right)] =
            [Bone::LeftUpperLeg, Bone::RightUpperLeg].map(|bone| found[bone as usize])
    {
        let above_right: Vec<usize> = ancestors(rig, right as usize).collect();
        let hips = ancestors(rig, left as usize).skip(1).find(|joint| above_right.contains(joint));
        if let Some(hips) = hips {
            let hips = Some(hips as u32);
            for bone in [Bone::Spine, Bone::Chest, Bone::UpperChest] {
                if found[bone as usize] == hips {
                    found[bone as usize] = None;
                }
            }
            found[Bone::Hips as usize] = hips;
        }
    }
}
