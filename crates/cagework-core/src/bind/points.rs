//! What is bound: the vertices of a model, welded.

use glam::Vec3;

use super::BindError;
use super::memory::Vertices;
use crate::mesh::{Weld, weld};

/// The vertices of a model, and their different positions.
pub(super) struct Points<'a> {
    pub(super) positions: &'a [Vec3],
    pub(super) welded: Weld,
    pub(super) points: Vec<Vec3>,
}

impl<'a> Points<'a> {
    /// # Errors
    /// When there are none, or one is not a finite number.
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

    /// How many there are of both.
    pub(super) fn count(&self) -> Vertices {
        Vertices { rows: self.positions.len(), points: self.points.len() }
    }
}
