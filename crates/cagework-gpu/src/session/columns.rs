//! Columns of the weights of each kind of coordinates.

use std::borrow::Cow;
use std::sync::Arc;

use cagework_core::{Coordinates, Weights};
use glam::Vec3;

use super::Session;
use crate::error::GpuError;

impl Session {
    /// Replaces the weights by those that [`Coordinates::weights`] has computed for the session's model and cage.
    ///
    /// # Errors
    /// As [`Self::adopt`].
    pub async fn adopt_closed_form(&mut self, kind: Coordinates, weights: Weights) -> Result<(), GpuError> {
        let (model, controls) = self.parts()?;
        check_size(&weights, model.positions.len(), kind.n_columns(controls.cage()))?;
        self.bound(kind, weights.into(), Arc::default(), None).await
    }

    /// Vectors that the columns of the weights multiply: [`Coordinates::columns`] of the session's cage.
    pub(super) fn columns<'a>(&self, kind: Coordinates, positions: &'a [Vec3]) -> Cow<'a, [Vec3]> {
        self.cage().map_or(positions.into(), |cage| kind.columns(cage, positions))
    }
}

/// Checks that weights have `rows` rows and `columns` columns.
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
