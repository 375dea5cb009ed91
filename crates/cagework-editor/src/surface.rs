//! Points of the models' surface.

use glam::Vec3;
use serde::{Deserialize, Serialize};

use crate::models::Models;

/// A point of the models' surface.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "typescript", derive(ts_rs::TS))]
pub struct SurfacePoint {
    /// Number of its triangle: see [`Models`].
    pub triangle: u32,
    /// Barycentric coordinates in the triangle.
    pub bary: [f32; 3],
}

impl SurfacePoint {
    /// Where it is for positions of all vertices; none if its model was removed. `[n_vertices]`
    #[must_use]
    pub fn at(&self, models: &Models, positions: &[Vec3]) -> Option<Vec3> {
        let corners = models.corners(self.triangle)?;
        let at = |k: usize| Some(self.bary[k] * *positions.get(corners[k] as usize)?);
        Some(at(0)? + at(1)? + at(2)?)
    }
}
