//! Contents that the page opens together with models: cage, poses, and settings of a project.

use cagework_cage::samples;
use cagework_editor::{CageControls, Contents, DocumentSettings, RestCage};
use glam::Vec3;
use serde::Deserialize;

use crate::arrays::{points, polygon_mesh};
use crate::error::Answer;
use crate::loaded::LoadedModel;

/// Contents that the page opens together with models.
#[derive(Deserialize)]
#[cfg_attr(test, derive(serde::Serialize, ts_rs::TS))]
pub(crate) struct OpenContents {
    /// Identifier of the built-in sample; null for other models.
    sample: Option<String>,
    /// JSON of the page's settings in a project.
    settings: Option<String>,
    cage: Option<CageContents>,
    /// Poses of a sample. The poses of a project are in its `LoadedModel`.
    poses: Vec<PoseContents>,
}

/// A cage that the page opens.
#[derive(Deserialize)]
#[cfg_attr(test, derive(serde::Serialize, ts_rs::TS))]
pub(crate) struct CageContents {
    /// Positions of the cage's vertices and interior controls. `[n_controls, 3]`
    #[cfg_attr(test, ts(type = "Float32Array"))]
    positions: Vec<f32>,
    /// For each face, the number of its corners, then the vertex index of each corner.
    #[cfg_attr(test, ts(type = "Uint32Array"))]
    corners: Vec<u32>,
    #[cfg_attr(test, ts(optional = nullable))]
    controls: Option<CageControls>,
    notices: Vec<String>,
}

/// A saved pose of the cage and the name that the list of poses shows.
#[derive(Deserialize)]
#[cfg_attr(test, derive(serde::Serialize, ts_rs::TS))]
pub(crate) struct PoseContents {
    name: String,
    /// Positions of the cage's vertices and interior controls. `[n_controls, 3]`
    #[cfg_attr(test, ts(type = "Float32Array"))]
    positions: Vec<f32>,
}

impl OpenContents {
    /// Converts the contents for the editor. Also returns the settings of the project. `first`: the first model.
    pub(crate) fn read(self, first: &LoadedModel) -> Answer<(Contents, DocumentSettings)> {
        let settings = self.settings.as_deref().map(DocumentSettings::read).unwrap_or_default();
        let of_project = self.poses.is_empty();
        let given: Vec<(String, Vec<Vec3>)> = if of_project {
            first.poses().to_vec()
        } else {
            self.poses.into_iter().map(|pose| (pose.name, points(&pose.positions))).collect()
        };
        let cage = match self.cage {
            Some(CageContents { positions, corners, controls, notices }) if !positions.is_empty() => {
                let mesh = polygon_mesh(&positions, &corners)?;
                Some(RestCage { notices, ..RestCage::new(mesh, controls.unwrap_or_default())? })
            }
            _ => None,
        };
        let is_known = |id: &String| samples::all().iter().any(|sample| sample.id == id);
        let contents = Contents {
            poses: settings.poses(given, cage.as_ref()),
            cage,
            shares: settings.pose_shares.clone(),
            transition: settings.transition.unwrap_or_default(),
            pins: settings.pins.clone(),
            sample: settings.sample.clone().filter(is_known).or(self.sample),
        };
        Ok((contents, settings))
    }
}
