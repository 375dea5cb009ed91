//! For the npm package: models in, models out, and weights without a picture.

use cagework_core::deform::{deform_bound, displacements};
use cagework_core::{Controls, Frames, Weights};
use cagework_io::{Model, ModelFormat, ReshapeOptions};
use cagework_pose::Parts;
use glam::Vec3;
use js_sys::{Array, Float32Array, Function, Uint32Array};
use wasm_bindgen::JsValue;
use wasm_bindgen::prelude::wasm_bindgen;

use crate::arrays::{flat, points};
use crate::binder::{Binder, Offsets};
use crate::controls::control_set;
use crate::error::{Answer, ErrorName, Fault};
use crate::loaded::Loaded;
use crate::options::{BindAsked, RigAsked, taken};

#[wasm_bindgen]
impl Loaded {
    /// The model's triangles. `[n_triangles, 3]`
    #[wasm_bindgen(getter)]
    #[must_use]
    pub fn triangles(&self) -> Vec<u32> {
        self.model.triangles.as_flattened().to_vec()
    }

    /// What a cage should enclose: the vertices, where morph targets take them, and frames of a clip if one is named; triangles as in
    /// `Engine.modelStates`. `[n, 3]` each
    ///
    /// # Errors
    /// When there is no such clip.
    #[wasm_bindgen(unchecked_return_type = "[Float32Array, Uint32Array]")]
    #[allow(clippy::needless_pass_by_value, reason = "how an optional string crosses the border")]
    pub fn states(&self, clip: Option<String>) -> Result<JsValue, JsValue> {
        let states = self.model.states(clip.as_deref());
        let (positions, triangles) = states.map_err(|e| Fault::new(ErrorName::Error, e))?;
        let positions = Float32Array::from(flat(&positions).as_slice());
        let triangles = Uint32Array::from(triangles.as_flattened());
        Ok(Array::of2(&positions, &triangles).into())
    }
}

#[wasm_bindgen]
impl Binder {
    /// The file of a model that follows a posed cage, `[n_controls, 3]`: what `cagework bind` and `cagework deform` make of it. A
    /// glTF keeps its rig as `rig` says (`RigOptions`, where `dynamic` counts for nothing). The other arguments are those of `bind`.
    ///
    /// # Errors
    /// Those of a bind; when the pose has another number of points; when the file cannot be written.
    #[allow(clippy::too_many_arguments, reason = "arrays cross the border one by one")]
    pub async fn reshape(
        &self,
        loaded: &Loaded,
        cage: Vec<f32>,
        corners: Vec<u32>,
        #[wasm_bindgen(unchecked_param_type = "CageControls | undefined")] controls: JsValue,
        posed: Vec<f32>,
        #[wasm_bindgen(unchecked_param_type = "BindOptions")] options: JsValue,
        #[wasm_bindgen(unchecked_param_type = "RigOptions")] rig: JsValue,
        #[wasm_bindgen(unchecked_param_type = "(event: Progress) => boolean")] progress: Function,
    ) -> Result<Vec<u8>, JsValue> {
        let (model, rig): (&Model, RigAsked) = (&loaded.model, taken(rig)?);
        let set = control_set(&cage, &corners, controls)?;
        let rest = Controls::from(&set).rest().to_vec();
        let posed = pose("posed", &posed, rest.len())?;
        let keeps_rig = model.is_rigged() && !rig.plain;
        let of_rig = of_model(model, &rig)?;
        let extra = if keeps_rig { model.extra_points().map_err(Fault::from)? } else { Vec::new() };
        let at = [model.positions.as_slice(), &extra].concat();
        let mut asked: BindAsked = taken(options)?;
        asked.options.extra_points = extra.len();
        // What writing takes counts from the start, so that it does not end what took long.
        asked.options.held = model.bytes() + model.bytes_to_write(model.format());
        let bound = self.run(&at, &set, asked, progress).await?;
        if keeps_rig && model.format() == ModelFormat::Gltf {
            let by = displacements(&bound.weights, &bound.frames, &rest, &posed);
            let outside: Vec<u32> = bound.outside.iter().map(|o| o.vertex).collect();
            let written = model.write_reshaped(&by, &outside, &[], &of_rig).map_err(Fault::from)?;
            return Ok(written.0);
        }
        let deformed = model.deformed((&bound.weights, &bound.frames), (&rest, &posed), &of_rig.parts);
        Ok(model.write(model.format(), &deformed).map_err(Fault::from)?)
    }
}

/// Names of parts that keep their shape: those that hang on the skeleton, and others.
fn of_model(model: &Model, rig: &RigAsked) -> Answer<ReshapeOptions> {
    let asked = rig.options();
    let props = if rig.plain { Vec::new() } else { model.props()? };
    let (rigid, others): (Vec<_>, Vec<_>) = asked.rigid.into_iter().partition(|name| props.contains(name));
    let parts = if others.is_empty() {
        Parts::default()
    } else {
        model.parts(&[], &others).map_err(|e| Fault::new(ErrorName::Error, e))?
    };
    Ok(ReshapeOptions { rigid, parts, ..asked })
}

/// `[n, 3]` as points, if there are so many.
fn pose(name: &str, flat: &[f32], n: usize) -> Answer<Vec<Vec3>> {
    if flat.len() == 3 * n {
        return Ok(points(flat));
    }
    let message =
        format!("{name} has {} numbers; it must have {}, three for each of {n} controls", flat.len(), 3 * n);
    Err(Fault::new(ErrorName::Error, message))
}

/// Weights at hand, for pose after pose.
#[wasm_bindgen]
pub struct Deformer {
    n_controls: usize,
    weights: Weights,
    frames: Frames,
}

#[wasm_bindgen]
impl Deformer {
    /// Of the arrays of a `Bound`, of `n_controls` controls.
    ///
    /// # Errors
    /// When they do not belong together.
    #[wasm_bindgen(constructor)]
    pub fn new(
        n_controls: u32,
        indptr: Vec<u32>,
        indices: Vec<u32>,
        data: Vec<f32>,
        #[wasm_bindgen(unchecked_param_type = "Offsets")] offsets: JsValue,
    ) -> Result<Self, JsValue> {
        let Offsets { frames, .. } = taken(offsets)?;
        Ok(Self::of(n_controls, indptr, indices, data, frames)?)
    }

    /// Where the points are in a pose, `[n_controls, 3]`. `[n_points, 3]`
    ///
    /// # Errors
    /// When the pose has another number of points.
    pub fn deform(&self, posed: &[f32]) -> Result<Vec<f32>, JsValue> {
        let posed = pose("posed", posed, self.n_controls)?;
        Ok(flat(&deform_bound(&self.weights, &self.frames, &posed)))
    }
}

impl Deformer {
    fn of(
        n_controls: u32,
        indptr: Vec<u32>,
        indices: Vec<u32>,
        data: Vec<f32>,
        frames: Frames,
    ) -> Answer<Self> {
        if !frames.fits(n_controls as usize) {
            let message =
                format!("offsets has frames of more than {n_controls} controls, or joints without bones");
            return Err(Fault::new(ErrorName::Error, message));
        }
        let weights = Weights::new(n_controls + frames.n_columns() as u32, indptr, indices, data)?;
        Ok(Self { n_controls: n_controls as usize, weights, frames })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pose_of_another_length_is_refused_with_both_lengths() {
        assert_eq!(pose("posed", &[0.0; 6], 2).unwrap(), [Vec3::ZERO; 2]);
        let fault = pose("posed", &[0.0; 6], 3).unwrap_err();
        assert!(fault.message().starts_with("posed has 6 numbers; it must have 9"), "{}", fault.message());
    }

    #[test]
    fn frames_that_name_no_column_are_refused() {
        let of = |joints: Vec<u32>, column: u32| {
            let plain = vec![[0.0; 4]; 3 * joints.len()];
            let frames = Frames { joints, plain, whole: vec![[0.0; 3]; 3], ..Frames::default() };
            Deformer::of(3, vec![0, 1], vec![column], vec![1.0], frames).map(drop)
        };
        // Three controls, three axes, three columns of the whole cage and three of the one joint.
        assert!(of(vec![2], 11).is_ok());
        assert!(of(vec![2], 12).is_err(), "a column");
        assert!(of(vec![3], 2).is_err(), "a joint");
    }
}
