//! Files.

use cagework_core::deform::deform_bound;
use cagework_core::{Cage, PolygonMesh};
use cagework_io::{Model, write_cage_obj, write_project, write_weights_npz};
use glam::Vec3;
use js_sys::Array;
use wasm_bindgen::JsValue;
use wasm_bindgen::prelude::wasm_bindgen;

use super::Engine;
use super::gesture::pose_list;
use crate::arrays::flat;
use crate::error::{Answer, ErrorName, Fault};
use crate::state::State;
use crate::views::object;

#[wasm_bindgen]
impl Engine {
    /// The model as GLB, as posed.
    ///
    /// # Errors
    /// When it cannot be written.
    #[wasm_bindgen(js_name = exportGlb)]
    pub fn export_glb(&self) -> Result<Vec<u8>, JsValue> {
        let pose = self.read(|state| state.positions.clone());
        let mut posed = self.deformed(&[pose])?;
        Ok(self.read(|state| Answer::Ok(state.the_model()?.write_glb(&posed.pop().unwrap_or_default())?))?)
    }

    /// The model as GLB with a morph target for each pose and an animation through all of them.
    ///
    /// # Errors
    /// When it cannot be written.
    #[wasm_bindgen(js_name = exportPoses)]
    pub fn export_poses(
        &self,
        #[wasm_bindgen(unchecked_param_type = "readonly string[]")] names: Vec<String>,
        #[wasm_bindgen(unchecked_param_type = "readonly Float32Array[]")] poses: &Array,
    ) -> Result<Vec<u8>, JsValue> {
        let posed = self.deformed(&pose_list(poses))?;
        let named: Vec<(String, Vec<Vec3>)> = names.into_iter().zip(posed).collect();
        Ok(self.read(|state| {
            let model = state.the_model()?;
            Answer::Ok(model.write_glb_poses(&model.positions, &named)?)
        })?)
    }

    /// Cage as OBJ, in the pose of the moment.
    ///
    /// # Errors
    /// When there is no cage.
    #[wasm_bindgen(js_name = exportCage)]
    pub fn export_cage(&self) -> Result<Vec<u8>, JsValue> {
        let mesh = self.read(|state| PolygonMesh {
            positions: state.positions.clone(),
            faces: state.rest.faces.clone(),
        });
        if mesh.faces.is_empty() {
            return Err(Fault::missing("cage", "make one first").into());
        }
        Ok(write_cage_obj(&self.read(State::up).mesh_turned_back(&mesh)))
    }

    /// Weights as NPZ, which SciPy loads.
    ///
    /// # Errors
    /// When the model is not bound.
    #[wasm_bindgen(js_name = exportWeights)]
    pub fn export_weights(&self) -> Result<Vec<u8>, JsValue> {
        Ok(self.with_session(|session| {
            let weights =
                session.weights().ok_or_else(|| Fault::missing("weights", "bind the model first"))?;
            Ok(write_weights_npz(weights, session.outside(), &[]))
        })?)
    }

    /// Model, cage, poses and the page's settings as one file.
    ///
    /// # Errors
    /// When there is no model or the file would be too large.
    #[wasm_bindgen(js_name = writeProject)]
    pub fn write_project(
        &self,
        #[wasm_bindgen(unchecked_param_type = "readonly string[]")] names: Vec<String>,
        #[wasm_bindgen(unchecked_param_type = "readonly Float32Array[]")] poses: &Array,
        settings: &str,
    ) -> Result<Vec<u8>, JsValue> {
        let poses: Vec<(String, Vec<Vec3>)> = names.into_iter().zip(pose_list(poses)).collect();
        Ok(self.read(|state| Answer::Ok(write_project(state.the_model()?, &state.rest, &poses, settings)?))?)
    }

    /// What points up in the model's file.
    ///
    /// # Errors
    /// Never.
    #[wasm_bindgen(unchecked_return_type = "UpAxis")]
    pub fn up(&self) -> Result<JsValue, JsValue> {
        Ok(self.read(|state| object(&state.up()))?)
    }

    /// The model's vertices at rest. `[n_vertices, 3]`
    #[wasm_bindgen(js_name = modelPositions)]
    #[must_use]
    pub fn model_positions(&self) -> Vec<f32> {
        self.read(|state| state.model.as_ref().map(|m| flat(&m.positions)).unwrap_or_default())
    }

    /// The model's triangles. `[n_triangles, 3]`
    #[wasm_bindgen(js_name = modelTriangles)]
    #[must_use]
    pub fn model_triangles(&self) -> Vec<u32> {
        self.read(|state| {
            state.model.as_ref().map(|m| m.triangles.as_flattened().to_vec()).unwrap_or_default()
        })
    }
}

impl Engine {
    /// The model in poses of the cage; at rest while it is not bound.
    fn deformed(&self, poses: &[Vec<Vec3>]) -> Answer<Vec<Vec<Vec3>>> {
        let rest = self.read(|state| Answer::Ok(state.the_model()?.positions.clone()))?;
        self.with_session(|session| {
            let Some(weights) = session.weights() else { return Ok(vec![rest; poses.len()]) };
            poses
                .iter()
                .map(|pose| {
                    if pose.len() == weights.n_columns() {
                        Ok(deform_bound(weights, session.outside(), pose))
                    } else {
                        Err(Fault::new(ErrorName::Error, "a pose belongs to another cage"))
                    }
                })
                .collect()
        })
    }
}

impl State {
    pub(crate) fn the_model(&self) -> Answer<&Model> {
        self.model.as_ref().ok_or_else(|| Fault::missing("model", "open one first"))
    }

    /// Model and cage, which a bind needs.
    pub(crate) fn parts(&self) -> Answer<(&Model, &Cage)> {
        let cage = self.cage.as_ref().ok_or_else(|| Fault::missing("cage", "make or open one first"))?;
        Ok((self.the_model()?, cage))
    }
}
