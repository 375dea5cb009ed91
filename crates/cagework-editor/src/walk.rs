//! The cage follows the clip of a rig that is fitted to the models.

use cagework_core::progress::NoProgress;
use cagework_io::{Clip, Model};
use cagework_job::{ClipPoses, ClipRig, FigureSurface};
use glam::Vec3;
use serde::Serialize;

use crate::document::{Document, Key};
use crate::error::EditError;

/// Clips that the cage can follow, for panels.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(rename_all = "camelCase")]
#[cfg_attr(feature = "typescript", derive(ts_rs::TS))]
pub struct WalkInfo {
    /// Names and lengths of the clips, seconds.
    pub clips: Vec<(String, f32)>,
    /// A sentence if the limbs were not found.
    pub notice: Option<String>,
}

/// A rig that is fitted to the models.
#[derive(Debug)]
pub(crate) struct Walk {
    /// Poses of the cage at the times of clips.
    pub(crate) poses: ClipPoses,
    /// Joints in the models at rest, object units.
    pub(crate) joints: Vec<Vec3>,
    /// The models and the cage that the rig was fitted to.
    pub(crate) key: Key,
}

impl Walk {
    /// Fits a humanoid rig with clips to the models of a document.
    ///
    /// # Errors
    /// [`EditError`] without a cage, or if the rig is not a humanoid with clips.
    pub(crate) fn new(document: &Document, rig: &Model) -> Result<(Self, WalkInfo), EditError> {
        if document.cage.mesh.faces.is_empty() {
            return Err(EditError::NoCage);
        }
        let clips = ClipRig::new(rig, &[])?;
        // `NoProgress` does not cancel.
        let surface_of =
            |(points, triangles)| FigureSurface::new(points, triangles, &NoProgress).unwrap_or_default();
        let own = rig.states(None).map_or_else(|_| FigureSurface::default(), surface_of);
        let surface = surface_of(document.models.states(None).map_err(|_| EditError::NoModel)?);
        let (fit, notice) = clips.fit(&own, &surface);
        let cage = &document.cage;
        let poses = clips.drive(&fit, &surface, &cage.mesh.positions, &cage.controls.rings);
        let named = |(number, clip): (usize, &Clip)| (clip.label(number), clip.seconds);
        let info = WalkInfo { clips: clips.clips().iter().enumerate().map(named).collect(), notice };
        let joints = fit.figure.all().map(|(_, at)| at.as_vec3()).collect();
        Ok((Self { poses, joints, key: document.key() }, info))
    }
}
