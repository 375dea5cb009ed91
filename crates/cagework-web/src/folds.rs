//! Ranges of proportions within which a model does not fold, measured in a worker.

use cagework_pose::humanoid::{Bone, Humanoid};
use cagework_pose::proportions::HumanoidCage;
use js_sys::{Float32Array, Uint32Array};
use serde::{Deserialize, Serialize};
use wasm_bindgen::JsValue;
use wasm_bindgen::prelude::wasm_bindgen;

use crate::arrays::points;
use crate::binder::Binder;
use crate::cage::RigArrays;
use crate::error::{Answer, ErrorName, Fault};
use crate::options::decode;
use crate::views::object;
use crate::weights::BoundArrays;

/// A humanoid in its cage, and a part of its bind.
#[derive(Serialize, Deserialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub(crate) struct FoldArrays {
    /// Cage vertices and inner controls at rest. `[n_controls, 3]`
    #[serde(with = "serde_wasm_bindgen::preserve")]
    #[cfg_attr(test, ts(type = "Float32Array"))]
    pub(crate) rest: Float32Array,
    /// Loops of cage vertices around limbs.
    pub(crate) rings: Vec<Vec<u32>>,
    pub(crate) rig: RigArrays,
    /// Bones and the names of their joints.
    pub(crate) bones: Vec<(String, String)>,
    /// Points at rest that the influences of the rig belong to. `[n_points, 3]`
    #[serde(with = "serde_wasm_bindgen::preserve")]
    #[cfg_attr(test, ts(type = "Float32Array"))]
    pub(crate) points: Float32Array,
    /// Weights of some vertices.
    pub(crate) weights: BoundArrays,
    /// These vertices at rest. `[n_vertices, 3]`
    #[serde(with = "serde_wasm_bindgen::preserve")]
    #[cfg_attr(test, ts(type = "Float32Array"))]
    pub(crate) positions: Float32Array,
    /// Triangles of these vertices. `[n_triangles, 3]`
    #[serde(with = "serde_wasm_bindgen::preserve")]
    #[cfg_attr(test, ts(type = "Uint32Array"))]
    pub(crate) triangles: Uint32Array,
}

#[wasm_bindgen]
impl Binder {
    /// Ranges of the factors of each proportion within which the model does not fold. `sample`: from
    /// `Engine.foldSample`.
    ///
    /// # Errors
    /// If the models are not a humanoid, or the arrays do not match each other.
    #[wasm_bindgen(js_name = proportionRanges, unchecked_return_type = "ProportionRange[]")]
    pub fn proportion_ranges(
        #[wasm_bindgen(unchecked_param_type = "FoldArrays")] sample: JsValue,
    ) -> Answer<JsValue> {
        let sample: FoldArrays = decode(sample)?;
        let fault = |message: &dyn std::fmt::Display| Fault::new(ErrorName::Error, message);
        let (rig, rest) = (sample.rig.rig(), points(&sample.rest.to_vec()));
        let given = sample.bones.into_iter().filter_map(|(bone, joint)| Some((bone.parse().ok()?, joint)));
        let given: Vec<(Bone, String)> = given.collect();
        let humanoid = Humanoid::of_rig(&rig, &given).map_err(|error| fault(&error))?;
        let (weights, frames) = sample.weights.bound(rest.len())?;
        let positions = points(&sample.positions.to_vec());
        let triangles = sample.triangles.to_vec();
        if weights.n_rows() != positions.len() || triangles.iter().any(|&v| v as usize >= positions.len()) {
            return Err(fault(&"the sample has other vertices than its weights"));
        }
        let cage = HumanoidCage::new(&rest, &sample.rings, &points(&sample.points.to_vec()), &rig, &humanoid);
        Ok(object(&cage.ranges(&weights, &frames, &positions, triangles.as_chunks().0)))
    }
}
