//! Weights whose columns are not the cage's vertices alone.

use std::borrow::Cow;
use std::sync::Arc;

use cagework_core::Weights;
use cagework_core::green::green_controls;
use glam::Vec3;

use super::Session;
use crate::error::GpuError;

impl Session {
    /// Takes Green coordinates: [`cagework_core::green::green_weights`], which have a column for each triangle of the cage as well.
    ///
    /// # Errors
    /// As [`Self::adopt`].
    pub async fn adopt_green(&mut self, weights: Weights) -> Result<(), GpuError> {
        let (model, controls) = self.parts()?;
        let cage = controls.cage();
        check_size(&weights, model.positions.len(), cage.n_vertices() + cage.triangles().len())?;
        self.bound(weights.into(), Arc::default(), true, None).await
    }

    /// What the columns of weights stand for where the controls are at `positions`: them, and for Green coordinates, of plain
    /// cages, the triangles.
    pub(super) fn columns<'a>(&self, is_green: bool, positions: &'a [Vec3]) -> Cow<'a, [Vec3]> {
        match self.cage() {
            Some(cage) if is_green => green_controls(cage, positions).into(),
            _ => positions.into(),
        }
    }
}

/// Whether weights are of so many vertices and controls.
pub(super) fn check_size(weights: &Weights, rows: usize, columns: usize) -> Result<(), GpuError> {
    if (weights.n_rows(), weights.n_columns()) == (rows, columns) {
        return Ok(());
    }
    let (of, by) = (weights.n_rows(), weights.n_columns());
    let reason =
        format!("weights are of {of} vertices and {by} controls, but there are {rows} and {columns}");
    Err(GpuError::Model { reason })
}
