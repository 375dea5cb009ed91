//! The document: all data that can be edited, undone and saved.

use std::hash::{DefaultHasher, Hash, Hasher};
use std::sync::Arc;

use cagework_core::{Bounds, PolygonMesh};
use cagework_io::{Interpolation, MAX_SECONDS, MIN_GAP, SECONDS_PER_POSE, Timeline};
use cagework_pose::blend::blend;
use cagework_pose::proportions::Proportions;
use glam::Vec3;
use serde::{Deserialize, Serialize};

use crate::controls::RestCage;
use crate::models::Models;
use crate::surface::SurfacePoint;

/// Distance of cage vertices in two poses that count as equal, as a fraction of the cage's diagonal. It covers the
/// rounding of blends to f32.
const SAME_POSE: f32 = 1e-5;

/// A saved pose of the cage.
#[derive(Clone, Debug, PartialEq)]
pub struct NamedPose {
    /// Name of the pose, as lists show it.
    pub name: Arc<str>,
    /// Positions of the vertices and inner controls of the cage that the pose was saved for. `[n_controls]`
    pub positions: Arc<[Vec3]>,
    /// Identifies the cage that the pose was saved for, see [`DocumentView::cage_id`](crate::DocumentView::cage_id); `None` if
    /// it is unknown.
    pub cage: Option<u32>,
    /// Surface points that pulls keep in place; `None` if unknown.
    pub pins: Option<Arc<[SurfacePoint]>>,
    /// Time from the previous pose, or from the start of the animation, to this pose, seconds.
    pub lead: f32,
    /// Interpolation of the animation from the previous pose to this one; `None` uses that of [`Transition`].
    pub interpolation: Option<Interpolation>,
    /// Factors of the humanoid's proportions that the positions contain.
    pub proportions: Proportions,
}

/// Name of the animation of the saved poses, how it goes from one to the next, and how it ends.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "typescript", derive(ts_rs::TS))]
pub struct Transition {
    /// Name of the clip in exported files; empty if the user has not named it.
    #[serde(default)]
    pub name: String,
    /// Interpolation towards poses that have none of their own, and of the return to the start.
    pub interpolation: Interpolation,
    /// Whether the animation returns to the shape at its start after the last pose, so that it can repeat.
    pub loops: bool,
    /// Time of the return from the last pose to the shape at the start, seconds.
    pub back: f32,
}

impl Default for Transition {
    fn default() -> Self {
        let (name, interpolation) = (String::new(), Interpolation::Linear);
        Self { name, interpolation, loops: true, back: SECONDS_PER_POSE }
    }
}

impl Transition {
    /// These settings with `back` inside its limits.
    pub(crate) fn within_limits(self) -> Self {
        Self { back: self.back.clamp(MIN_GAP, MAX_SECONDS), ..self }
    }
}

/// A pose that contains factors of proportions, and the same pose with factors of 1. `[n_controls]` each
#[derive(Clone, Debug)]
pub(crate) struct ScaledPose {
    pub(crate) factors: Proportions,
    pub(crate) pose: Arc<[Vec3]>,
    pub(crate) own: Arc<[Vec3]>,
}

/// All data that can be edited, undone and saved. Clones share their contents.
#[derive(Clone, Debug, Default)]
pub struct Document {
    /// The models in the cage.
    pub models: Models,
    /// The cage at rest.
    pub cage: Arc<RestCage>,
    /// Posed positions of cage vertices and inner controls; during reshaping, the new rest positions. `[n_controls]`
    pub pose: Arc<[Vec3]>,
    /// Factors of the humanoid's proportions that `pose` contains.
    pub proportions: Proportions,
    /// `pose` with and without its factors, if a change of the proportions made it.
    pub(crate) scaled_from: Option<ScaledPose>,
    /// Saved poses, in their order in lists and in the animation.
    pub poses: Arc<Vec<NamedPose>>,
    /// Share of each saved pose in `pose`. `[n_poses]`
    pub shares: Arc<[f32]>,
    /// How the animation of the saved poses goes from one to the next, and how it ends.
    pub transition: Transition,
    /// Surface points that pulls keep in place.
    pub pins: Arc<[SurfacePoint]>,
    /// Identifier of the built-in sample that is open.
    pub sample: Option<Arc<str>>,
    /// Whether the cage is the built-in one of `sample`; smoothing and inner controls may differ.
    pub has_sample_cage: bool,
    /// Identifies the joined mesh of the models: documents with equal keys have equal meshes.
    pub(crate) mesh_key: u64,
    /// Identifies the cage at rest: documents with equal keys have equal cages.
    pub(crate) cage_key: u64,
    /// The [`cage_id`] of the cage at rest.
    pub(crate) cage_id: u32,
    /// Identifies the models with their options and [painted amounts](crate::Member::painted).
    pub(crate) models_key: u64,
}

/// Compares contents, not keys.
impl PartialEq for Document {
    fn eq(&self, other: &Self) -> bool {
        self.models == other.models
            && self.cage == other.cage
            && self.pose == other.pose
            && self.proportions == other.proportions
            && self.poses == other.poses
            && self.shares == other.shares
            && self.transition == other.transition
            && self.pins == other.pins
            && self.sample == other.sample
            && self.has_sample_cage == other.has_sample_cage
    }
}

impl Document {
    /// Identifies the inputs of a bind: the joined mesh of the models and the cage at rest.
    #[must_use]
    pub fn key(&self) -> Key {
        Key { mesh: self.mesh_key, cage: self.cage_key }
    }

    /// Whether the pose differs from the cage at rest.
    #[must_use]
    pub fn is_posed(&self) -> bool {
        *self.pose != *self.cage.mesh.positions
    }

    /// Whether the pose differs from the blend of the saved poses by `shares`. False without shares.
    #[must_use]
    pub fn is_modified(&self) -> bool {
        let (poses, shares): (Vec<Vec<Vec3>>, Vec<f32>) = self
            .poses
            .iter()
            .zip(&*self.shares)
            .filter(|(pose, share)| self.fits(pose) && **share != 0.0)
            .map(|(pose, share)| (pose.positions.to_vec(), *share))
            .unzip();
        let rest = &self.cage.mesh.positions;
        let tolerance = SAME_POSE * Bounds::around(rest).map_or(0.0, |bounds| bounds.diagonal());
        let is_far = |(own, of): (&Vec3, &Vec3)| own.distance(*of) > tolerance;
        !poses.is_empty()
            && blend(rest, &poses, &shares).is_ok_and(|blended| self.pose.iter().zip(&blended).any(is_far))
    }

    /// Whether a saved pose was saved for this cage. The number of its positions does not decide, because another cage
    /// can have as many vertices in another order.
    #[must_use]
    pub fn fits(&self, pose: &NamedPose) -> bool {
        pose.cage == Some(self.cage_id) && pose.positions.len() == self.cage.mesh.positions.len()
    }

    /// Saved poses that [fit](Self::fits) the cage.
    pub fn fitting_poses(&self) -> impl Iterator<Item = &NamedPose> {
        self.poses.iter().filter(|pose| self.fits(pose))
    }

    /// Times of the poses that [fit](Self::fits) the cage, seconds, ascending.
    #[must_use]
    pub fn pose_seconds(&self) -> Vec<f32> {
        let mut at = 0.0;
        let time = |(k, pose): (usize, &NamedPose)| {
            at += f64::from(if k == 0 { pose.lead } else { pose.lead.max(MIN_GAP) });
            at as f32
        };
        let seconds: Vec<f32> = self.fitting_poses().enumerate().map(time).collect();
        if seconds.last().is_some_and(|&last| last > MAX_SECONDS) {
            // Long gaps in a project file, or many added poses, exceed the limit: show one pose per second instead.
            return (1..=seconds.len()).map(|k| k as f32 * SECONDS_PER_POSE).collect();
        }
        seconds
    }

    /// Timeline of the poses that [fit](Self::fits) the cage. The page plays it, and exports contain it.
    #[must_use]
    pub fn timeline(&self) -> Timeline {
        let Transition { interpolation, loops, back, .. } = self.transition;
        let seconds = self.pose_seconds();
        // With very many poses, even one per second exceeds `MAX_SECONDS`, and `Timeline::new` rejects the times.
        let timeline = Timeline::new(&seconds, loops.then_some(back));
        let own: Vec<_> = self.fitting_poses().map(|pose| pose.interpolation).collect();
        let timeline = timeline.unwrap_or_else(|_| Timeline::every_second(seconds.len()));
        timeline.with(interpolation).with_own(&own)
    }

    /// Whether a document and a later or earlier clone of it are equal. Compares meshes, cages and models by their
    /// keys.
    #[must_use]
    pub fn is_same(&self, other: &Self) -> bool {
        self.pose == other.pose
            && self.proportions == other.proportions
            && self.key() == other.key()
            && self.models_key == other.models_key
            && (Arc::ptr_eq(&self.poses, &other.poses) || self.poses == other.poses)
            && self.shares == other.shares
            && self.transition == other.transition
            && self.pins == other.pins
            && self.sample == other.sample
            && self.has_sample_cage == other.has_sample_cage
    }

    /// Approximate size of the data that another document does not share, bytes.
    pub(crate) fn bytes_beyond(&self, other: &Self) -> usize {
        let points = |own: &Arc<[Vec3]>, other: &Arc<[Vec3]>| {
            if Arc::ptr_eq(own, other) { 0 } else { size_of_val(&**own) }
        };
        // Estimate for mesh, controls, triangles and subdivided surface: 256 bytes per position.
        let cage =
            if Arc::ptr_eq(&self.cage, &other.cage) { 0 } else { 256 * self.cage.mesh.positions.len() };
        let shares = |pose: &NamedPose| {
            let mut others = other.poses.iter();
            others.any(|o| Arc::ptr_eq(&o.positions, &pose.positions))
        };
        let poses = if Arc::ptr_eq(&self.poses, &other.poses) {
            0
        } else {
            let of = |pose: &NamedPose| {
                size_of::<NamedPose>() + if shares(pose) { 0 } else { size_of_val(&*pose.positions) }
            };
            self.poses.iter().map(of).sum()
        };
        size_of::<Self>()
            + points(&self.pose, &other.pose)
            + cage
            + poses
            + self.models.bytes_beyond(&other.models)
    }
}

/// Identifies the inputs of binds and checks.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Key {
    /// Identifies the joined mesh of the models.
    pub mesh: u64,
    /// Identifies the cage at rest.
    pub cage: u64,
}

/// Hash of a cage's faces and of its positions at rest, by which saved poses find their cage. Poses are absolute
/// positions, so they also depend on the positions at rest.
pub(crate) fn cage_id(mesh: &PolygonMesh) -> u32 {
    let mut hasher = DefaultHasher::new();
    mesh.faces.hash(&mut hasher);
    for x in mesh.positions.iter().flat_map(Vec3::to_array) {
        x.to_bits().hash(&mut hasher);
    }
    hasher.finish() as u32
}
