//! What the worker sends to the page, an array each.

use cagework_core::deform::OutsideVertex;
use cagework_core::{PolygonMesh, Weights};
use glam::Vec3;
use wasm_bindgen::JsValue;
use wasm_bindgen::prelude::wasm_bindgen;

use crate::arrays::{corners, flat};
use crate::controls::CageControls;
use crate::views::object;

/// Weights on their way to the page: compressed sparse rows, and the vertices outside the cage.
#[wasm_bindgen]
pub struct Bound {
    pub(super) weights: Weights,
    pub(super) outside: Vec<OutsideVertex>,
    pub(super) report: JsValue,
}

/// A mesh of polygons on its way to the page.
#[wasm_bindgen]
pub struct Polygons {
    pub(crate) mesh: PolygonMesh,
    /// Separate parts of the model that one made cage joins; 0 if there is one, or no cage was made.
    pub(crate) bridged: u32,
    /// A project's.
    pub(crate) controls: Option<CageControls>,
}

impl From<PolygonMesh> for Polygons {
    fn from(mesh: PolygonMesh) -> Self {
        Self { mesh, bridged: 0, controls: None }
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

    /// Columns: cage vertices. `[n_nonzeros]`
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

    /// For each vertex outside the cage: the vertex and the three corners of its frame. `[n_outside, 4]`
    #[wasm_bindgen(getter)]
    #[must_use]
    pub fn outside(&self) -> Vec<u32> {
        self.outside.iter().flat_map(|o| [o.vertex, o.corners[0], o.corners[1], o.corners[2]]).collect()
    }

    /// Offsets of the vertices outside the cage in their frames. `[n_outside, 3]`
    #[wasm_bindgen(getter)]
    #[must_use]
    pub fn offsets(&self) -> Vec<f32> {
        self.outside.iter().flat_map(|o| o.offset.to_array()).collect()
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
