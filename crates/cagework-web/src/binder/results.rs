//! Results of the worker, read by JavaScript one array at a time.

use cagework_core::deform::OutsideVertex;
use cagework_core::{Frames, PolygonMesh, Weights};
use glam::Vec3;
use js_sys::{Array, Float32Array, Uint32Array};
use serde::{Deserialize, Serialize};
use wasm_bindgen::JsValue;
use wasm_bindgen::prelude::wasm_bindgen;

use crate::arrays::{corners, flat};
use crate::error::{Answer, ErrorName, Fault};
use crate::views::{object, optional};
use cagework_editor::CageControls;

/// Frames of a bind, and the points outside the cage.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub(crate) struct Offsets {
    /// Local coordinate frames that carry the part of each position that the weights of the controls do not reproduce.
    /// In the weights, their columns follow the columns of the controls.
    pub(crate) frames: Frames,
    /// Points outside the cage.
    pub(crate) outside: Vec<OutsideVertex>,
}

impl Offsets {
    /// Rebuilds weights and frames from the arrays of a [`BindResult`] with `n_controls` controls.
    ///
    /// # Errors
    /// If the arrays do not match each other or `n_controls`.
    pub(crate) fn bound(
        self,
        n_controls: usize,
        indptr: Vec<u32>,
        indices: Vec<u32>,
        data: Vec<f32>,
    ) -> Answer<(Weights, Frames)> {
        let frames = self.frames;
        if !frames.fits(n_controls) {
            let message =
                format!("offsets has frames of more than {n_controls} controls, or joints without bones");
            return Err(Fault::new(ErrorName::Error, message));
        }
        let n_columns = (n_controls + frames.n_columns()) as u32;
        Ok((Weights::new(n_columns, indptr, indices, data)?, frames))
    }
}

/// Weights as compressed sparse rows, and the frames that the columns after the controls refer to.
#[wasm_bindgen]
pub struct BindResult {
    pub(super) weights: Weights,
    pub(super) offsets: Offsets,
    pub(super) report: JsValue,
}

/// A polygon mesh. For a generated cage, also the generator's report.
#[wasm_bindgen]
pub struct Polygons {
    pub(crate) mesh: PolygonMesh,
    /// Number of disconnected parts of the model that a generated cage joins into one; 0 if it joins none.
    pub(crate) bridged: u32,
    /// Notices of the generator: gaps of the model that the cage covers, and how to keep each gap open.
    pub(crate) notices: Vec<String>,
    /// Subdivision and interior controls; set only for the cage of a project.
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
    pub(super) grip: Vec3,
}

#[wasm_bindgen]
impl BindResult {
    /// Row pointers of the sparse rows. `[n_vertices + 1]`
    #[wasm_bindgen(getter)]
    pub fn indptr(&self) -> Vec<u32> {
        self.weights.indptr().to_vec()
    }

    /// Number of non-zero weights.
    #[wasm_bindgen(getter)]
    pub fn count(&self) -> usize {
        self.weights.data().len()
    }

    /// Column indices and values of the non-zero weights `start` to `end - 1`, so that the page can read them in parts.
    #[wasm_bindgen(unchecked_return_type = "[Uint32Array, Float32Array]")]
    pub fn rows(&self, start: usize, end: usize) -> JsValue {
        let (indices, data) = (self.weights.indices().get(start..end), self.weights.data().get(start..end));
        let indices = Uint32Array::from(indices.unwrap_or_default());
        Array::of2(&indices, &Float32Array::from(data.unwrap_or_default())).into()
    }

    /// Column indices: controls first, then frames. `[n_nonzeros]`
    #[wasm_bindgen(getter)]
    pub fn indices(&self) -> Vec<u32> {
        self.weights.indices().to_vec()
    }

    /// Non-zero weights. `[n_nonzeros]`
    #[wasm_bindgen(getter)]
    pub fn data(&self) -> Vec<f32> {
        self.weights.data().to_vec()
    }

    /// Local coordinate frames that carry the part of each position that the weights of the controls do not reproduce,
    /// and the points outside the cage. In the weights, the columns of the frames follow the columns of the controls.
    #[wasm_bindgen(getter, unchecked_return_type = "Offsets")]
    pub fn offsets(&self) -> JsValue {
        object(&self.offsets)
    }

    /// Report of the bind; undefined for closed-form coordinates, slices and lattices.
    #[wasm_bindgen(getter, unchecked_return_type = "BindReport | undefined")]
    pub fn report(&self) -> JsValue {
        self.report.clone()
    }
}

#[wasm_bindgen]
impl Polygons {
    /// Vertex positions. `[n, 3]`
    #[wasm_bindgen(getter)]
    pub fn positions(&self) -> Vec<f32> {
        flat(&self.mesh.positions)
    }

    /// For each face its corner count, then the vertex indices of its corners.
    #[wasm_bindgen(getter)]
    pub fn corners(&self) -> Vec<u32> {
        corners(&self.mesh.faces)
    }

    /// Subdivision and interior controls of a project's cage; undefined for other meshes. In `positions`, the positions
    /// of interior controls follow the vertices.
    #[wasm_bindgen(getter, unchecked_return_type = "CageControls | undefined")]
    pub fn controls(&self) -> JsValue {
        optional(self.controls.as_ref())
    }

    /// Number of disconnected parts of the model that a generated cage joins into one; 0 if it joins none.
    #[wasm_bindgen(getter)]
    pub fn bridged(&self) -> u32 {
        self.bridged
    }

    /// Notices of the generator, one sentence each: gaps of the model that the cage covers, and how to keep each gap
    /// open.
    #[wasm_bindgen(getter)]
    pub fn notices(&self) -> Vec<String> {
        self.notices.clone()
    }
}

#[wasm_bindgen]
impl BuiltSample {
    /// The model as a GLB file.
    #[wasm_bindgen(getter)]
    pub fn glb(&self) -> Vec<u8> {
        self.glb.clone()
    }

    /// Vertices of the model. `[n_vertices, 3]`
    #[wasm_bindgen(getter)]
    pub fn positions(&self) -> Vec<f32> {
        flat(&self.positions)
    }

    /// The cage of the sample, at rest.
    #[wasm_bindgen(getter)]
    pub fn cage(&self) -> Polygons {
        self.cage.clone().into()
    }

    /// Point of the model that the page asks the user to pull first. `[3]`
    #[wasm_bindgen(getter)]
    pub fn grip(&self) -> Vec<f32> {
        self.grip.to_array().to_vec()
    }

    /// Names of the sample's poses, by the index that `posePositions` takes.
    #[wasm_bindgen(getter, js_name = poseNames)]
    pub fn pose_names(&self) -> Vec<String> {
        self.poses.iter().map(|(name, _)| name.clone()).collect()
    }

    /// Cage positions of the pose at `index`. `[n_cage, 3]`
    #[wasm_bindgen(js_name = posePositions)]
    pub fn pose_positions(&self, index: usize) -> Vec<f32> {
        self.poses.get(index).map(|(_, positions)| flat(positions)).unwrap_or_default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_that_name_no_column_are_refused() {
        let bound = |joints: Vec<u32>, column: u32| {
            let plain = vec![[0.0; 4]; 3 * joints.len()];
            let frames = Frames { joints, plain, whole: vec![[0.0; 3]; 3], ..Frames::default() };
            let offsets = Offsets { frames, outside: Vec::new() };
            offsets.bound(3, vec![0, 1], vec![column], vec![1.0])
        };
        // The frames add 9 columns to the 3 columns of the controls: 3 for the coordinate axes, 3 for the motion of the
        // whole cage, and 3 for the joint.
        assert!(bound(vec![2], 11).is_ok());
        assert!(bound(vec![2], 12).is_err(), "a column");
        assert!(bound(vec![3], 2).is_err(), "a joint");
    }
}
