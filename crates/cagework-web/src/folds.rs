//! Ranges of proportions within which a model does not fold, measured in a worker.

use cagework_pose::proportions::{HumanoidCage, Proportions};
use js_sys::{Float32Array, Uint32Array};
use serde::{Deserialize, Serialize};
use wasm_bindgen::JsValue;
use wasm_bindgen::prelude::wasm_bindgen;

use crate::arrays::points;
use crate::binder::Binder;
use crate::error::{Answer, ErrorName, Fault};
use crate::options::decode;
use crate::views::object;
use crate::weights::BoundArrays;

/// A part of a bound humanoid.
#[derive(Serialize, Deserialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub(crate) struct FoldArrays {
    /// The cage with the bones.
    #[cfg_attr(test, ts(type = "unknown"))]
    pub(crate) cage: HumanoidCage,
    /// Weights of the vertices.
    pub(crate) weights: BoundArrays,
    /// Vertices at rest. `[n_vertices, 3]`
    #[serde(with = "serde_wasm_bindgen::preserve")]
    #[cfg_attr(test, ts(type = "Float32Array"))]
    pub(crate) positions: Float32Array,
    /// `[n_triangles, 3]`
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
    /// If the arrays do not match each other.
    #[wasm_bindgen(js_name = proportionRanges, unchecked_return_type = "ProportionRange[]")]
    pub fn proportion_ranges(
        #[wasm_bindgen(unchecked_param_type = "FoldArrays")] sample: JsValue,
    ) -> Answer<JsValue> {
        let FoldArrays { cage, weights, positions, triangles } = decode(sample)?;
        let n_controls = cage.pose(&Proportions::default()).len();
        let (weights, frames) = weights.bound(n_controls)?;
        let positions = points(&positions.to_vec());
        let triangles = triangles.to_vec();
        if weights.n_rows() != positions.len() || triangles.iter().any(|&v| v as usize >= positions.len()) {
            return Err(Fault::new(ErrorName::Error, "the sample has other vertices than its weights"));
        }
        Ok(object(&cage.ranges((&weights, &frames), &positions, triangles.as_chunks().0)))
    }
}
