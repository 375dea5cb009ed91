//! The vertices to bind. Vertices at equal positions are joined.

use glam::Vec3;

use super::BindError;
use crate::mesh::{Weld, weld};

/// Numbers of vertices and of distinct positions to bind, from which the memory of a bind is estimated.
#[derive(Clone, Copy, Debug)]
pub(super) struct VertexCounts {
    /// Number of vertices, including those at equal positions.
    pub(super) rows: usize,
    /// Number of distinct positions.
    pub(super) points: usize,
}

/// The vertices of a model and their distinct positions.
pub(super) struct WeldedPoints<'a> {
    pub(super) positions: &'a [Vec3],
    pub(super) welded: Weld,
    pub(super) points: Vec<Vec3>,
}

impl<'a> WeldedPoints<'a> {
    /// Checks positions and joins equal ones.
    ///
    /// # Errors
    /// [`BindError`] if there are no vertices, or if one is not finite.
    pub(super) fn new(positions: &'a [Vec3]) -> Result<Self, BindError> {
        if positions.is_empty() {
            return Err(BindError::EmptyMesh);
        }
        if let Some(vertex) = positions.iter().position(|p| !p.is_finite()) {
            return Err(BindError::NotFinite { vertex: vertex as u32 });
        }
        let welded = weld(positions);
        let points = welded.first.iter().map(|&v| positions[v as usize]).collect();
        Ok(Self { positions, welded, points })
    }

    pub(super) fn count(&self) -> VertexCounts {
        VertexCounts { rows: self.positions.len(), points: self.points.len() }
    }
}
