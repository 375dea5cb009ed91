//! Maps of the bones of a fitted figure at one time of a clip.

use cagework_core::options::Choice;
use cagework_core::rig::{JointFrame, Rig};
use glam::{DAffine3, DMat3, DQuat, DVec3};

use super::{Figure, Fit, chains_of};
use crate::drive::Map;
use crate::humanoid::{Bone, Humanoid, N_BONES};

/// Moves the bones of a fitted figure as a clip moves those of a rig.
///
/// At each time a bone has the direction that it has in the rig, which may be at rest in another pose. Bones keep their
/// lengths, and the travel of the hips is scaled by the ratio of the lengths of the legs.
#[derive(Clone, Debug)]
pub struct ClipMaps {
    figure: Figure,
    /// Joint of each bone in the rig.
    joints: [Option<u32>; N_BONES],
    /// Position of the rig's hips at rest.
    hips: DVec3,
    turn: DQuat,
    /// Rotations from the pose of the fitted figure to the pose in which the rig is at rest. Indexed by [`Bone`].
    to_rest: [DQuat; N_BONES],
    /// Ratio of the lengths of the legs.
    travel: f64,
}

/// A joint that bends far.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BentJoint {
    /// The bone below the joint: a forearm or a shin.
    pub bone: Bone,
    /// Angle between the bone and the straight continuation of the one above, degrees.
    pub degrees: f64,
}

impl ClipMaps {
    /// Prepares the bones of a fitted figure for the clips of a rig.
    #[must_use]
    pub fn new(fit: &Fit, rig: &Rig, humanoid: &Humanoid) -> Self {
        let own = Figure::of_rig(rig, humanoid);
        let mut to_rest = [DQuat::IDENTITY; N_BONES];
        for (arm, leg) in chains_of() {
            for chain in [&arm[..], &leg[..3]] {
                for pair in chain.windows(2) {
                    to_rest[pair[0] as usize] = rotation_between(fit, &own, pair[0], pair[1]);
                }
            }
            // Hands continue the forearms; feet stand on the ground in both figures.
            to_rest[arm[2] as usize] = to_rest[arm[1] as usize];
        }
        let leg = |figure: &Figure| -> f64 {
            let all = chains_of().map(|(_, leg)| leg);
            let pairs = all.iter().flat_map(|leg| [[leg[0], leg[1]], [leg[1], leg[2]]]);
            pairs.filter_map(|[a, b]| Some(figure.at(a)?.distance(figure.at(b)?))).sum()
        };
        Self {
            joints: std::array::from_fn(|bone| humanoid.joint(Bone::ALL[bone].1)),
            hips: own.at(Bone::Hips).unwrap_or_default(),
            travel: leg(&fit.figure) / leg(&own).max(f64::MIN_POSITIVE),
            turn: fit.turn,
            figure: fit.figure.clone(),
            to_rest,
        }
    }

    /// Ratio of the lengths of the legs, by which the travel of the hips is scaled.
    #[must_use]
    pub fn travel(&self) -> f64 {
        self.travel
    }

    /// Maps of the bones, indexed by [`Bone`]. `frames`: joints of the rig at one time. `[n_joints]`, in the order of the rig
    #[must_use]
    pub fn at(&self, frames: &[JointFrame]) -> Vec<Map> {
        let frame = |bone: Bone| frames.get(self.joints[bone as usize]? as usize);
        let mut maps = vec![DAffine3::IDENTITY; N_BONES];
        // Bones follow those above them in the order of `Bone`.
        for &(_, bone) in Bone::ALL {
            let parent = self.figure.parent(bone).map(|parent| maps[parent as usize]);
            let (Some(at), Some(frame)) = (self.figure.at(bone), frame(bone)) else {
                maps[bone as usize] = parent.unwrap_or(DAffine3::IDENTITY);
                continue;
            };
            let to = match parent {
                Some(parent) => parent.transform_point3(at),
                None => at + self.travel * (self.turn * (frame.at - self.hips)),
            };
            let turn = self.turn * frame.turn * self.turn.inverse() * self.to_rest[bone as usize];
            let linear = DMat3::from_quat(turn.normalize());
            maps[bone as usize] = DAffine3 { matrix3: linear, translation: to - linear * at };
        }
        maps.into_iter().map(Map::Affine).collect()
    }

    /// The elbow or knee that bends furthest under some maps.
    #[must_use]
    pub fn most_bent(&self, maps: &[Map]) -> Option<BentJoint> {
        let bend = |[upper, lower, end]: [Bone; 3]| {
            let [a, b, c] = [self.figure.at(upper)?, self.figure.at(lower)?, self.figure.at(end)?];
            let [a, b, c] =
                [maps[upper as usize].apply(a), maps[lower as usize].apply(b), maps[lower as usize].apply(c)];
            Some(BentJoint { bone: lower, degrees: (b - a).angle_between(c - b).to_degrees() })
        };
        let limbs =
            chains_of().into_iter().flat_map(|(arm, [thigh, shin, foot, _])| [arm, [thigh, shin, foot]]);
        limbs.filter_map(bend).max_by(|a, b| a.degrees.total_cmp(&b.degrees))
    }
}

/// The smallest rotation from the direction of a bone in the fitted figure to that in the rig.
fn rotation_between(fit: &Fit, own: &Figure, bone: Bone, next: Bone) -> DQuat {
    let way = |figure: &Figure| Some((figure.at(next)? - figure.at(bone)?).normalize_or_zero());
    let (Some(from), Some(to)) = (way(&fit.figure), way(own)) else { return DQuat::IDENTITY };
    if from == DVec3::ZERO || to == DVec3::ZERO {
        return DQuat::IDENTITY;
    }
    DQuat::from_rotation_arc(from, fit.turn * to)
}
