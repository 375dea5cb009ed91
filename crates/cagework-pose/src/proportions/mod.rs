//! Proportions of a humanoid: factors for legs, arms, head and so on become a pose of its cage.
//!
//! Limbs are scaled along and across their bones, the trunk by heights; hands, feet and head keep their shape. The pose
//! is the cage at rest moved by these maps, weighted by the skin ([`crate::drive`]).

#[cfg(test)]
mod tests;

use std::collections::BTreeMap;

use cagework_core::deform::deform_bound;
use cagework_core::frames::Frames;
use cagework_core::options::{Choice, Number, RangeError, Slider};
use cagework_core::rig::Rig;
use cagework_core::weights::Weights;
use glam::{DAffine3, DMat3, DVec3, Vec3};
use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::drive::{BoneWeights, Map, Trunk, skin_of_bones};
use crate::ends::EndFit;
use crate::humanoid::{Bone, Humanoid, N_BONES};

/// Range of all factors.
pub const FACTOR: Number = Number {
    name: "factor",
    help: "Factor of a length or width",
    unit: "times the length at rest",
    allowed: "a number from 0.5 to 2",
    is_allowed: |factor| (0.5..=2.0).contains(&factor),
    slider: Some(Slider { min: 0.5, max: 2.0, step: 0.01 }),
};

cagework_core::choice! {
    /// A proportion of a humanoid.
    Proportion {
        /// Length of the legs, without the feet.
        #[default]
        Leg = "leg",
        /// Length of the arms, without the hands.
        Arm = "arm",
        /// Height of the trunk from the hips to the neck.
        Torso = "torso",
        /// Length of the neck.
        Neck = "neck",
        /// Size of the head.
        Head = "head",
        /// Size of the hands.
        Hand = "hand",
        /// Size of the feet.
        Foot = "foot",
        /// Distance between the shoulders.
        Shoulder = "shoulder",
        /// Width of the hips.
        Hip = "hip",
        /// Thickness of arms and legs.
        Limb = "limb",
        /// Width of the waist.
        Waist = "waist",
        /// Size of the whole figure.
        Height = "height",
    }
}

/// Number of proportions.
const N: usize = <Proportion as Choice>::ALL.len();

/// What is fixed about a proportion, for help and sliders.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "typescript", derive(ts_rs::TS))]
pub struct ProportionFacts {
    /// Meaning, for help.
    pub help: &'static str,
    /// Title of its group of sliders.
    pub group: &'static str,
    /// Whether left and right may differ.
    pub is_sided: bool,
    /// Factors between which figures look natural, found by looking at five avatars.
    pub natural: [f64; 2],
}

impl Proportion {
    /// What is fixed about the proportion.
    #[must_use]
    pub const fn facts(self) -> ProportionFacts {
        let (help, group, is_sided, natural) = match self {
            Self::Leg => ("Length of the legs, without the feet", LIMBS, true, [0.6, 1.4]),
            Self::Arm => ("Length of the arms, without the hands", LIMBS, true, [0.7, 1.3]),
            Self::Limb => ("Thickness of arms and legs", LIMBS, true, [0.75, 1.4]),
            Self::Hand => ("Size of the hands", LIMBS, true, [0.7, 1.4]),
            Self::Foot => ("Size of the feet", LIMBS, true, [0.7, 1.4]),
            Self::Torso => ("Height of the trunk from the hips to the neck", TRUNK, false, [0.75, 1.3]),
            Self::Shoulder => ("Distance between the shoulders", TRUNK, false, [0.8, 1.3]),
            Self::Waist => ("Width of the waist", TRUNK, false, [0.75, 1.4]),
            Self::Hip => ("Width of the hips", TRUNK, false, [0.85, 1.2]),
            Self::Head => ("Size of the head", WHOLE, false, [0.8, 1.8]),
            Self::Neck => ("Length of the neck", WHOLE, false, [0.5, 2.0]),
            Self::Height => ("Size of the whole figure", WHOLE, false, [0.5, 2.0]),
        };
        ProportionFacts { help, group, is_sided, natural }
    }
}

const LIMBS: &str = "Limbs";
const TRUNK: &str = "Trunk";
const WHOLE: &str = "Head and height";

/// Factors of the proportions, on the left and on the right; 1 keeps the length at rest.
///
/// In JSON an object such as `{"leg": 1.2, "left_arm": 0.9}`: the name of a proportion sets both sides, one with
/// `left_` or `right_` before it a single side.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "BTreeMap<String, f64>", into = "BTreeMap<String, f64>")]
pub struct Proportions([[f64; 2]; N]);

impl Default for Proportions {
    fn default() -> Self {
        Self([[1.0; 2]; N])
    }
}

/// Error: a proportion cannot be set.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum ProportionError {
    /// No proportion has the name.
    #[error("there is no proportion {name:?}; there are {known}")]
    Unknown {
        /// The given name without its side, shortened.
        name: String,
        /// All names.
        known: String,
    },
    /// A factor of one side is given for a proportion without sides.
    #[error("{name} has no sides: give one factor; those with sides are {sided}")]
    NoSides {
        /// Name of the proportion.
        name: &'static str,
        /// Names of those with two sides.
        sided: String,
    },
    /// No preset has the name.
    #[error("there is no preset {name:?}; there are {known}")]
    Preset {
        /// The given name, shortened.
        name: String,
        /// All names.
        known: String,
    },
    /// The factor is out of range.
    #[error("{name}: {error}")]
    Range {
        /// Name as given.
        name: String,
        /// The factor and its range.
        error: RangeError,
    },
}

impl Proportions {
    /// Factors by name; those of a preset, if its name is given, hold where no other factor does.
    ///
    /// # Errors
    /// [`ProportionError`] as for [`Self::set`], or if no preset has the name.
    pub fn from_preset(preset: Option<&str>, named: &BTreeMap<String, f64>) -> Result<Self, ProportionError> {
        let mut proportions = Self::default();
        if let Some(name) = preset {
            let none = || ProportionError::Preset {
                name: shortened(name),
                known: PRESETS.map(|preset| preset.name).join(", "),
            };
            let found = PRESETS.iter().find(|preset| preset.name == name).ok_or_else(none)?;
            for (name, factor) in found.factors {
                proportions.set(name, *factor)?;
            }
        }
        // Both sides before a single one, so that it may differ.
        let (sides, both): (Vec<_>, Vec<_>) =
            named.iter().partition(|(name, _)| name.starts_with("left_") || name.starts_with("right_"));
        for (name, factor) in both.into_iter().chain(sides) {
            proportions.set(name, *factor)?;
        }
        Ok(proportions)
    }

    /// Sets the factor of a proportion by name, such as "leg" for both sides or "left_leg" for one.
    ///
    /// # Errors
    /// [`ProportionError`] if no proportion has the name, or the factor is not between 0.5 and 2.
    pub fn set(&mut self, name: &str, factor: f64) -> Result<(), ProportionError> {
        let sided = |prefix, side| name.strip_prefix(prefix).map(|rest| (rest, Some(side)));
        let (bare, side) = sided("left_", 0).or(sided("right_", 1)).unwrap_or((name, None));
        let words = |is_listed: fn(Proportion) -> bool| {
            let kept = Proportion::ALL.iter().filter(|(_, proportion)| is_listed(*proportion));
            kept.map(|(word, _)| *word).collect::<Vec<_>>().join(", ")
        };
        let Some(&(word, proportion)) = Proportion::ALL.iter().find(|(word, _)| *word == bare) else {
            return Err(ProportionError::Unknown { name: shortened(bare), known: words(|_| true) });
        };
        if side.is_some() && !proportion.facts().is_sided {
            return Err(ProportionError::NoSides { name: word, sided: words(|p| p.facts().is_sided) });
        }
        let wrong = |error| ProportionError::Range { name: name.to_owned(), error };
        FACTOR.check(factor).map_err(wrong)?;
        let factors = &mut self.0[proportion as usize];
        match side {
            Some(side) => factors[side] = factor,
            None => *factors = [factor; 2],
        }
        Ok(())
    }

    /// Factor of a proportion on the left, 0, or right, 1. Those without sides have one factor.
    #[must_use]
    pub fn factor(&self, proportion: Proportion, side: usize) -> f64 {
        self.0[proportion as usize][side.min(1)]
    }

    /// Factors other than 1, by name.
    #[must_use]
    pub fn named(&self) -> BTreeMap<String, f64> {
        let mut named = BTreeMap::new();
        for &(word, proportion) in Proportion::ALL {
            let [left, right] = self.0[proportion as usize];
            let is_both = left.to_bits() == right.to_bits();
            let sides = [("", left, is_both), ("left_", left, !is_both), ("right_", right, !is_both)];
            for (prefix, factor, _) in
                sides.into_iter().filter(|(_, factor, is_used)| *is_used && *factor != 1.0)
            {
                named.insert(format!("{prefix}{word}"), factor);
            }
        }
        named
    }
}

impl TryFrom<BTreeMap<String, f64>> for Proportions {
    type Error = ProportionError;

    fn try_from(named: BTreeMap<String, f64>) -> Result<Self, ProportionError> {
        Self::from_preset(None, &named)
    }
}

impl From<Proportions> for BTreeMap<String, f64> {
    fn from(proportions: Proportions) -> Self {
        proportions.named()
    }
}

fn shortened(name: &str) -> String {
    name.chars().take(40).collect()
}

/// A named set of proportions.
#[derive(Clone, Copy, Debug, Serialize)]
#[cfg_attr(feature = "typescript", derive(ts_rs::TS))]
pub struct Preset {
    /// Name, in lower case.
    pub name: &'static str,
    /// Factors by name.
    pub factors: &'static [(&'static str, f64)],
}

/// Presets, in the order in which they are offered.
pub const PRESETS: [Preset; 6] = [
    Preset { name: "longer legs", factors: &[("leg", 1.2)] },
    Preset { name: "big head", factors: &[("head", 1.35)] },
    Preset {
        name: "hero",
        factors: &[
            ("shoulder", 1.22),
            ("limb", 1.12),
            ("torso", 1.05),
            ("leg", 1.1),
            ("hip", 0.96),
            ("head", 0.92),
            ("hand", 1.08),
        ],
    },
    Preset {
        name: "chibi",
        factors: &[
            ("head", 1.7),
            ("leg", 0.65),
            ("arm", 0.72),
            ("torso", 0.8),
            ("neck", 0.7),
            ("limb", 1.1),
            ("hand", 1.1),
            ("foot", 1.1),
        ],
    },
    Preset {
        name: "slim",
        factors: &[("waist", 0.85), ("hip", 0.92), ("limb", 0.86), ("shoulder", 0.96), ("leg", 1.06)],
    },
    Preset {
        name: "stout",
        factors: &[
            ("waist", 1.3),
            ("hip", 1.15),
            ("limb", 1.2),
            ("leg", 0.9),
            ("arm", 0.95),
            ("neck", 0.85),
            ("shoulder", 1.06),
        ],
    },
];

impl Preset {
    /// The factor of a preset that changes one proportion, with its name; `None` for those that change several.
    #[must_use]
    pub fn only_factor(&self) -> Option<(&'static str, f64)> {
        if let [only] = self.factors { Some(*only) } else { None }
    }

    /// Factors of the preset.
    ///
    /// # Errors
    /// [`ProportionError`]; a test sets every preset, so this does not occur.
    pub fn proportions(&self) -> Result<Proportions, ProportionError> {
        Proportions::from_preset(Some(self.name), &BTreeMap::new())
    }
}

/// Height of the chin above the head's lowest vertices, in heights of the head.
const CHIN: f64 = 0.08;
/// Share of the lowest and of the highest vertices of the head that do not count: hair.
const HEAD_OUTLIERS: f64 = 0.03;
/// Vertices whose weight for the head is above this belong to the head.
const OF_HEAD: f64 = 0.5;
/// The girth of the neck at the head grows by this share of the square root of the head's factor.
const NECK_SHARE: f64 = 0.6;
/// Cage vertices with more than this weight for one leg stay on its side of the middle plane.
const OF_LEG: f64 = 0.5;
/// Distance that such vertices keep from the middle plane, in heights of the figure.
const LEG_CLEARANCE: f64 = 0.002;
/// Share of the model's area that may be folded within a range.
const FOLDED_AREA: f64 = 1e-4;
/// Factors at which folds are looked for, outwards from 1.
const FACTORS_DOWN: [f64; 5] = [0.9, 0.8, 0.7, 0.6, 0.5];
const FACTORS_UP: [f64; 6] = [1.1, 1.2, 1.35, 1.5, 1.75, 2.0];

/// Factors of a proportion between which the surface of the model does not fold.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "typescript", derive(ts_rs::TS))]
pub struct ProportionRange {
    /// The proportion.
    pub proportion: Proportion,
    /// Least factor.
    pub min: f64,
    /// Greatest factor.
    pub max: f64,
}

/// A cage of a humanoid, with weights of the bones at its vertices.
#[derive(Clone, Debug)]
pub struct HumanoidCage {
    rest: Vec<Vec3>,
    weights: BoneWeights,
    /// Joints of the bones at rest, object units. Indexed by [`Bone`].
    joints: [Option<DVec3>; N_BONES],
    frame: Frame,
    /// Height of the chin above the middle of the hip joints.
    chin: f64,
    ends: Option<EndFit>,
}

/// Axes of a figure, and heights above the middle of its hip joints.
#[derive(Clone, Copy, Debug)]
struct Frame {
    hips: DVec3,
    up: DVec3,
    left: DVec3,
    forward: DVec3,
    shoulders: f64,
    neck: f64,
    head: f64,
}

impl Frame {
    fn height(&self, p: DVec3) -> f64 {
        (p - self.hips).dot(self.up)
    }

    fn aside(&self, p: DVec3) -> f64 {
        (p - self.hips).dot(self.left)
    }
}

const ARMS: [[Bone; 3]; 2] = [
    [Bone::LeftUpperArm, Bone::LeftLowerArm, Bone::LeftHand],
    [Bone::RightUpperArm, Bone::RightLowerArm, Bone::RightHand],
];
const LEGS: [[Bone; 4]; 2] = [
    [Bone::LeftUpperLeg, Bone::LeftLowerLeg, Bone::LeftFoot, Bone::LeftToes],
    [Bone::RightUpperLeg, Bone::RightLowerLeg, Bone::RightFoot, Bone::RightToes],
];

impl HumanoidCage {
    /// Prepares a cage for proportions.
    ///
    /// `rest`: vertices of the cage, or all controls of a bind, object units, y up, `[n_controls]`. `rings`: as for
    /// [`BoneWeights::of_skin`]. `positions`: vertices of the model at the rest of `rig`.
    #[must_use]
    pub fn new(
        rest: &[Vec3],
        rings: &[Vec<u32>],
        positions: &[Vec3],
        rig: &Rig,
        humanoid: &Humanoid,
    ) -> Self {
        let joints: [Option<DVec3>; N_BONES] =
            std::array::from_fn(|bone| humanoid.at(rig, Bone::ALL[bone].1));
        let at = |bone: Bone| joints[bone as usize].unwrap_or_default();
        let hips = at(Bone::LeftUpperLeg).midpoint(at(Bone::RightUpperLeg));
        let up = (at(Bone::Head) - hips).normalize_or(DVec3::Y);
        let across = at(Bone::LeftUpperLeg) - at(Bone::RightUpperLeg);
        let left = (across - across.dot(up) * up).normalize_or(up.any_orthonormal_vector());
        let mut frame =
            Frame { hips, up, left, forward: left.cross(up), shoulders: 0.0, neck: 0.0, head: 0.0 };
        frame.head = frame.height(at(Bone::Head)).max(1e-6);
        let shoulders = at(Bone::LeftUpperArm).midpoint(at(Bone::RightUpperArm));
        // A stoop may bring the shoulders above the head's joint.
        frame.shoulders = frame.height(shoulders).clamp(0.2 * frame.head, 0.96 * frame.head);
        let neck = joints[Bone::Neck as usize].map_or(frame.shoulders, |neck| frame.height(neck));
        frame.neck = neck.clamp(1.02 * frame.shoulders, 0.99 * frame.head);

        let skin = skin_of_bones(rig, humanoid);
        let of_head = positions.iter().zip(&skin).filter(|(_, row)| row[Bone::Head as usize] > OF_HEAD);
        let mut heights: Vec<f64> = of_head.map(|(p, _)| frame.height(p.as_dvec3())).collect();
        heights.sort_by(f64::total_cmp);
        let outliers = (HEAD_OUTLIERS * heights.len() as f64) as usize;
        let ends = (heights.get(outliers), heights.iter().rev().nth(outliers));
        let chin = if let (Some(low), Some(high)) = ends { low + CHIN * (high - low) } else { frame.head };
        let weights = BoneWeights::of_skin(rest, rings, positions, rig, humanoid);
        // Long hair hangs below the chin.
        let chin = chin.clamp(frame.neck, frame.head);
        Self { rest: rest.to_vec(), weights, joints, frame, chin, ends: None }
    }

    /// Lets poses keep the shape of hands, feet and head better, by the bind of the model: the pose is corrected by
    /// least squares, so that their vertices come closest to their images.
    ///
    /// `weights`: one row per vertex of the model first, one column per control first. The other arguments as for
    /// [`Self::new`].
    #[must_use]
    pub fn with_bind(self, weights: &Weights, positions: &[Vec3], rig: &Rig, humanoid: &Humanoid) -> Self {
        let ends = EndFit::new(self.rest.len(), weights, positions, rig, humanoid);
        Self { ends, ..self }
    }

    /// Weights of the bones at the vertices of the cage.
    #[must_use]
    pub fn weights(&self) -> &BoneWeights {
        &self.weights
    }

    /// Pose of the cage for some proportions, object units. `[n_controls]`
    ///
    /// The lowest vertices of the feet keep their height. Factors of 1 give the cage at rest.
    #[must_use]
    pub fn pose(&self, proportions: &Proportions) -> Vec<Vec3> {
        if *proportions == Proportions::default() {
            return self.rest.clone();
        }
        let frame = &self.frame;
        let maps = self.maps(proportions);
        let mut posed = self.weights.drive(&self.rest, &maps);
        if let Some(ends) = &self.ends {
            ends.correct(&self.rest, &mut posed, &maps);
        }
        let (legs, feet) = (self.shares(|leg| leg), self.shares(|leg| &leg[2..]));
        let clearance = LEG_CLEARANCE * self.height();
        for (side, sign) in [1.0, -1.0].into_iter().enumerate() {
            for (v, p) in posed.iter_mut().enumerate().filter(|(v, _)| legs[side][*v] > OF_LEG) {
                let rest = sign * frame.aside(self.rest[v].as_dvec3());
                let least = rest.min(clearance);
                *p += (least - sign * frame.aside(*p)).max(0.0) * sign * frame.left;
            }
        }
        let is_foot = |v: &usize| feet[0][*v].max(feet[1][*v]) > OF_LEG;
        let lowest = |height: &dyn Fn(usize) -> f64| {
            let all = |is_kept: &dyn Fn(&usize) -> bool| {
                (0..self.rest.len()).filter(is_kept).map(height).fold(f64::INFINITY, f64::min)
            };
            Some(all(&is_foot)).filter(|low| low.is_finite()).unwrap_or_else(|| all(&|_| true))
        };
        let low = lowest(&|v| frame.height(self.rest[v].as_dvec3()));
        let lift = low - lowest(&|v| frame.height(posed[v]));
        let base = frame.hips + low * frame.up;
        let factor = proportions.factor(Proportion::Height, 0);
        posed.iter().map(|p| (base + factor * (*p + lift * frame.up - base)).as_vec3()).collect()
    }

    /// Ranges of factors within which at most 0.01 % of the model's area folds, for both sides together.
    ///
    /// A triangle is folded if its normal turns by more than 90 degrees: the maps stretch and do not rotate. The factors
    /// are tried in steps from 1 down to 0.5 and up to 2; a range ends at the last step without folds.
    ///
    /// `weights`, `frames`: bind of the vertices to the controls. `positions`, `triangles`: the model, object units.
    ///
    /// # Panics
    /// If the weights do not have one column per control of the cage, or a row per vertex.
    #[must_use]
    pub fn ranges(
        &self,
        weights: &Weights,
        frames: &Frames,
        positions: &[Vec3],
        triangles: &[[u32; 3]],
    ) -> Vec<ProportionRange> {
        let normal = |at: &[Vec3], t: &[u32; 3]| {
            let [a, b, c] = t.map(|v| at[v as usize].as_dvec3());
            (b - a).cross(c - a)
        };
        let rest = deform_bound(weights, frames, &self.rest);
        let area: f64 = triangles.iter().map(|t| normal(positions, t).length()).sum();
        let folds = |proportion: Proportion, factor: f64| {
            let mut proportions = Proportions::default();
            proportions.0[proportion as usize] = [factor; 2];
            let posed = deform_bound(weights, frames, &self.pose(&proportions));
            let folded = triangles.iter().map(|t| {
                let before = normal(&rest, t);
                if before.dot(normal(&posed, t)) < 0.0 { before.length() } else { 0.0 }
            });
            folded.sum::<f64>() > FOLDED_AREA * area
        };
        let range = |&(_, proportion): &(&str, Proportion)| {
            let last = |factors: &[f64]| {
                let n = factors.iter().position(|&f| folds(proportion, f)).unwrap_or(factors.len());
                n.checked_sub(1).map_or(1.0, |k| factors[k])
            };
            ProportionRange { proportion, min: last(&FACTORS_DOWN), max: last(&FACTORS_UP) }
        };
        Proportion::ALL.iter().map(range).collect()
    }

    /// Height of the cage, object units.
    fn height(&self) -> f64 {
        let heights = || self.rest.iter().map(|p| self.frame.height(p.as_dvec3()));
        heights().fold(f64::NEG_INFINITY, f64::max) - heights().fold(f64::INFINITY, f64::min)
    }

    /// Sums of the weights of some bones of each leg at each vertex. `[2][n_controls]`
    fn shares(&self, bones: impl Fn(&[Bone]) -> &[Bone]) -> [Vec<f64>; 2] {
        LEGS.map(|leg| {
            let mut sums = vec![0.0; self.rest.len()];
            for &bone in bones(&leg) {
                sums.iter_mut().zip(self.weights.of_bone(bone)).for_each(|(sum, w)| *sum += w);
            }
            sums
        })
    }

    /// Map of each bone.
    fn maps(&self, proportions: &Proportions) -> [Map; N_BONES] {
        let frame = &self.frame;
        let of = |proportion| proportions.factor(proportion, 0);
        let at = |bone: Bone| self.joints[bone as usize].unwrap_or_default();
        let (torso, neck) = self.trunk(&of);
        let mut maps: [Map; N_BONES] = std::array::from_fn(|_| Map::Trunk(torso.clone()));
        let mut set = |bone: Bone, map: Map| maps[bone as usize] = map;
        let chin = at(Bone::Head) + (self.chin - frame.height(at(Bone::Head))) * frame.up;
        let raised = chin + (torso.height(self.chin) - self.chin) * frame.up;
        set(Bone::Head, scaled(chin, raised, of(Proportion::Head)));
        set(Bone::Neck, Map::Trunk(neck));
        for (side, ([arm, forearm, hand], [thigh, shin, foot, toes])) in
            ARMS.into_iter().zip(LEGS).enumerate()
        {
            let of = |proportion| proportions.factor(proportion, side);
            let girth = of(Proportion::Limb);
            let shoulder = at(arm);
            let h = frame.height(shoulder);
            let raised = shoulder
                + (torso.height(h) - h) * frame.up
                + (of(Proportion::Shoulder) - 1.0) * frame.aside(shoulder) * frame.left;
            let hip = at(thigh) + (of(Proportion::Hip) - 1.0) * frame.aside(at(thigh)) * frame.left;
            let limbs = [
                ([arm, forearm, hand], raised, of(Proportion::Arm), of(Proportion::Hand)),
                ([thigh, shin, foot], hip, of(Proportion::Leg), of(Proportion::Foot)),
            ];
            for ([upper, lower, end], top, length, size) in limbs {
                let middle = top + length * (at(lower) - at(upper));
                let last = middle + length * (at(end) - at(lower));
                set(upper, stretched((at(upper), top), at(lower) - at(upper), length, girth));
                set(lower, stretched((at(lower), middle), at(end) - at(lower), length, girth));
                set(end, scaled(at(end), last, size));
                if end == foot {
                    set(toes, scaled(at(end), last, size));
                }
            }
        }
        maps
    }

    /// Maps of the trunk and of the neck.
    fn trunk(&self, of: &impl Fn(Proportion) -> f64) -> (Trunk, Trunk) {
        let frame = &self.frame;
        let Frame { shoulders, neck, head, .. } = *frame;
        let at = |bone: Bone| self.joints[bone as usize].unwrap_or_default();
        let offsets = |p: DVec3| [frame.aside(p), (p - frame.hips).dot(frame.forward)];
        let (torso, hip, waist, across) =
            (of(Proportion::Torso), of(Proportion::Hip), of(Proportion::Waist), of(Proportion::Shoulder));
        let top = torso * neck;
        let [x, z] = offsets(at(Bone::LeftUpperArm).midpoint(at(Bone::RightUpperArm)));
        let trunk = Trunk {
            origin: frame.hips,
            axes: [frame.up, frame.left, frame.forward],
            heights: vec![[0.0, 0.0], [neck, top], [head, top + of(Proportion::Neck) * (head - neck)]],
            widths: vec![
                [0.0, hip, hip.sqrt()],
                [0.45 * shoulders, waist, waist],
                [0.8 * shoulders, 0.5 + 0.5 * across, 1.0],
                [shoulders, across, 1.0],
                [neck, 1.0, 1.0],
            ],
            middle: vec![[0.0; 3], [shoulders, x, z]],
        };
        let mut of_neck = trunk.clone();
        let girth = 1.0 + NECK_SHARE * (of(Proportion::Head).sqrt() - 1.0);
        of_neck.widths.push([head, girth, girth]);
        let [x, z] = offsets(self.joints[Bone::Neck as usize].unwrap_or(at(Bone::Head)));
        of_neck.middle.push([neck, x, z]);
        (trunk, of_neck)
    }
}

/// Map that scales by a factor and moves `from` to `to`.
fn scaled(from: DVec3, to: DVec3, factor: f64) -> Map {
    Map::Affine(about(DMat3::from_diagonal(DVec3::splat(factor)), from, to))
}

/// Map that scales along a bone and across it, and moves `from` to `to`.
fn stretched((from, to): (DVec3, DVec3), bone: DVec3, along: f64, across: f64) -> Map {
    let d = bone.normalize_or_zero();
    let outer = DMat3::from_cols(d * d.x, d * d.y, d * d.z);
    Map::Affine(about(across * DMat3::IDENTITY + (along - across) * outer, from, to))
}

fn about(linear: DMat3, from: DVec3, to: DVec3) -> DAffine3 {
    DAffine3 { matrix3: linear, translation: to - linear * from }
}
