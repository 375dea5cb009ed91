//! Playback of clips: the mesh follows its skeleton instead of the cage.

use cagework_core::field::Field;
use cagework_core::skin::Skin;
use glam::Mat4;

use super::Session;
use crate::error::GpuError;

impl Session {
    /// Makes the mesh follow a skin instead of the cage until [`Self::stop_playing`]. [`Self::play`] sets the pose of
    /// the skin. `skin` has one entry per vertex of the model; `field`: displacements added after skinning.
    ///
    /// # Errors
    /// [`GpuError::NotReady`] before a bind, [`GpuError::Model`] if the skin's size does not match; otherwise
    /// as [`crate::buffers::Allocator::zeros`].
    pub async fn start_playing(&mut self, skin: &Skin, field: Option<Field>) -> Result<(), GpuError> {
        let (model, _) = self.parts()?;
        let Some(bound) = &self.bound else { return Err(GpuError::NotReady { missing: "bind" }) };
        if skin.positions.len() != model.positions.len() {
            let (given, n) = (skin.positions.len(), model.positions.len());
            return Err(GpuError::Model { reason: format!("a skin of {given} vertices for a model of {n}") });
        }
        self.playing = Some(bound.mover.skinner(&self.context, model, skin, field).await?);
        self.moved = true;
        Ok(())
    }

    /// Sets joint matrices and morph weights for the next frame.
    pub fn play(&mut self, palette: &[Mat4], targets: &[f32]) {
        if let Some(skinner) = &mut self.playing {
            skinner.pose(&self.context, palette, targets);
            self.moved = true;
        }
    }

    /// If `on`, makes the mesh follow the cage although a clip plays; otherwise, makes it follow the skin again.
    pub fn interrupt_playing(&mut self, on: bool) {
        self.moved |= self.interrupted != on;
        self.interrupted = on;
    }

    /// Ends playback: the mesh follows the cage again.
    pub fn stop_playing(&mut self) {
        self.moved |= self.playing.take().is_some();
    }
}
