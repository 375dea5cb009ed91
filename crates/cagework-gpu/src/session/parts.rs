//! Parts of the model that stay in place or are rigid.

use std::sync::Arc;

use cagework_core::Controls;
use cagework_core::deform::deform_bound;
use cagework_pose::parts::Parts;
use glam::Vec3;

use super::Session;
use crate::error::GpuError;

impl Session {
    /// Sets the parts of the model that stay in place or are rigid. The parts also apply to weights that are set later.
    ///
    /// # Errors
    /// [`GpuError::NotReady`] without a model, [`GpuError::Model`] if a vertex does not exist; otherwise as
    /// [`crate::buffers::Allocator::zeros`].
    pub async fn set_parts(&mut self, parts: Parts) -> Result<(), GpuError> {
        let Some(model) = &self.model else { return Err(GpuError::NotReady { missing: "model" }) };
        let n = model.positions.len();
        let is_there = |v: &u32| (*v as usize) < n;
        let is_whole = parts.stays.is_empty() || parts.stays.len() == n;
        if !is_whole || !parts.rigid.iter().flatten().all(is_there) {
            let reason = "a held or rigid part refers to a vertex that does not exist".to_owned();
            return Err(GpuError::Model { reason });
        }
        self.parts = parts;
        self.hold().await
    }

    /// Prepares the parts for the current weights.
    pub(super) async fn hold(&mut self) -> Result<(), GpuError> {
        let (Some(bound), Some(model), Some(set)) = (&self.bound, &self.model, &self.controls) else {
            return Ok(());
        };
        let columns = self.columns(bound.kind, &self.pose).into_owned();
        let at_rest = self.columns(bound.kind, Controls::from(set).rest());
        let ready = self.parts.bound(&model.positions, &bound.weights, &bound.frames, &at_rest).map(Arc::new);
        if let Some(bound) = &mut self.bound {
            bound.mover.hold(&self.context, model, ready.clone()).await?;
            bound.mover.pose(&self.context, &columns);
            bound.parts = ready;
        }
        self.moved = true;
        Ok(())
    }

    /// Vertices deformed on the CPU, `[n_vertices]`, object units. `None` without weights.
    ///
    /// # Panics
    /// If the length of `pose` differs from the number of controls.
    #[must_use]
    pub fn deformed(&self, pose: &[Vec3]) -> Option<Vec<Vec3>> {
        let bound = self.bound.as_ref()?;
        let columns = self.columns(bound.kind, pose);
        let mut positions = deform_bound(&bound.weights, &bound.frames, &columns);
        if let Some(parts) = &bound.parts {
            parts.hold(&columns, &mut positions);
        }
        Some(positions)
    }
}
