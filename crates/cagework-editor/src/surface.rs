//! Points on the surface of the models.

use glam::Vec3;
use serde::{Deserialize, Serialize};

use crate::models::Models;

/// A point on the surface of the models.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "typescript", derive(ts_rs::TS))]
pub struct SurfacePoint {
    /// Number of the triangle, unique among all models that the document has ever contained.
    pub triangle: u32,
    /// Barycentric coordinates in the triangle.
    pub bary: [f32; 3],
}

impl SurfacePoint {
    /// Position of the point when the vertices are at `positions`, `[n_vertices]`; `None` if the model was removed.
    #[must_use]
    pub fn position(&self, models: &Models, positions: &[Vec3]) -> Option<Vec3> {
        let corners = models.corners(self.triangle)?;
        let at = |k: usize| Some(self.bary[k] * *positions.get(corners[k] as usize)?);
        Some(at(0)? + at(1)? + at(2)?)
    }
}
