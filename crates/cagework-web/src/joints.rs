//! Joints of bound models, where they would be in an export.

use cagework_core::Weights;
use cagework_core::deform::{OutsideVertex, displacements};
use cagework_io::JointPoint;
use glam::Vec3;

use crate::error::Answer;
use crate::models::Models;

/// The joints of bound models.
pub(crate) struct JointDots {
    pub(crate) joints: Vec<JointPoint>,
    /// The number of each joint's model.
    pub(crate) models: Vec<u32>,
    /// At rest. `[n_joints]`
    pub(crate) at: Vec<Vec3>,
    /// How they follow the cage; a row each.
    weights: Weights,
    /// Those outside the cage, ascending.
    outside: Vec<OutsideVertex>,
}

impl JointDots {
    /// `weights`, `outside`: of all points of the rigs.
    ///
    /// # Errors
    /// When the rig cannot be read.
    pub(crate) fn new(models: &Models, weights: &Weights, outside: &[OutsideVertex]) -> Answer<Self> {
        let (mut joints, mut of_joints, mut points) = (Vec::new(), Vec::new(), Vec::new());
        for member in models.iter() {
            let (first_joint, first_point) = (joints.len(), points.len());
            let own = member.model.joints()?;
            of_joints.extend(vec![member.id; own.len()]);
            joints.extend(own.into_iter().map(|joint| JointPoint {
                point: first_point + joint.point,
                parent: joint.parent.map(|parent| first_joint + parent),
                ..joint
            }));
            points.extend(member.model.extra_points()?);
        }
        let rows: Vec<u32> = joints.iter().map(|joint| joint.point as u32).collect();
        let found = |row: &u32| outside.iter().find(|o| o.vertex == *row);
        let of_joint = |(k, row): (u32, &u32)| found(row).map(|&o| OutsideVertex { vertex: k, ..o });
        Ok(Self {
            at: joints.iter().map(|joint| points[joint.point]).collect(),
            weights: weights.with_rows(&rows),
            outside: (0..).zip(&rows).filter_map(of_joint).collect(),
            joints,
            models: of_joints,
        })
    }

    /// Whether one is outside the cage.
    pub(crate) fn is_outside(&self, joint: usize) -> bool {
        self.outside.iter().any(|o| o.vertex as usize == joint)
    }

    /// Where they are in a pose of the cage.
    pub(crate) fn posed(&self, rest: &[Vec3], posed: &[Vec3]) -> Vec<Vec3> {
        let mut by = displacements(&self.weights, &self.outside, rest, posed);
        for (k, joint) in self.joints.iter().enumerate() {
            if self.is_outside(k) && !joint.holds {
                by[k] = joint.parent.map_or(glam::DVec3::ZERO, |parent| by[parent]);
            }
        }
        self.at.iter().zip(by).map(|(&at, by)| (at.as_dvec3() + by).as_vec3()).collect()
    }
}
