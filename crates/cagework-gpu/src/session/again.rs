//! Copies a session, on the same GPU or to another one.

use std::sync::Arc;

use super::Session;
use crate::device::GpuContext;
use crate::error::GpuError;

impl Session {
    /// Creates a second session on the same GPU with the same model, cage and pose, for comparing the weights of this
    /// session with coordinates of another kind. It leaves out controls inside the cage, because mean value and Green
    /// coordinates do not support them.
    ///
    /// # Errors
    /// [`GpuError::NotReady`] without model or cage; otherwise as the calls that set model and cage.
    pub async fn twin(&self) -> Result<Self, GpuError> {
        let (_, controls) = self.parts()?;
        let cage = controls.cage();
        let mut twin = Self::new(self.context.clone());
        if let Some(model) = &self.model {
            twin.set_shared_model(Arc::clone(model)).await?;
            twin.parts.clone_from(&self.parts);
        }
        twin.set_cage(cage).await?;
        twin.pose(&self.pose[..cage.n_vertices()]);
        twin.set_scene(self.scene.clone());
        Ok(twin)
    }

    /// Copies this session to another device after its own device was lost. `self` stays unchanged, so the call can be
    /// repeated if the new device is out of memory.
    ///
    /// # Errors
    /// The errors of the calls that set model, cage, weights and parts.
    pub async fn recover(&self, context: GpuContext) -> Result<Self, GpuError> {
        let mut session = Self::new(context);
        session.camera = self.camera;
        if let Some(model) = &self.model {
            session.set_shared_model(Arc::clone(model)).await?;
            session.parts.clone_from(&self.parts);
        }
        if let Some(controls) = &self.controls {
            session.set_cage(controls).await?;
        }
        if let Some(bound) = &self.bound {
            let (weights, frames) = (Arc::clone(&bound.weights), Arc::clone(&bound.frames));
            session.bound(bound.kind, weights, frames, None).await?;
        }
        if !self.pose.is_empty() {
            session.pose(&self.pose);
        }
        session.set_scene(self.scene.clone());
        Ok(session)
    }
}
