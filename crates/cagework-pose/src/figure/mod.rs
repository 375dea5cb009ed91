//! A humanoid's skeleton in another figure, such as a capture: joints are fitted to it, and its cage follows a clip.

mod clip;
mod fit;
mod landmarks;
#[cfg(test)]
mod tests;

use std::collections::BTreeMap;

use cagework_core::options::Choice;
use cagework_core::rig::Rig;
use glam::{DVec3, Vec3};
use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::drive::BoneWeights;
use crate::humanoid::{Bone, Humanoid, N_BONES};

pub use clip::{BentJoint, ClipMaps};
pub use fit::{Fit, FitSource};
pub use landmarks::{Landmarks, Limb};

/// Exponent of the inverse distance in a bone's weight, in thicknesses of the bone's part.
const SHARPNESS: i32 = 6;
/// Distances below this many thicknesses count as this many.
const LEAST_DISTANCE: f64 = 0.2;
/// An end without a tip is as long as this share of the bone above.
const END_LENGTH: f64 = 0.5;

/// Joints of a humanoid at rest, object units, y up.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Figure {
    /// Joint of each bone; `None` for bones that the rig lacks. Indexed by [`Bone`].
    joints: [Option<DVec3>; N_BONES],
    /// Tips of hands, feet and head. Indexed by [`Bone`].
    ends: [Option<DVec3>; N_BONES],
}

/// Joints by the names of their bones, as files store them. `[x, y, z]` in the axes of the file.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct NamedJoints {
    /// Joints of bones, named as in VRM 1.0.
    pub joints: BTreeMap<String, [f64; 3]>,
    /// Tips of the parts that bones end: head, hands, feet and toes.
    #[serde(default)]
    pub ends: BTreeMap<String, [f64; 3]>,
}

/// Why named joints are not those of a figure.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum FigureError {
    /// There is no such bone.
    #[error("there is no bone {0:?}: bones are named as in VRM 1.0, such as leftUpperArm")]
    Bone(String),
    /// A position is not finite.
    #[error("the position of {0} is not finite")]
    NotFinite(Bone),
}

impl Figure {
    /// Joints of a rig.
    #[must_use]
    pub fn of_rig(rig: &Rig, humanoid: &Humanoid) -> Self {
        let joints = std::array::from_fn(|bone| humanoid.at(rig, Bone::ALL[bone].1));
        Self { joints, ..Self::default() }
    }

    /// Joints and ends by name. `map`: from object units to the axes of a file.
    pub fn named(&self, map: impl Fn(DVec3) -> DVec3) -> NamedJoints {
        let all = |of: &[Option<DVec3>; N_BONES]| {
            let named =
                Bone::ALL.iter().filter_map(|(name, bone)| Some(((*name).to_owned(), of[*bone as usize]?)));
            named.map(|(name, at)| (name, map(at).to_array())).collect()
        };
        NamedJoints { joints: all(&self.joints), ends: all(&self.ends) }
    }

    /// The inverse of [`Self::named`]. `map`: from the axes of a file to object units.
    ///
    /// # Errors
    /// [`FigureError`] for an unknown name or a number that is not finite.
    pub fn of_named(named: &NamedJoints, map: impl Fn(DVec3) -> DVec3) -> Result<Self, FigureError> {
        let mut figure = Self::default();
        for (of, to) in [(&named.joints, &mut figure.joints), (&named.ends, &mut figure.ends)] {
            for (name, at) in of {
                let bone: Bone = name.parse().map_err(|_| FigureError::Bone(name.clone()))?;
                let at = map(DVec3::from_array(*at));
                to[bone as usize] = Some(at).filter(|at| at.is_finite());
                if to[bone as usize].is_none() {
                    return Err(FigureError::NotFinite(bone));
                }
            }
        }
        Ok(figure)
    }

    /// Joint of a bone, object units.
    #[must_use]
    pub fn at(&self, bone: Bone) -> Option<DVec3> {
        self.joints[bone as usize]
    }

    /// The bones that the figure has, with their joints. Object units
    pub fn all(&self) -> impl Iterator<Item = (Bone, DVec3)> {
        Bone::ALL.iter().filter_map(|(_, bone)| Some((*bone, self.at(*bone)?)))
    }

    fn mapped(&self, map: &dyn Fn(DVec3) -> DVec3) -> Self {
        let mut mapped = self.clone();
        for at in mapped.joints.iter_mut().chain(&mut mapped.ends).flatten() {
            *at = map(*at);
        }
        mapped
    }

    /// Sets joints to the images of those of a rig.
    fn place(&mut self, rig: &Self, bones: &[Bone], map: &dyn Fn(DVec3) -> DVec3) {
        for bone in bones {
            self.joints[*bone as usize] = rig.at(*bone).map(map);
        }
    }

    /// The closest bone above that the figure has.
    fn parent(&self, bone: Bone) -> Option<Bone> {
        std::iter::successors(above(bone), |bone| above(*bone)).find(|bone| self.at(*bone).is_some())
    }

    /// Segments of a bone: to the joints of the bones below it, or to its tip. Object units
    #[must_use]
    pub fn segments(&self, bone: Bone) -> Vec<[DVec3; 2]> {
        let Some(at) = self.at(bone) else { return Vec::new() };
        let is_below = |other: &Bone| self.at(*other).is_some() && self.parent(*other) == Some(bone);
        let below = Bone::ALL.iter().map(|(_, other)| *other).filter(is_below);
        let mut all: Vec<[DVec3; 2]> = below.filter_map(|other| Some([at, self.at(other)?])).collect();
        if all.is_empty() {
            let beyond = || {
                let above = self.at(self.parent(bone)?)?;
                Some(at + END_LENGTH * (at - above))
            };
            let tip = self.ends[bone as usize].or_else(beyond).unwrap_or(at);
            all.push([at, tip]);
        }
        all
    }
}

/// Bones of the left and right arm and leg, from the trunk outwards.
fn chains_of() -> [([Bone; 3], [Bone; 4]); 2] {
    use Bone::{
        LeftFoot, LeftHand, LeftLowerArm, LeftLowerLeg, LeftToes, LeftUpperArm, LeftUpperLeg, RightFoot,
        RightHand, RightLowerArm, RightLowerLeg, RightToes, RightUpperArm, RightUpperLeg,
    };
    [
        ([LeftUpperArm, LeftLowerArm, LeftHand], [LeftUpperLeg, LeftLowerLeg, LeftFoot, LeftToes]),
        ([RightUpperArm, RightLowerArm, RightHand], [RightUpperLeg, RightLowerLeg, RightFoot, RightToes]),
    ]
}

/// The bone above a bone in a complete skeleton.
fn above(bone: Bone) -> Option<Bone> {
    use Bone::{
        Chest, Head, Hips, LeftFoot, LeftHand, LeftLowerArm, LeftLowerLeg, LeftShoulder, LeftToes,
        LeftUpperArm, LeftUpperLeg, Neck, RightFoot, RightHand, RightLowerArm, RightLowerLeg, RightShoulder,
        RightToes, RightUpperArm, RightUpperLeg, Spine, UpperChest,
    };
    Some(match bone {
        Hips => return None,
        Spine | LeftUpperLeg | RightUpperLeg => Hips,
        Chest => Spine,
        UpperChest => Chest,
        Neck | LeftShoulder | RightShoulder => UpperChest,
        Head => Neck,
        LeftUpperArm => LeftShoulder,
        RightUpperArm => RightShoulder,
        LeftLowerArm => LeftUpperArm,
        RightLowerArm => RightUpperArm,
        LeftHand => LeftLowerArm,
        RightHand => RightLowerArm,
        LeftLowerLeg => LeftUpperLeg,
        RightLowerLeg => RightUpperLeg,
        LeftFoot => LeftLowerLeg,
        RightFoot => RightLowerLeg,
        LeftToes => LeftFoot,
        RightToes => RightFoot,
    })
}

/// The limb that a bone belongs to: 0 and 1 for the arms, 2 and 3 for the legs; `None` for the trunk, and for the first
/// bone of a limb, which the trunk's surface may follow.
fn outer_limb(bone: Bone) -> Option<usize> {
    chains_of().iter().enumerate().find_map(|(side, (arm, leg))| {
        let is_in = |bones: &[Bone]| bones[1..].contains(&bone);
        if is_in(arm) { Some(side) } else { is_in(leg).then_some(2 + side) }
    })
}

impl BoneWeights {
    /// Takes the weights of a cage from the distances of a model's points to the bones of a figure.
    ///
    /// A point's weights are proportional to the inverse sixth power of its distance from a bone, in thicknesses: the
    /// median distance of the points that are closest to the bone. The cage takes them from the nearest points, as in
    /// [`Self::of_skin`].
    ///
    /// `cage`, `rings`: as for [`Self::of_skin`]. `points`: on the surface of the model, object units, `[n_points]`.
    /// `chain_of`: chain of each point in the curve skeleton in which `landmarks` were found: a point on one limb does
    /// not follow another one. Empty, or `[n_points]`.
    #[must_use]
    pub fn of_figure(
        cage: &[Vec3],
        rings: &[Vec<u32>],
        points: &[Vec3],
        figure: &Figure,
        limbs: Option<(&Landmarks, &[u32])>,
    ) -> Self {
        let segments: Vec<Vec<[DVec3; 2]>> =
            Bone::ALL.iter().map(|(_, bone)| figure.segments(*bone)).collect();
        // Limbs that run along each chain.
        let own_limbs = |v: usize| -> Option<Vec<usize>> {
            let (landmarks, chain_of) = limbs?;
            let chain = *chain_of.get(v)? as usize;
            let all = landmarks.arms.iter().chain(&landmarks.legs).enumerate();
            Some(all.filter(|(_, limb)| limb.chain == chain).map(|(k, _)| k).collect())
        };
        let mut rows = vec![[f64::INFINITY; N_BONES]; points.len()];
        let mut near: Vec<Vec<f64>> = vec![Vec::new(); N_BONES];
        for (v, row) in rows.iter_mut().enumerate() {
            let (p, own) = (points[v].as_dvec3(), own_limbs(v));
            let is_other = |limb: usize| own.as_ref().is_some_and(|own| !own.contains(&limb));
            let mut closest = 0;
            for &(_, bone) in Bone::ALL {
                let k = bone as usize;
                if !outer_limb(bone).is_some_and(is_other) {
                    row[k] = segments[k].iter().map(|ends| distance(p, *ends)).fold(f64::INFINITY, f64::min);
                }
                closest = if row[k] < row[closest] { k } else { closest };
            }
            near[closest].push(row[closest]);
        }
        let whole = median(&mut near.concat()).max(f64::MIN_POSITIVE);
        let thickness: Vec<f64> = near
            .iter_mut()
            .map(|own| if own.is_empty() { whole } else { median(own).max(1e-3 * whole) })
            .collect();
        for row in &mut rows {
            for (w, thickness) in row.iter_mut().zip(&thickness) {
                *w = (*w / thickness).max(LEAST_DISTANCE).powi(-SHARPNESS);
            }
            let sum: f64 = row.iter().sum();
            row.iter_mut().for_each(|w| *w /= sum.max(f64::MIN_POSITIVE));
        }
        Self::of_rows(cage, rings, points, &rows)
    }
}

fn median(values: &mut [f64]) -> f64 {
    values.sort_unstable_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or_default()
}

/// Distance of a point from a segment.
fn distance(p: DVec3, [a, b]: [DVec3; 2]) -> f64 {
    let by = b - a;
    let share = (p - a).dot(by) / by.length_squared().max(f64::MIN_POSITIVE);
    (a + share.clamp(0.0, 1.0) * by).distance(p)
}
