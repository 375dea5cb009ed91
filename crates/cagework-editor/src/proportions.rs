//! Proportions of the humanoid that the models form: legs, arms, head and so on are scaled by factors.
//!
//! A change of the factors displaces the pose by the difference of two cages at rest: the one with the new factors minus
//! the one with the old factors. So pulled vertices keep their displacement, and factors of 1 give the pulled pose.

use std::collections::BTreeMap;
use std::sync::Arc;

use cagework_core::options::Choice;
use cagework_core::{Frames, Weights};
use cagework_pose::humanoid::{Bone, HumanoidError};
use cagework_pose::proportions::{HumanoidCage, PRESETS, Preset, Proportion, Proportions};
use glam::{DVec3, Vec3};

use crate::bound::{BoundDocument, BoundError};
use crate::document::{Document, ScaledPose};
use crate::editor::Editor;
use crate::error::EditError;

/// Distance from the cage at rest within which a pose without factors is at rest, relative to the size of the
/// coordinates: a few roundings of 32-bit numbers.
const ROUNDING: f64 = 1e-6;
/// Maximum number of triangles in which folds are looked for. Larger models are sampled.
const MAX_FOLD_TRIANGLES: usize = 8_000;
/// Number of consecutive triangles that a sample takes together, because they share most of their vertices.
const FOLD_RUN: usize = 32;

impl Editor {
    /// Sets the weights by which the models follow the cage; `None` before a bind. With them, hands, feet and head keep
    /// their shape better when proportions change.
    pub fn set_bind(&mut self, weights: Option<&Arc<Weights>>) {
        let key = self.document().key();
        self.humanoid_cache().bind = weights.map(|weights| (key, Arc::clone(weights)));
    }

    /// Sets the factor of a proportion by name, such as "leg" or "left_leg".
    pub(crate) fn set_proportion(&mut self, name: &str, factor: f64) -> Result<(), EditError> {
        let mut next = self.document().proportions;
        next.set(name, factor)?;
        self.set_proportions(next)
    }

    /// Sets the factors of a preset. A preset of one factor keeps the others, so that presets add up; with a preset of
    /// several factors the others become 1.
    pub(crate) fn set_preset(&mut self, name: &str) -> Result<(), EditError> {
        let only = PRESETS.iter().filter(|preset| preset.name == name).find_map(Preset::only_factor);
        match only {
            Some((proportion, factor)) => self.set_proportion(proportion, factor),
            None => self.set_proportions(Proportions::from_preset(Some(name), &BTreeMap::new())?),
        }
    }

    /// Gives the right side the factors of the left side.
    pub(crate) fn mirror_proportions(&mut self) -> Result<(), EditError> {
        let mut next = self.document().proportions;
        for (name, proportion) in Proportion::ALL {
            let left = next.factor(*proportion, 0);
            next.set(name, left)?;
        }
        self.set_proportions(next)
    }

    /// Moves the cage by the difference of two sets of factors.
    pub(crate) fn set_proportions(&mut self, next: Proportions) -> Result<(), EditError> {
        if next == self.document().proportions {
            return Ok(());
        }
        let cage = self.humanoid_cage()?;
        let own = self.document().without_proportions(&cage);
        let pose = with_proportions(&own, &self.document().cage.mesh.positions, &cage, &next);
        self.set_scaled_pose(next, own, pose);
        Ok(())
    }

    /// Names the joint of a bone; `None` leaves it to what the file says. Keeps the factors, and moves the cage to
    /// where they bring it with the new bone.
    pub(crate) fn set_bone(&mut self, bone: Bone, joint: Option<String>) -> Result<(), EditError> {
        let before = self.humanoid_cage().ok();
        let own = before.as_ref().map(|cage| self.document().without_proportions(cage));
        let mut next = self.document().clone();
        // A joint that is another bone is exchanged with it.
        if let (Some(joint), Ok(humanoid)) = (&joint, self.humanoid_of(&next)) {
            let rig = next.models.rest_rig().unwrap_or_default();
            let named = humanoid.named(&rig);
            let before = named.iter().find(|found| found.bone == bone).map(|found| found.joint.clone());
            if let Some(other) = named.iter().find(|found| found.joint == *joint && found.bone != bone) {
                next.models.set_bone(other.bone, before);
            }
        }
        next.models.set_bone(bone, joint);
        match self.humanoid_of(&next) {
            // Several bones of an unknown skeleton are named one after the other.
            Err(fault) if before.is_some() || !matches!(fault, HumanoidError::Missing { .. }) => {
                return Err(fault.into());
            }
            _ => {}
        }
        self.change_parts(|models| {
            *models = next.models;
            Ok(())
        })?;
        let factors = self.document().proportions;
        if let (Some(own), Ok(cage)) = (own, self.humanoid_cage())
            && factors != Proportions::default()
        {
            let pose = with_proportions(&own, &self.document().cage.mesh.positions, &cage, &factors);
            self.set_scaled_pose(factors, own, pose);
        }
        Ok(())
    }
}

impl Document {
    /// Replaces the pose. The pose without factors moves by the same displacement, so that factors of 1 give it exactly,
    /// also after another bind.
    pub(crate) fn replace_pose(&mut self, pose: Arc<[Vec3]>) {
        let known = self.scaled_pose().cloned();
        self.scaled_from = known.map(|ScaledPose { factors, pose: before, own }| {
            let moved = |((own, new), old): ((&Vec3, &Vec3), &Vec3)| {
                (own.as_dvec3() + (new.as_dvec3() - old.as_dvec3())).as_vec3()
            };
            let own = own.iter().zip(&*pose).zip(&*before).map(moved).collect();
            ScaledPose { factors, pose: Arc::clone(&pose), own }
        });
        self.pose = pose;
    }

    /// The pose with and without its factors, if both are known.
    fn scaled_pose(&self) -> Option<&ScaledPose> {
        let is_current =
            |known: &&ScaledPose| known.factors == self.proportions && Arc::ptr_eq(&known.pose, &self.pose);
        self.scaled_from.as_ref().filter(is_current)
    }

    /// The pose without its factors, object units. `[n_controls]`
    fn without_proportions(&self, cage: &HumanoidCage) -> Arc<[Vec3]> {
        if self.proportions == Proportions::default() {
            return Arc::clone(&self.pose);
        }
        if let Some(known) = self.scaled_pose() {
            return Arc::clone(&known.own);
        }
        let rest = &self.cage.mesh.positions;
        let scaled = cage.pose(&self.proportions);
        let own = |((&at, &rest), &scaled): ((&Vec3, &Vec3), &Vec3)| {
            let by: DVec3 = at.as_dvec3() - scaled.as_dvec3();
            let size = f64::from(at.abs().max(scaled.abs()).max_element());
            // Exactly at rest, so that the cage counts as not posed.
            if by.length() <= ROUNDING * size { rest } else { (rest.as_dvec3() + by).as_vec3() }
        };
        self.pose.iter().zip(rest).zip(&scaled).map(own).collect()
    }

    /// Factors of all proportions, on the left and on the right. `[n_proportions, 2]`
    pub(crate) fn factors(&self) -> Vec<f64> {
        let of = |(_, proportion): &(&str, Proportion)| {
            [0, 1].map(|side| self.proportions.factor(*proportion, side))
        };
        Proportion::ALL.iter().flat_map(of).collect()
    }

    /// Name of the preset that the factors are, if they are one.
    pub(crate) fn preset(&self) -> Option<&'static str> {
        let is_it = |preset: &&Preset| preset.proportions().is_ok_and(|factors| factors == self.proportions);
        PRESETS.iter().find(is_it).map(|preset| preset.name)
    }
}

/// A pose without factors, moved by factors. `[n_controls]`
fn with_proportions(
    own: &Arc<[Vec3]>,
    rest: &[Vec3],
    cage: &HumanoidCage,
    factors: &Proportions,
) -> Arc<[Vec3]> {
    if *factors == Proportions::default() {
        return Arc::clone(own);
    }
    let at = |((own, rest), scaled): ((&Vec3, &Vec3), Vec3)| {
        (own.as_dvec3() + (scaled.as_dvec3() - rest.as_dvec3())).as_vec3()
    };
    own.iter().zip(rest).zip(cage.pose(factors)).map(at).collect()
}

/// A part of a bound humanoid, in which the ranges of the proportions without folds are measured.
pub struct FoldSample {
    /// Weights of the vertices.
    pub weights: Weights,
    /// Frames of the weights.
    pub frames: Arc<Frames>,
    /// Vertices at rest, object units.
    pub positions: Vec<Vec3>,
    /// Triangles of these vertices, at most 8,000.
    pub triangles: Vec<[u32; 3]>,
}

impl BoundDocument<'_> {
    /// Takes triangles of the models, for [`HumanoidCage::ranges`].
    ///
    /// # Errors
    /// Before a bind.
    pub fn fold_sample(&self) -> Result<FoldSample, BoundError> {
        let bound = self.require_bound()?;
        let models = &self.document().models;
        let step = models.triangles().len().div_ceil(MAX_FOLD_TRIANGLES).max(1);
        let mut number = vec![None; models.positions().len()];
        let mut vertices: Vec<u32> = Vec::new();
        let mut own = |v: u32| {
            *number[v as usize].get_or_insert_with(|| {
                vertices.push(v);
                vertices.len() as u32 - 1
            })
        };
        let runs = models.triangles().chunks(FOLD_RUN).step_by(step);
        let triangles = runs.flatten().map(|t| t.map(&mut own)).collect();
        let positions = vertices.iter().map(|&v| models.positions()[v as usize]).collect();
        let (weights, frames) = (bound.weights.with_rows(&vertices), Arc::clone(&bound.frames));
        Ok(FoldSample { weights, frames, positions, triangles })
    }
}
