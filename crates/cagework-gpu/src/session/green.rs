//! Weights with columns for the cage's triangles.

use std::borrow::Cow;
use std::sync::Arc;

use cagework_core::Weights;
use cagework_core::green::green_controls;
use glam::Vec3;

use super::Session;
use crate::error::GpuError;

impl Session {
    /// Uses Green coordinates: [`cagework_core::green::green_weights`], with additional columns for the
    /// cage's triangles.
    ///
    /// # Errors
    /// As [`Self::adopt`].
    pub async fn adopt_green(&mut self, weights: Weights) -> Result<(), GpuError> {
        let (model, controls) = self.parts()?;
        let cage = controls.cage();
        check_size(&weights, model.positions.len(), cage.n_vertices() + cage.triangles().len())?;
        self.bound(weights.into(), Arc::default(), true, None).await
    }

    /// Vectors that the columns of the weights multiply, for controls at `positions`: these and, with Green
    /// coordinates, those of the triangles.
    pub(super) fn columns<'a>(&self, is_green: bool, positions: &'a [Vec3]) -> Cow<'a, [Vec3]> {
        match self.cage() {
            Some(cage) if is_green => green_controls(cage, positions).into(),
            _ => positions.into(),
        }
    }
}

/// Checks the size of weights.
pub(super) fn check_size(weights: &Weights, rows: usize, columns: usize) -> Result<(), GpuError> {
    if (weights.n_rows(), weights.n_columns()) == (rows, columns) {
        return Ok(());
    }
    let (of, by) = (weights.n_rows(), weights.n_columns());
    let reason = format!(
        "the weights are for {of} vertices and {by} controls, the model and cage have {rows} and {columns}"
    );
    Err(GpuError::Model { reason })
}
