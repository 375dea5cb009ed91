//! Cages as JavaScript passes them.

use cagework_cage::generate::{CageKind, Rings};
use cagework_core::rig::{Joint, Rig};
use cagework_core::{ControlSet, PolygonMesh};
use cagework_editor::{CageControls, RestCage};
use glam::Vec3;
use js_sys::{Float32Array, Uint32Array};
use serde::{Deserialize, Serialize};
use wasm_bindgen::JsValue;

use crate::arrays::{corners, flat, points, polygon_mesh};
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
    /// Kind of a generated cage: skeleton, shell or hull.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[cfg_attr(test, ts(optional))]
    pub(crate) kind: Option<CageKind>,
    /// Why a generated cage of the kind auto has no rings along the skeleton, one sentence.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[cfg_attr(test, ts(optional))]
    pub(crate) refusal: Option<String>,
    /// Rings of a generated cage of the kind skeleton.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[cfg_attr(test, ts(optional))]
    pub(crate) rings: Option<Rings>,
}

/// Joints of a model at rest, and their influences on its vertices.
#[derive(Serialize, Deserialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub(crate) struct RigArrays {
    names: Vec<String>,
    /// Index of the parent of each joint; -1 for a root. `[n_joints]`
    parents: Vec<i32>,
    /// Positions of the joints, object units. `[n_joints, 3]`
    #[serde(with = "serde_wasm_bindgen::preserve")]
    #[cfg_attr(test, ts(type = "Float32Array"))]
    positions: Float32Array,
    /// Start of each vertex's influences in `joints` and `weights`. `[n_vertices + 1]`
    #[serde(with = "serde_wasm_bindgen::preserve")]
    #[cfg_attr(test, ts(type = "Uint32Array"))]
    first: Uint32Array,
    /// Joint of each influence.
    #[serde(with = "serde_wasm_bindgen::preserve")]
    #[cfg_attr(test, ts(type = "Uint32Array"))]
    joints: Uint32Array,
    /// Weight of each influence.
    #[serde(with = "serde_wasm_bindgen::preserve")]
    #[cfg_attr(test, ts(type = "Float32Array"))]
    weights: Float32Array,
}

impl RigArrays {
    pub(crate) fn of(rig: &Rig) -> Self {
        let (joints, weights): (Vec<u32>, Vec<f32>) = rig.influences.iter().copied().unzip();
        let at: Vec<Vec3> = rig.joints.iter().map(|joint| joint.at).collect();
        Self {
            names: rig.joints.iter().map(|joint| joint.name.clone()).collect(),
            parents: rig.joints.iter().map(|joint| joint.parent.map_or(-1, |p| p as i32)).collect(),
            positions: Float32Array::from(flat(&at).as_slice()),
            first: Uint32Array::from(rig.first.as_slice()),
            joints: Uint32Array::from(joints.as_slice()),
            weights: Float32Array::from(weights.as_slice()),
        }
    }

    /// The rig. Its indices are checked when a skeleton is derived from it.
    pub(crate) fn rig(self) -> Rig {
        let at = points(&self.positions.to_vec());
        let joints = self.names.into_iter().zip(self.parents).zip(at);
        Rig {
            joints: joints
                .map(|((name, parent), at)| Joint {
                    name,
                    parent: u32::try_from(parent).ok(),
                    at,
                    bone: None,
                })
                .collect(),
            first: self.first.to_vec(),
            influences: self.joints.to_vec().into_iter().zip(self.weights.to_vec()).collect(),
        }
    }
}

impl CageArrays {
    pub(crate) fn of(mesh: &PolygonMesh) -> Self {
        Self {
            positions: Float32Array::from(flat(&mesh.positions).as_slice()),
            corners: Uint32Array::from(corners(&mesh.faces).as_slice()),
            controls: None,
            bridged: 0,
            notices: Vec::new(),
            kind: None,
            refusal: None,
            rings: None,
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
