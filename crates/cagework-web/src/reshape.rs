//! Methods for the npm package that deform model files.

use std::collections::BTreeMap;
use std::fmt::Display;

use cagework_core::Controls;
use cagework_core::options::UnknownWord;
use cagework_editor::{PageBindOptions, RigOptions};
use cagework_io::Model;
use cagework_job::{BoundPoints, Job, JobOptions, Poses};
use cagework_pose::humanoid::Bone;
use cagework_pose::proportions::{HumanoidCage, Proportions};
use js_sys::{Array, Float32Array, Function, Uint32Array};
use serde::Deserialize;
use wasm_bindgen::JsValue;
use wasm_bindgen::prelude::wasm_bindgen;

use crate::arrays::{flat, pose};
use crate::binder::Binder;
use crate::cage::{RigArrays, control_set};
use crate::error::{Answer, ErrorName, Fault};
use crate::loaded::LoadedModel;
use crate::options::decode;
use crate::views::object;

#[wasm_bindgen]
impl LoadedModel {
    /// Triangles of the model. `[n_triangles, 3]`
    #[wasm_bindgen(getter)]
    pub fn triangles(&self) -> Vec<u32> {
        self.model.triangles.as_flattened().to_vec()
    }

    /// Joints of the model at rest; undefined without joints.
    ///
    /// # Errors
    /// If the joints cannot be read.
    #[wasm_bindgen(unchecked_return_type = "RigArrays | undefined")]
    pub fn rig(&self) -> Answer<JsValue> {
        Ok(self.model.rest_rig()?.map_or(JsValue::UNDEFINED, |rig| object(&RigArrays::of(&rig))))
    }

    /// Returns the geometry that a cage should enclose: positions and triangles of the model at rest, with each morph
    /// target, and in the frames of `clip` if it is given. `[n, 3]` each
    ///
    /// # Errors
    /// If the model has no clip with this name.
    #[wasm_bindgen(unchecked_return_type = "[Float32Array, Uint32Array]")]
    #[allow(clippy::needless_pass_by_value, reason = "wasm-bindgen passes optional strings by value")]
    pub fn states(&self, clip: Option<String>) -> Answer<JsValue> {
        let states = self.model.states(clip.as_deref());
        let (positions, triangles) = states.map_err(|e| Fault::new(ErrorName::Error, e))?;
        let positions = Float32Array::from(flat(&positions).as_slice());
        let triangles = Uint32Array::from(triangles.as_flattened());
        Ok(Array::of2(&positions, &triangles).into())
    }
}

#[wasm_bindgen]
impl Binder {
    /// Binds the model and deforms its file by a posed cage, `[n_controls, 3]`, like `cagework bind` and `cagework
    /// deform`. A glTF model keeps its rig according to `rig` (`RigOptions`; `dynamic` is ignored). Splats and points
    /// follow the field of the cage. Other arguments as for `bind`.
    ///
    /// # Errors
    /// If the bind fails, the pose does not have `n_controls` points, or the deformed file cannot be written.
    pub async fn reshape(
        &self,
        loaded: &LoadedModel,
        #[wasm_bindgen(unchecked_param_type = "CageArrays")] cage: JsValue,
        posed: Vec<f32>,
        #[wasm_bindgen(unchecked_param_type = "BindOptions", js_name = options)] bind_options: JsValue,
        #[wasm_bindgen(unchecked_param_type = "RigOptions")] rig: JsValue,
        #[wasm_bindgen(unchecked_param_type = "(event: Progress) => boolean")] progress: Function,
    ) -> Answer<Vec<u8>> {
        let RigOptions { reshape, plain: shape_only, .. } = decode(rig)?;
        let options = JobOptions { reshape, shape_only, ..JobOptions::default() };
        let job = Job::new(&loaded.model, loaded.model.format().of_exports(), &options)?;
        let set = control_set(cage)?;
        let poses = Poses::Shape(pose(&posed, Controls::from(&set).n_controls())?);
        let mut request: PageBindOptions = decode(bind_options)?;
        let bound = match job.points(&set, &poses, &request.options)? {
            None => BoundPoints::nothing(Controls::from(&set).rest().to_vec()),
            Some(points) => {
                request.options = points.options;
                let binding = self.run(&points.positions, &set, request, progress).await?;
                points.bound(binding, &set)
            }
        };
        job.part_notices().iter().for_each(|notice| warn(notice));
        Ok(job.write(job.deform(&bound, &poses)?)?.bytes)
    }
}

#[wasm_bindgen]
extern "C" {
    /// Writes a warning to the console of the browser or of Node.
    #[wasm_bindgen(js_namespace = console)]
    fn warn(text: &str);
}

/// What `proportions` of the npm package takes beside model and cage.
#[derive(Deserialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub(crate) struct ProportionsRequest {
    /// Factors by the names of the proportions.
    factors: BTreeMap<String, f64>,
    /// Name of a preset whose other factors apply.
    preset: Option<String>,
    /// Joints of humanoid bones that are not found, by the names of the bones in VRM 1.0.
    bones: BTreeMap<String, String>,
}

#[wasm_bindgen]
impl Binder {
    /// Binds the model of a humanoid and poses its cage by proportions (`ProportionsRequest`). Other arguments as for
    /// `bind`. Returns the controls, `[n_controls, 3]`.
    ///
    /// # Errors
    /// If the model is not a humanoid, a name or factor is not valid, or the bind fails.
    pub async fn proportions(
        &self,
        loaded: &LoadedModel,
        #[wasm_bindgen(unchecked_param_type = "CageArrays")] cage: JsValue,
        #[wasm_bindgen(unchecked_param_type = "ProportionsRequest")] request: JsValue,
        #[wasm_bindgen(unchecked_param_type = "BindOptions")] options: JsValue,
        #[wasm_bindgen(unchecked_param_type = "(event: Progress) => boolean")] progress: Function,
    ) -> Answer<Vec<f32>> {
        let (model, request): (&Model, ProportionsRequest) = (&loaded.model, decode(request)?);
        let wrong = |error: &dyn Display| Fault::new(ErrorName::Error, error);
        let named = request.bones.into_iter().map(|(bone, joint)| Ok((bone.parse::<Bone>()?, joint)));
        let bones = named.collect::<Result<Vec<_>, UnknownWord>>().map_err(|e| wrong(&e))?;
        let proportions =
            Proportions::from_preset(request.preset.as_deref(), &request.factors).map_err(|e| wrong(&e))?;
        let (rig, humanoid) = model.humanoid(&bones)?;
        let set = control_set(cage)?;
        let mut request: PageBindOptions = decode(options)?;
        request.options.held = model.bytes();
        let bound = self.run(&model.positions, &set, request, progress).await?;
        let posed = HumanoidCage::new(Controls::from(&set).rest(), &[], &model.positions, &rig, &humanoid);
        let posed = posed.with_bind(&bound.weights, &model.positions, &rig, &humanoid);
        Ok(flat(&posed.pose(&proportions)))
    }
}
