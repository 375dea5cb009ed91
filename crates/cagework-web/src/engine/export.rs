//! Files.

use cagework_core::deform::{OutsideVertex, deform_bound, displacements};
use cagework_core::dynamic::bend_vertices;
use cagework_core::{ControlSet, InnerControls, PolygonMesh};
use cagework_io::{
    Model, ModelFormat, ReshapeReport, write_cage_obj, write_inner_controls, write_project, write_weights_npz,
};
use glam::{DVec3, Vec3};
use js_sys::{Array, Float32Array, Uint32Array};
use wasm_bindgen::JsValue;
use wasm_bindgen::prelude::wasm_bindgen;

use super::Engine;
use super::gesture::pose_list;
use crate::arrays::flat;
use crate::error::{Answer, ErrorName, Fault};
use crate::options::{RigAsked, taken};
use crate::state::State;
use crate::views::object;

#[wasm_bindgen]
impl Engine {
    /// The model as GLB, as posed; a rigged one with its skeleton, morph targets and clips. Where the cage bends the moving model,
    /// frames of `clip` instead.
    ///
    /// # Errors
    /// When it cannot be written.
    #[wasm_bindgen(js_name = exportGlb)]
    pub fn export_glb(
        &self,
        #[wasm_bindgen(unchecked_param_type = "RigOptions")] options: JsValue,
        clip: u32,
    ) -> Result<Vec<u8>, JsValue> {
        let asked: RigAsked = taken(options)?;
        let (bytes, notices) =
            if asked.dynamic { self.baked(clip as usize)? } else { self.posed_glb(&asked)? };
        self.state.borrow_mut().rig_notices = notices;
        Ok(bytes)
    }

    /// The model's shape as posed, in a format of shapes alone.
    ///
    /// # Errors
    /// When it cannot be written.
    #[wasm_bindgen(js_name = exportShape)]
    pub fn export_shape(
        &self,
        #[wasm_bindgen(unchecked_param_type = "ModelFormat")] format: JsValue,
    ) -> Result<Vec<u8>, JsValue> {
        let format: ModelFormat = taken(format)?;
        let pose = self.read(|state| state.positions.clone());
        let posed = self.deformed(&[pose])?.pop().unwrap_or_default();
        Ok(self.read(|state| Answer::Ok(state.the_model()?.write(format, &posed)?))?)
    }

    /// What the last export did to the rig, each a sentence; they are told once.
    #[wasm_bindgen(js_name = rigNotices)]
    #[must_use]
    pub fn rig_notices(&self) -> Vec<String> {
        std::mem::take(&mut self.state.borrow_mut().rig_notices)
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
        #[wasm_bindgen(unchecked_param_type = "RigOptions")] options: JsValue,
    ) -> Result<Vec<u8>, JsValue> {
        let poses = pose_list(poses);
        let rest = self.read(|state| state.rest().positions.clone());
        let pairs: Vec<_> = names.iter().cloned().zip(poses.iter().cloned()).collect();
        if let Some((bytes, _)) = self.reshaped(&rest, &pairs, &taken(options)?)? {
            return Ok(bytes);
        }
        let posed = self.deformed(&poses)?;
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
            positions: state.positions[..state.made.n_cage()].to_vec(),
            faces: state.rest().faces.clone(),
        });
        if mesh.faces.is_empty() {
            return Err(Fault::missing("cage", "make one first").into());
        }
        Ok(write_cage_obj(&self.read(State::up).mesh_turned_back(&mesh)))
    }

    /// Controls inside as OBJ, in the pose of the moment.
    ///
    /// # Errors
    /// When there are none.
    #[wasm_bindgen(js_name = exportControls)]
    pub fn export_controls(&self) -> Result<Vec<u8>, JsValue> {
        Ok(self.read(|state| {
            if state.made.controls.inner == 0 {
                return Err(Fault::missing("control inside", "put one there first"));
            }
            let positions = state.up().turned_back(&state.positions[state.made.n_cage()..]).into_owned();
            let elements = state.made.controls.elements.clone();
            Ok(write_inner_controls(&InnerControls { positions, elements, radius: None }))
        })?)
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
            self.read(|state| {
                let up = state.up();
                let inner = up.turned_back(state.made.inner_positions());
                let Some((rows, of_rig)) = &state.rig else {
                    return Ok(write_weights_npz(weights, session.outside(), &[], &inner));
                };
                let (mut all, mut outside) = (weights.clone(), session.outside().to_vec());
                all.append(rows);
                let n = weights.n_rows() as u32;
                outside.extend(of_rig.iter().map(|&o| OutsideVertex { vertex: o.vertex + n, ..o }));
                Ok(write_weights_npz(&all, &outside, &state.the_model()?.extra_points()?, &inner))
            })
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
        Ok(self
            .read(|state| Answer::Ok(write_project(state.the_model()?, state.rest(), &poses, settings)?))?)
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

    /// All that is bound: the model's vertices, then the points of its rig. `[n_points, 3]`
    ///
    /// # Errors
    /// When the rig cannot be read.
    #[wasm_bindgen(js_name = boundPoints)]
    pub fn bound_points(&self) -> Result<Vec<f32>, JsValue> {
        Ok(self.read(|state| {
            let Some(model) = &state.model else { return Ok(Vec::new()) };
            let mut points = flat(&model.positions);
            points.extend(flat(&model.extra_points()?));
            Answer::Ok(points)
        })?)
    }

    /// What a cage should enclose: positions and triangles of the model at rest, of its morph targets, and of a clip if one is
    /// named. `[n, 3]` each
    ///
    /// # Errors
    /// When there is no such clip.
    #[wasm_bindgen(js_name = modelStates, unchecked_return_type = "[Float32Array, Uint32Array]")]
    pub fn model_states(&self, clip: Option<String>) -> Result<JsValue, JsValue> {
        let (positions, triangles) = self.read(|state| {
            let states = state.the_model()?.states(clip.as_deref());
            states.map_err(|e| Fault::new(ErrorName::Error, e))
        })?;
        let positions = Float32Array::from(flat(&positions).as_slice());
        let triangles = Uint32Array::from(triangles.as_flattened());
        Ok(Array::of2(&positions, &triangles).into())
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
    /// The model as posed, and what became of its rig.
    pub(super) fn posed_glb(&self, asked: &RigAsked) -> Answer<(Vec<u8>, Vec<String>)> {
        let pose = self.read(|state| state.positions.clone());
        if let Some((bytes, report)) = self.reshaped(&pose, &[], asked)? {
            return Ok((bytes, report.notices()));
        }
        let posed = self.deformed(&[pose])?.pop().unwrap_or_default();
        Ok((self.read(|state| Answer::Ok(state.the_model()?.write_glb(&posed)?))?, Vec::new()))
    }

    /// Frames of a clip, each bent by the cage.
    fn baked(&self, clip: usize) -> Answer<(Vec<u8>, Vec<String>)> {
        let field = self.field()?;
        self.read(|state| {
            let model = state.the_model()?;
            let (mut frames, mut rest) = (model.frames(clip)?, model.positions.clone());
            frames.iter_mut().chain([&mut rest]).for_each(|frame| bend_vertices(&field, frame));
            let told = format!("{} frames became morph targets; the skeleton is left out", frames.len());
            Ok((model.write_baked(clip, &rest, frames)?, vec![told]))
        })
    }

    /// A rigged model in a pose of the cage, or at rest with poses as morph targets; none if it has no rig, or is to be written
    /// without it.
    pub(super) fn reshaped(
        &self,
        pose: &[Vec3],
        poses: &[(String, Vec<Vec3>)],
        asked: &RigAsked,
    ) -> Answer<Option<(Vec<u8>, ReshapeReport)>> {
        if asked.plain || !self.read(|state| state.model.as_ref().is_some_and(Model::is_rigged)) {
            return Ok(None);
        }
        self.with_session(|session| {
            self.read(|state| {
                let (model, rest) = (state.the_model()?, &state.rest().positions);
                let by = |pose: &[Vec3]| match (session.weights(), &state.rig) {
                    (Some(weights), Some((rows, of_rig))) if pose.len() == rest.len() => {
                        let mut by = displacements(weights, session.outside(), rest, pose);
                        by.extend(displacements(rows, of_rig, rest, pose));
                        Ok(by)
                    }
                    (Some(_), _) => Err(Fault::new(ErrorName::Error, "a pose belongs to another cage")),
                    (None, _) => Ok(vec![DVec3::ZERO; model.positions.len() + model.extra_points()?.len()]),
                };
                let n = model.positions.len() as u32;
                let of_rig = state.rig.iter().flat_map(|(_, of_rig)| of_rig).map(|o| o.vertex + n);
                let outside: Vec<u32> = session.outside().iter().map(|o| o.vertex).chain(of_rig).collect();
                let by_poses = poses
                    .iter()
                    .map(|(name, pose)| Ok((name.clone(), by(pose)?)))
                    .collect::<Answer<Vec<_>>>()?;
                let options = asked.options();
                Ok(Some(model.write_reshaped(&by(pose)?, &outside, &by_poses, &options)?))
            })
        })
    }

    /// The model in poses of the cage; at rest while it is not bound.
    pub(super) fn deformed(&self, poses: &[Vec<Vec3>]) -> Answer<Vec<Vec<Vec3>>> {
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
    pub(crate) fn parts(&self) -> Answer<(&Model, &ControlSet)> {
        let set = self.set().ok_or_else(|| Fault::missing("cage", "make or open one first"))?;
        Ok((self.the_model()?, set))
    }
}
