//! Humanoid bones of a rig: which joint is the left knee.
//!
//! The bones come from the file's VRM data, else from the names of the joints, else from the shape of the skeleton.
//! A caller may set single bones.

mod names;
mod shape;
#[cfg(test)]
pub(crate) mod tests;

use cagework_core::options::Choice;
use cagework_core::rig::{Joint, Rig};
use glam::DVec3;
use serde::Serialize;
use thiserror::Error;

cagework_core::choice! {
    /// A humanoid bone. The names are those of VRM 1.0.
    Bone {
        /// Root of the body.
        #[default]
        Hips = "hips",
        /// Lower part of the spine.
        Spine = "spine",
        /// Upper part of the spine.
        Chest = "chest",
        /// Part of the spine above the chest.
        UpperChest = "upperChest",
        /// Neck.
        Neck = "neck",
        /// Head.
        Head = "head",
        /// Left collarbone.
        LeftShoulder = "leftShoulder",
        /// Right collarbone.
        RightShoulder = "rightShoulder",
        /// Left upper arm.
        LeftUpperArm = "leftUpperArm",
        /// Right upper arm.
        RightUpperArm = "rightUpperArm",
        /// Left forearm.
        LeftLowerArm = "leftLowerArm",
        /// Right forearm.
        RightLowerArm = "rightLowerArm",
        /// Left hand.
        LeftHand = "leftHand",
        /// Right hand.
        RightHand = "rightHand",
        /// Left thigh.
        LeftUpperLeg = "leftUpperLeg",
        /// Right thigh.
        RightUpperLeg = "rightUpperLeg",
        /// Left shin.
        LeftLowerLeg = "leftLowerLeg",
        /// Right shin.
        RightLowerLeg = "rightLowerLeg",
        /// Left foot.
        LeftFoot = "leftFoot",
        /// Right foot.
        RightFoot = "rightFoot",
        /// Left toes.
        LeftToes = "leftToes",
        /// Right toes.
        RightToes = "rightToes",
    }
}

/// Number of humanoid bones.
pub const N_BONES: usize = <Bone as Choice>::ALL.len();

/// Bones without which a rig is not a humanoid.
const REQUIRED: [Bone; 14] = [
    Bone::Hips,
    Bone::Head,
    Bone::LeftUpperArm,
    Bone::RightUpperArm,
    Bone::LeftLowerArm,
    Bone::RightLowerArm,
    Bone::LeftHand,
    Bone::RightHand,
    Bone::LeftUpperLeg,
    Bone::RightUpperLeg,
    Bone::LeftLowerLeg,
    Bone::RightLowerLeg,
    Bone::LeftFoot,
    Bone::RightFoot,
];

/// Bones that keep their shape, each with those that move with it.
pub(crate) const ENDS: [&[Bone]; 5] = [
    &[Bone::Head],
    &[Bone::LeftHand],
    &[Bone::RightHand],
    &[Bone::LeftFoot, Bone::LeftToes],
    &[Bone::RightFoot, Bone::RightToes],
];

/// Joints of the humanoid bones. `[N_BONES]`, indexed by [`Bone`].
type Joints = [Option<u32>; N_BONES];

cagework_core::choice! {
    /// What told which joint is which bone.
    BoneSource {
        /// The file's VRM data.
        #[default]
        Vrm = "vrm",
        /// The names of the joints.
        Names = "names",
        /// The shape of the skeleton.
        Shape = "shape",
    }
}

/// The humanoid bones of a rig.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Humanoid {
    joints: Joints,
    source: BoneSource,
}

/// A humanoid bone and its joint, for reports.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
#[cfg_attr(feature = "typescript", derive(ts_rs::TS))]
pub struct BoneJoint {
    /// The bone.
    pub bone: Bone,
    /// Name of its joint in the file.
    pub joint: String,
}

/// Why a rig has no humanoid bones.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum HumanoidError {
    /// The model has no joints.
    #[error("the model has no skeleton: pull its cage instead")]
    NoRig,
    /// The arrays of the rig contradict each other.
    #[error("the rig is not valid: {0}")]
    Rig(&'static str),
    /// Required bones were not found.
    #[error(
        "the skeleton is not recognised as a humanoid: no joint was found for {}; name the joint of each, or pull the \
         cage instead. The model has the joints {joints}",
        listed(missing)
    )]
    Missing {
        /// The bones without a joint.
        missing: Vec<Bone>,
        /// Names of the first joints of the rig.
        joints: String,
    },
    /// A given joint does not exist.
    #[error("{bone}: there is no joint {joint:?}; the model has the joints {joints}")]
    NoJoint {
        /// The bone.
        bone: Bone,
        /// The given name.
        joint: String,
        /// Names of the first joints of the rig.
        joints: String,
    },
    /// A limb has no length.
    #[error(
        "{0} and {1} are at the same place, so the bone between them has no length: name another joint for one of them"
    )]
    NoLength(Bone, Bone),
}

/// Number of joint names that an error lists.
const LISTED: usize = 30;
/// Number of characters of a joint's name that an error shows.
const NAME_CHARS: usize = 40;

fn listed(bones: &[Bone]) -> String {
    let names: Vec<String> = bones.iter().map(ToString::to_string).collect();
    names.join(", ")
}

/// Lists the names of joints, escaped and shortened.
fn joint_names(rig: &Rig) -> String {
    let name = |joint: &Joint| format!("{:?}", joint.name.chars().take(NAME_CHARS).collect::<String>());
    let names: Vec<String> = rig.joints.iter().take(LISTED).map(name).collect();
    let more = rig.joints.len().saturating_sub(LISTED);
    if more > 0 { format!("{} and {more} more", names.join(", ")) } else { names.join(", ") }
}

impl Humanoid {
    /// Finds the humanoid bones of a rig at rest, y up.
    ///
    /// `given`: bones and the names of their joints. They take precedence over what is found.
    ///
    /// # Errors
    /// [`HumanoidError`] if the rig has no joints or is not valid, a required bone is not found, a given joint does not
    /// exist, or a limb has no length. Required are the hips, the head, and on each side the arm, forearm, hand, thigh,
    /// shin and foot.
    pub fn of_rig(rig: &Rig, given: &[(Bone, String)]) -> Result<Self, HumanoidError> {
        if rig.joints.is_empty() {
            return Err(HumanoidError::NoRig);
        }
        check(rig)?;
        let mut set: Joints = [None; N_BONES];
        for (bone, name) in given {
            let found = rig.joints.iter().position(|joint| joint.name == *name);
            let none =
                || HumanoidError::NoJoint { bone: *bone, joint: name.clone(), joints: joint_names(rig) };
            set[*bone as usize] = Some(found.ok_or_else(none)? as u32);
        }
        // A joint that is given for one bone is not found for another.
        let with_given = |found: Joints| -> Joints {
            let free = |joint: &u32| !set.contains(&Some(*joint));
            std::array::from_fn(|bone| set[bone].or(found[bone].filter(free)))
        };
        let missing = |joints: &Joints| -> Vec<Bone> {
            REQUIRED.into_iter().filter(|bone| joints[*bone as usize].is_none()).collect()
        };
        let of_vrm = with_given(of_vrm(rig));
        let of_names = with_given(names::find(rig));
        // The shape must not contradict the names of limbs.
        let agrees = |of_shape: &Joints| {
            LIMBS.iter().flatten().all(|&bone| {
                let [shape, name] = [of_shape, &of_names].map(|joints| joints[bone as usize]);
                name.is_none() || name == shape
            })
        };
        let of_shape = || shape::find(rig).map(with_given).filter(agrees);
        let has_vrm = rig.joints.iter().any(|joint| joint.bone.is_some());
        let (joints, source) = if has_vrm && missing(&of_vrm).is_empty() {
            (of_vrm, BoneSource::Vrm)
        } else if missing(&of_names).is_empty() {
            (of_names, BoneSource::Names)
        } else if let Some(of_shape) = of_shape().filter(|joints| missing(joints).is_empty()) {
            (of_shape, BoneSource::Shape)
        } else {
            return Err(HumanoidError::Missing { missing: missing(&of_names), joints: joint_names(rig) });
        };
        let humanoid = Self { joints, source };
        for [from, to] in LIMBS {
            if humanoid.at(rig, from) == humanoid.at(rig, to) {
                return Err(HumanoidError::NoLength(from, to));
            }
        }
        Ok(humanoid)
    }

    /// Joint of a bone.
    #[must_use]
    pub fn joint(&self, bone: Bone) -> Option<u32> {
        self.joints[bone as usize]
    }

    /// What told which joint is which bone.
    #[must_use]
    pub fn source(&self) -> BoneSource {
        self.source
    }

    /// Position of a bone's joint at rest, object units.
    pub(crate) fn at(&self, rig: &Rig, bone: Bone) -> Option<DVec3> {
        rig.joints.get(self.joint(bone)? as usize).map(|joint| joint.at.as_dvec3())
    }

    /// The bones that the rig has, with the names of their joints.
    #[must_use]
    pub fn named(&self, rig: &Rig) -> Vec<BoneJoint> {
        let name = |&(_, bone): &(&str, Bone)| {
            let joint = rig.joints.get(self.joint(bone)? as usize)?;
            Some(BoneJoint { bone, joint: joint.name.clone() })
        };
        Bone::ALL.iter().filter_map(name).collect()
    }

    /// The bone to which each joint belongs: its own, or that of the closest joint above it. `[n_joints]`
    #[must_use]
    pub fn bones_of_joints(&self, rig: &Rig) -> Vec<Option<Bone>> {
        let mut own = vec![None; rig.joints.len()];
        for &(_, bone) in Bone::ALL {
            if let Some(own) = self.joint(bone).and_then(|joint| own.get_mut(joint as usize)) {
                *own = Some(bone);
            }
        }
        // Parents first, so that each joint is visited once.
        for joint in by_depth(rig) {
            let above =
                rig.joints[joint].parent.and_then(|parent| own.get(parent as usize).copied().flatten());
            own[joint] = own[joint].or(above);
        }
        own
    }
}

/// Pairs of bones whose joints are the ends of a limb's bone.
const LIMBS: [[Bone; 2]; 8] = [
    [Bone::LeftUpperArm, Bone::LeftLowerArm],
    [Bone::LeftLowerArm, Bone::LeftHand],
    [Bone::LeftUpperLeg, Bone::LeftLowerLeg],
    [Bone::LeftLowerLeg, Bone::LeftFoot],
    [Bone::RightUpperArm, Bone::RightLowerArm],
    [Bone::RightLowerArm, Bone::RightHand],
    [Bone::RightUpperLeg, Bone::RightLowerLeg],
    [Bone::RightLowerLeg, Bone::RightFoot],
];

/// Checks that the joints form trees and are at finite positions.
fn check(rig: &Rig) -> Result<(), HumanoidError> {
    let n = rig.joints.len();
    if rig.joints.iter().any(|joint| !joint.at.is_finite()) {
        return Err(HumanoidError::Rig("the position of a joint is not finite"));
    }
    // A walk over the children of all roots visits every joint unless some form a circle.
    if rig.joints.iter().any(|joint| joint.parent.is_some_and(|parent| parent as usize >= n))
        || by_depth(rig).len() != n
    {
        return Err(HumanoidError::Rig("the parents of the joints do not form a tree"));
    }
    Ok(())
}

/// A joint and those above it, from the joint upwards.
fn ancestors(rig: &Rig, joint: usize) -> impl Iterator<Item = usize> {
    std::iter::successors(Some(joint), |&at| rig.joints.get(at)?.parent.map(|parent| parent as usize))
}

/// Joints from the roots downwards, those of equal depth in their order in the rig.
fn by_depth(rig: &Rig) -> Vec<usize> {
    let mut children = vec![Vec::new(); rig.joints.len()];
    let mut level = Vec::new();
    for (k, joint) in rig.joints.iter().enumerate() {
        match joint.parent {
            None => level.push(k),
            Some(parent) => {
                if let Some(children) = children.get_mut(parent as usize) {
                    children.push(k);
                }
            }
        }
    }
    let mut all = Vec::with_capacity(rig.joints.len());
    while !level.is_empty() {
        level.sort_unstable();
        all.extend(&level);
        level = level.iter().flat_map(|joint| children[*joint].iter().copied()).collect();
    }
    all
}

/// Bones that the file's VRM data names.
fn of_vrm(rig: &Rig) -> Joints {
    let mut joints = [None; N_BONES];
    for (joint, k) in rig.joints.iter().zip(0..) {
        if let Some(bone) = joint.bone.as_deref().and_then(|name| name.parse::<Bone>().ok()) {
            joints[bone as usize] = Some(k);
        }
    }
    joints
}
