//! Cages as JavaScript passes them.

use cagework_core::{ControlSet, PolygonMesh};
use cagework_editor::{CageControls, RestCage};
use js_sys::{Float32Array, Uint32Array};
use serde::{Deserialize, Serialize};
use wasm_bindgen::JsValue;

use crate::arrays::{corners, flat, polygon_mesh};
use crate::error::Answer;
use crate::options::decode;

/// A cage as arrays, and what its generator says about it.
#[derive(Serialize, Deserialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub(crate) struct CageArrays {
    /// Cage vertices, then controls inside the cage. `[n_controls, 3]`
    #[serde(with = "serde_wasm_bindgen::preserve")]
    #[cfg_attr(test, ts(type = "Float32Array"))]
    pub(crate) positions: Float32Array,
    /// For each face, the number of its corners and then their vertices.
    #[serde(with = "serde_wasm_bindgen::preserve")]
    #[cfg_attr(test, ts(type = "Uint32Array"))]
    pub(crate) corners: Uint32Array,
    /// Subdivision and inner controls. Undefined for a new cage. The document then keeps its inner controls, as
    /// far as they fit into the new cage.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[cfg_attr(test, ts(optional, type = "CageControls | undefined"))]
    pub(crate) controls: Option<CageControls>,
    /// Number of separate parts of the model that a generated cage joins; 0 if it joins none.
    #[serde(default)]
    #[cfg_attr(test, ts(optional, as = "Option<u32>"))]
    pub(crate) bridged: u32,
    /// Sentences about gaps of the model that a generated cage closes, with settings that would keep the gaps open.
    #[serde(default)]
    #[cfg_attr(test, ts(optional, as = "Option<Vec<String>>"))]
    pub(crate) notices: Vec<String>,
}

impl CageArrays {
    pub(crate) fn of(mesh: &PolygonMesh) -> Self {
        Self {
            positions: Float32Array::from(flat(&mesh.positions).as_slice()),
            corners: Uint32Array::from(corners(&mesh.faces).as_slice()),
            controls: None,
            bridged: 0,
            notices: Vec::new(),
        }
    }

    /// Vertices, inner controls and faces.
    ///
    /// # Errors
    /// If `corners` ends in the middle of a face.
    pub(crate) fn mesh(&self) -> Answer<PolygonMesh> {
        polygon_mesh(&self.positions.to_vec(), &self.corners.to_vec())
    }

    /// The cage at rest; `None` without vertices.
    ///
    /// # Errors
    /// If the arrays are not a polygon mesh, or a control does not fit into the cage.
    pub(crate) fn rest_cage(self) -> Answer<Option<RestCage>> {
        let mesh = self.mesh()?;
        if mesh.positions.is_empty() {
            return Ok(None);
        }
        let cage = RestCage::new(mesh, self.controls.unwrap_or_default())?;
        Ok(Some(RestCage { notices: self.notices, ..cage }))
    }

    /// The cage mesh without inner controls, and its number of subdivision steps.
    ///
    /// # Errors
    /// If `corners` ends in the middle of a face.
    pub(crate) fn alone(&self) -> Answer<(PolygonMesh, u32)> {
        let mut mesh = self.mesh()?;
        let (smooth, inner) = self.controls.as_ref().map_or((0, 0), |own| (own.smooth, own.inner));
        mesh.positions.truncate(mesh.positions.len().saturating_sub(inner));
        Ok((mesh, smooth))
    }
}

/// Reads a cage with its inner controls from a [`CageArrays`].
///
/// # Errors
/// If the arrays are not a valid cage, or a control does not fit into the cage.
pub(crate) fn control_set(cage: JsValue) -> Answer<ControlSet> {
    let cage: CageArrays = decode(cage)?;
    Ok(RestCage::new(cage.mesh()?, cage.controls.unwrap_or_default())?.set?)
}
