//! Methods for the npm package that deform model files and apply weights without a GPU.

use std::collections::BTreeMap;
use std::fmt::Display;

use cagework_core::deform::{deform_finite, displacements};
use cagework_core::field::{CELLS, FieldWeights, Lattice};
use cagework_core::options::{OutsidePolicy, UnknownWord};
use cagework_core::{Binding, Controls, Frames, Weights};
use cagework_editor::{PageBindOptions, RigOptions};
use cagework_io::{Model, ModelFormat, ReshapeOptions};
use cagework_pose::Parts;
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
use crate::weights::BoundArrays;

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
        #[wasm_bindgen(unchecked_param_type = "BindOptions")] options: JsValue,
        #[wasm_bindgen(unchecked_param_type = "RigOptions")] rig: JsValue,
        #[wasm_bindgen(unchecked_param_type = "(event: Progress) => boolean")] progress: Function,
    ) -> Answer<Vec<u8>> {
        let (model, rig): (&Model, RigOptions) = (&loaded.model, decode(rig)?);
        let set = control_set(cage)?;
        let rest = Controls::from(&set).rest().to_vec();
        let posed = pose(&posed, rest.len())?;
        let keeps_rig = model.is_rigged() && !rig.plain;
        let of_rig = of_model(model, &rig)?;
        let extra = if keeps_rig { model.extra_points()? } else { Vec::new() };
        let at = [model.positions.as_slice(), &extra].concat();
        let mut request: PageBindOptions = decode(options)?;
        request.options.extra_points = extra.len();
        // Count the memory for writing the file against the limit, so that a lack of memory is reported before the
        // bind.
        request.options.held = model.bytes() + model.bytes_to_write(model.format());
        if model.n_faces() == 0 {
            let lattice = Lattice::new(Controls::from(&set).surface(), CELLS);
            request.options.outside = OutsidePolicy::Extend;
            let Binding { weights, frames, .. } =
                self.run(&lattice.points(), &set, request, progress).await?;
            let field = FieldWeights::new(lattice, weights, frames).pose(&rest, &posed);
            return Ok(model.write_in_field(model.format(), &field)?);
        }
        let bound = self.run(&at, &set, request, progress).await?;
        if keeps_rig && model.format() == ModelFormat::Gltf {
            let by = displacements(&bound.weights, &bound.frames, &rest, &posed);
            let outside: Vec<u32> = bound.outside.iter().map(|o| o.vertex).collect();
            return Ok(model.write_reshaped(&by, &outside, &[], &of_rig)?.0);
        }
        let deformed = model.deformed((&bound.weights, &bound.frames), (&rest, &posed), &of_rig);
        Ok(model.write(model.format(), &deformed)?)
    }
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
            Proportions::of(request.preset.as_deref(), &request.factors).map_err(|e| wrong(&e))?;
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

/// Prepares the export options of a model. Splits the names of rigid parts into attachments of the skeleton and other
/// parts.
fn of_model(model: &Model, rig: &RigOptions) -> Answer<ReshapeOptions> {
    let options = rig.reshape.clone();
    let props = if rig.plain { Vec::new() } else { model.props()? };
    let (rigid, others): (Vec<_>, Vec<_>) = options.rigid.into_iter().partition(|name| props.contains(name));
    let parts = if others.is_empty() {
        Parts::default()
    } else {
        model.parts(&[], &others).map_err(|e| Fault::new(ErrorName::Error, e))?
    };
    Ok(ReshapeOptions { rigid, parts, ..options })
}

/// Weights for deforming points by many poses.
#[wasm_bindgen]
pub struct Deformer {
    n_controls: usize,
    weights: Weights,
    frames: Frames,
}

#[wasm_bindgen]
impl Deformer {
    /// Creates a deformer from weights for `n_controls` controls.
    ///
    /// # Errors
    /// If the arrays do not match each other or `n_controls`.
    #[wasm_bindgen(constructor)]
    pub fn new(
        n_controls: u32,
        #[wasm_bindgen(unchecked_param_type = "BoundArrays")] rows: JsValue,
    ) -> Answer<Self> {
        let n_controls = n_controls as usize;
        let (weights, frames) = decode::<BoundArrays>(rows)?.bound(n_controls)?;
        Ok(Self { n_controls, weights, frames })
    }

    /// Computes the positions of the points, `[n_points, 3]`, in a pose of the controls, `[n_controls, 3]`.
    ///
    /// # Errors
    /// If the pose does not have `n_controls` points, or moves a point beyond the range of 32-bit floats.
    pub fn deform(&self, posed: &[f32]) -> Answer<Vec<f32>> {
        let posed = pose(posed, self.n_controls)?;
        let points = deform_finite(&self.weights, &self.frames, &posed);
        Ok(flat(&points.map_err(|e| Fault::new(ErrorName::Error, e))?))
    }
}
