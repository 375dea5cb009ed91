//! Results of the worker, read by JavaScript one array at a time.

use cagework_core::deform::OutsideVertex;
use cagework_core::{Frames, PolygonMesh, Weights};
use glam::Vec3;
use serde::{Deserialize, Serialize};
use wasm_bindgen::JsValue;
use wasm_bindgen::prelude::wasm_bindgen;

use crate::arrays::{corners, flat};
use crate::views::object;
use cagework_editor::CageControls;

/// Offsets of a bind: the frames, whose columns follow those of the controls, and the points outside the cage.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub(crate) struct Offsets {
    /// Frames; their columns follow those of the controls.
    pub(crate) frames: Frames,
    /// Points outside the cage.
    pub(crate) outside: Vec<OutsideVertex>,
}

/// Weights as compressed sparse rows, with the frames of the columns after the controls.
#[wasm_bindgen]
pub struct Bound {
    pub(super) weights: Weights,
    pub(super) offsets: Offsets,
    pub(super) report: JsValue,
}

/// A polygon mesh; for generated cages with the generator's report.
#[wasm_bindgen]
pub struct Polygons {
    pub(crate) mesh: PolygonMesh,
    /// Number of separate parts of the model that a generated cage joins; 0 if it joins none.
    pub(crate) bridged: u32,
    /// Notices of the generator: gaps of the model that the cage closes, and how to keep each open.
    pub(crate) notices: Vec<String>,
    /// Subdivision and interior controls of a project's cage.
    pub(crate) controls: Option<CageControls>,
}

impl From<PolygonMesh> for Polygons {
    fn from(mesh: PolygonMesh) -> Self {
        Self { mesh, bridged: 0, notices: Vec::new(), controls: None }
    }
}

/// A built-in sample: model, cage and poses.
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

    /// The frames, whose columns follow those of the controls, and the points outside the cage.
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

    /// Subdivision and interior controls of a project's cage, whose positions follow the vertices; undefined for other
    /// meshes.
    ///
    /// # Errors
    /// Never.
    #[wasm_bindgen(getter, unchecked_return_type = "CageControls | undefined")]
    pub fn controls(&self) -> Result<JsValue, JsValue> {
        Ok(self.controls.as_ref().map_or(Ok(JsValue::UNDEFINED), object)?)
    }

    /// Number of separate parts of the model that a generated cage joins; 0 if it joins none.
    #[wasm_bindgen(getter)]
    #[must_use]
    pub fn bridged(&self) -> u32 {
        self.bridged
    }

    /// Notices of the generator, a sentence each: gaps of the model that the cage closes, and how to keep each open.
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

    /// The cage of the sample.
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

    /// Cage positions of the pose at `index`. `[n_cage, 3]`
    #[wasm_bindgen(js_name = posePositions)]
    #[must_use]
    pub fn pose_positions(&self, index: usize) -> Vec<f32> {
        self.poses.get(index).map(|(_, positions)| flat(positions)).unwrap_or_default()
    }
}
