//! What the worker sends to the page, an array each.

use cagework_core::deform::OutsideVertex;
use cagework_core::{Frames, PolygonMesh, Weights};
use glam::Vec3;
use serde::{Deserialize, Serialize};
use wasm_bindgen::JsValue;
use wasm_bindgen::prelude::wasm_bindgen;

use crate::arrays::{corners, flat};
use crate::views::object;
use cagework_editor::CageControls;

/// Offsets of a bind: what weights of controls alone miss.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub(crate) struct Offsets {
    /// The columns of the weights after those of the controls.
    pub(crate) frames: Frames,
    /// Points outside the cage.
    pub(crate) outside: Vec<OutsideVertex>,
}

/// Weights on their way to the page: compressed sparse rows, and the columns of offsets.
#[wasm_bindgen]
pub struct Bound {
    pub(super) weights: Weights,
    pub(super) offsets: Offsets,
    pub(super) report: JsValue,
}

/// A mesh of polygons on its way to the page.
#[wasm_bindgen]
pub struct Polygons {
    pub(crate) mesh: PolygonMesh,
    /// Separate parts of the model that one made cage joins; 0 if there is one, or no cage was made.
    pub(crate) bridged: u32,
    /// Gaps of the model that a made cage closes, and what would keep each open.
    pub(crate) notices: Vec<String>,
    /// A project's.
    pub(crate) controls: Option<CageControls>,
}

impl From<PolygonMesh> for Polygons {
    fn from(mesh: PolygonMesh) -> Self {
        Self { mesh, bridged: 0, notices: Vec::new(), controls: None }
    }
}

/// A built sample.
#[wasm_bindgen]
pub struct BuiltSample {
    pub(super) glb: Vec<u8>,
    pub(super) positions: Vec<Vec3>,
    pub(super) cage: PolygonMesh,
    pub(super) poses: Vec<(String, Vec<Vec3>)>,
}

#[wasm_bindgen]
impl Bound {
    /// Row pointers. `[n_vertices + 1]`
    #[wasm_bindgen(getter)]
    #[must_use]
    pub fn indptr(&self) -> Vec<u32> {
        self.weights.indptr().to_vec()
    }

    /// Columns: controls, then frames. `[n_nonzeros]`
    #[wasm_bindgen(getter)]
    #[must_use]
    pub fn indices(&self) -> Vec<u32> {
        self.weights.indices().to_vec()
    }

    /// Weights. `[n_nonzeros]`
    #[wasm_bindgen(getter)]
    #[must_use]
    pub fn data(&self) -> Vec<f32> {
        self.weights.data().to_vec()
    }

    /// The frames after the controls, and the points outside the cage.
    ///
    /// # Errors
    /// Never.
    #[wasm_bindgen(getter, unchecked_return_type = "Offsets")]
    pub fn offsets(&self) -> Result<JsValue, JsValue> {
        Ok(object(&self.offsets)?)
    }

    /// The bind report; undefined for coordinates by formula and slices.
    #[wasm_bindgen(getter, unchecked_return_type = "BindReport | undefined")]
    #[must_use]
    pub fn report(&self) -> JsValue {
        self.report.clone()
    }
}

#[wasm_bindgen]
impl Polygons {
    /// Vertices. `[n, 3]`
    #[wasm_bindgen(getter)]
    #[must_use]
    pub fn positions(&self) -> Vec<f32> {
        flat(&self.mesh.positions)
    }

    /// For each face the number of its corners, then them.
    #[wasm_bindgen(getter)]
    #[must_use]
    pub fn corners(&self) -> Vec<u32> {
        corners(&self.mesh.faces)
    }

    /// A project's controls, whose positions stand at the end; undefined for others.
    ///
    /// # Errors
    /// Never.
    #[wasm_bindgen(getter, unchecked_return_type = "CageControls | undefined")]
    pub fn controls(&self) -> Result<JsValue, JsValue> {
        Ok(self.controls.as_ref().map_or(Ok(JsValue::UNDEFINED), object)?)
    }

    /// Separate parts of the model that a made cage joins; 0 if none are joined.
    #[wasm_bindgen(getter)]
    #[must_use]
    pub fn bridged(&self) -> u32 {
        self.bridged
    }

    /// Gaps of the model that a made cage closes, and what would keep each open: a sentence each.
    #[wasm_bindgen(getter)]
    #[must_use]
    pub fn notices(&self) -> Vec<String> {
        self.notices.clone()
    }
}

#[wasm_bindgen]
impl BuiltSample {
    /// The model as GLB.
    #[wasm_bindgen(getter)]
    #[must_use]
    pub fn glb(&self) -> Vec<u8> {
        self.glb.clone()
    }

    /// The model's vertices. `[n_vertices, 3]`
    #[wasm_bindgen(getter)]
    #[must_use]
    pub fn positions(&self) -> Vec<f32> {
        flat(&self.positions)
    }

    /// Its cage.
    #[wasm_bindgen(getter)]
    #[must_use]
    pub fn cage(&self) -> Polygons {
        self.cage.clone().into()
    }

    /// Names of the prepared poses.
    #[wasm_bindgen(getter, js_name = poseNames)]
    #[must_use]
    pub fn pose_names(&self) -> Vec<String> {
        self.poses.iter().map(|(name, _)| name.clone()).collect()
    }

    /// Cage positions of one of them. `[n_cage, 3]`
    #[wasm_bindgen(js_name = posePositions)]
    #[must_use]
    pub fn pose_positions(&self, index: usize) -> Vec<f32> {
        self.poses.get(index).map(|(_, positions)| flat(positions)).unwrap_or_default()
    }
}
