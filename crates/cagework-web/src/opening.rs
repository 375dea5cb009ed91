//! Contents that the page opens together with models: cage, poses, and settings of a project.

use cagework_cage::samples;
use cagework_editor::{Contents, DocumentSettings};
use glam::Vec3;
use js_sys::Float32Array;
use serde::{Deserialize, Serialize};

use crate::arrays::points;
use crate::cage::CageArrays;
use crate::error::Answer;
use crate::loaded::LoadedModel;

/// Contents that the page opens together with models.
#[derive(Deserialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub(crate) struct OpenContents {
    /// Identifier of the built-in sample; null for other models.
    sample: Option<String>,
    /// JSON of the page's settings in a project.
    settings: Option<String>,
    cage: Option<CageArrays>,
    /// Poses of a sample. The poses of a project are in its `LoadedModel`.
    poses: Vec<PoseArrays>,
}

/// A saved pose of the cage and the name that the list of poses shows.
#[derive(Serialize, Deserialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub(crate) struct PoseArrays {
    pub(crate) name: String,
    /// Positions of the cage's vertices and inner controls. `[n_controls, 3]`
    #[serde(with = "serde_wasm_bindgen::preserve")]
    #[cfg_attr(test, ts(type = "Float32Array"))]
    pub(crate) positions: Float32Array,
}

impl OpenContents {
    /// Whether the models are neither a sample nor those of a project.
    pub(crate) fn is_new_file(&self) -> bool {
        self.sample.is_none() && self.settings.is_none()
    }

    /// Converts the contents for the editor. Also returns the settings of the project. `first`: the first model.
    pub(crate) fn read(self, first: &LoadedModel) -> Answer<(Contents, DocumentSettings)> {
        let settings = self.settings.as_deref().map(DocumentSettings::read).unwrap_or_default();
        let of_project = self.poses.is_empty();
        let given: Vec<(String, Vec<Vec3>)> = if of_project {
            first.poses().to_vec()
        } else {
            self.poses.into_iter().map(|pose| (pose.name, points(&pose.positions.to_vec()))).collect()
        };
        let cage = self.cage.map(CageArrays::rest_cage).transpose()?.flatten();
        let is_known = |id: &String| samples::all().iter().any(|sample| sample.id == id);
        let contents = Contents {
            poses: settings.poses(given, cage.as_ref()),
            cage,
            shares: settings.shares(),
            transition: settings.transition.clone().unwrap_or_default(),
            pins: settings.pins.clone(),
            bones: settings.given_bones(),
            sample: settings.sample.clone().filter(is_known).or(self.sample),
        };
        Ok((contents, settings))
    }
}
