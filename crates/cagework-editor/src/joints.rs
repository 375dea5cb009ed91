//! Positions of the joints of bound models, as an export would place them.

use cagework_core::Frames;
use cagework_core::Weights;
use cagework_core::deform::displacements;
use cagework_io::JointPoint;
use glam::Vec3;

use crate::error::EditError;
use crate::models::Models;

/// Joints of all bound models with their weights.
pub struct JointDots {
    /// The joints; `point` and `parent` count over all models.
    pub joints: Vec<JointPoint>,
    /// Id of the model that each joint belongs to. `[n_joints]`
    pub models: Vec<u32>,
    /// Positions of the joints at rest. `[n_joints]`
    pub at: Vec<Vec3>,
    /// Weights of the controls at the joints, one row per joint.
    weights: Weights,
    frames: Frames,
    /// Indices of joints outside the cage, ascending.
    outside: Vec<usize>,
}

impl JointDots {
    /// Finds the joints of all models. `weights`, `frames`: results of binding all points of the rigs. `outside`:
    /// indices of points outside the cage, ascending.
    ///
    /// # Errors
    /// If a rig cannot be read.
    pub(crate) fn new(
        models: &Models,
        weights: &Weights,
        frames: Frames,
        outside: &[u32],
    ) -> Result<Self, EditError> {
        let (mut joints, mut of_joints, mut points) = (Vec::new(), Vec::new(), Vec::new());
        for member in models.iter() {
            let (first_joint, first_point) = (joints.len(), points.len());
            let own = member.joints()?;
            of_joints.extend(vec![member.id; own.len()]);
            joints.extend(own.iter().map(|&joint| JointPoint {
                point: first_point + joint.point,
                parent: joint.parent.map(|parent| first_joint + parent),
                ..joint
            }));
            points.extend_from_slice(member.extra_points()?);
        }
        let rows: Vec<u32> = joints.iter().map(|joint| joint.point as u32).collect();
        Ok(Self {
            at: joints.iter().map(|joint| points[joint.point]).collect(),
            weights: weights.with_rows(&rows),
            outside: (0..rows.len()).filter(|&k| outside.binary_search(&rows[k]).is_ok()).collect(),
            frames,
            joints,
            models: of_joints,
        })
    }

    /// Whether a joint is outside the cage.
    #[must_use]
    pub fn is_outside(&self, joint: usize) -> bool {
        self.outside.contains(&joint)
    }

    /// Computes the positions of the joints in a pose of the cage. `[n_joints]`
    #[must_use]
    pub fn posed(&self, rest: &[Vec3], posed: &[Vec3]) -> Vec<Vec3> {
        let mut by = displacements(&self.weights, &self.frames, rest, posed);
        for (k, joint) in self.joints.iter().enumerate() {
            if self.is_outside(k) && !joint.holds {
                by[k] = joint.parent.map_or(glam::DVec3::ZERO, |parent| by[parent]);
            }
        }
        self.at.iter().zip(by).map(|(&at, by)| (at.as_dvec3() + by).as_vec3()).collect()
    }
}
