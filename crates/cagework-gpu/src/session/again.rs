//! A session made again: beside the first, or on another device.

use std::sync::Arc;

use super::Session;
use crate::device::GpuContext;
use crate::error::GpuError;

impl Session {
    /// Another session on the same GPU with the same model, cage and pose, for other weights to compare with: those of closed
    /// forms, which know the plain cage alone.
    ///
    /// # Errors
    /// [`GpuError::NotReady`] without model or cage; otherwise as the calls that set them.
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

    /// Everything again on another device, after this one was lost: model, cage, weights, pose, scene, camera.
    ///
    /// # Errors
    /// As the calls that set them.
    pub async fn recover(self, context: GpuContext) -> Result<Self, GpuError> {
        let mut session = Self::new(context);
        session.camera = self.camera;
        if let Some(model) = self.model {
            session.set_shared_model(model).await?;
            session.parts = self.parts;
        }
        if let Some(controls) = &self.controls {
            session.set_cage(controls).await?;
        }
        if let Some(bound) = self.bound {
            if bound.is_green {
                session.adopt_green(bound.weights).await?;
            } else {
                session.adopt(bound.weights, bound.frames).await?;
            }
        }
        if !self.pose.is_empty() {
            session.pose(&self.pose);
        }
        session.set_scene(self.scene);
        Ok(session)
    }
}
