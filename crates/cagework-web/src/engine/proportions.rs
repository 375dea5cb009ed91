//! Methods for the proportions of a humanoid. Commands change the factors.

use cagework_editor::FoldSample;
use js_sys::{Float32Array, Uint32Array};
use wasm_bindgen::JsValue;
use wasm_bindgen::prelude::wasm_bindgen;

use super::Engine;
use crate::arrays::flat;
use crate::error::Answer;
use crate::folds::FoldArrays;
use crate::views::{object, optional};
use crate::weights::{BoundArrays, Offsets};

#[wasm_bindgen]
impl Engine {
    /// Humanoid bones of the models; undefined if the models have no skeleton.
    #[wasm_bindgen(js_name = humanoidInfo, unchecked_return_type = "HumanoidInfo | undefined")]
    pub fn humanoid_info(&self) -> JsValue {
        optional(self.state.borrow_mut().editor.humanoid_info())
    }

    /// A part of the bound models, for `Binder.proportionRanges`.
    ///
    /// # Errors
    /// If the models are not a humanoid, and before a bind.
    #[wasm_bindgen(js_name = foldSample, unchecked_return_type = "FoldArrays")]
    pub fn fold_sample(&self) -> Answer<JsValue> {
        let cage = self.state.borrow_mut().editor.humanoid_cage()?;
        let sample = self.read(|state| state.bound_document().fold_sample(cage))?;
        let FoldSample { cage, weights, frames, positions, triangles } = sample;
        let offsets = Offsets { frames: (*frames).clone(), outside: Vec::new() };
        Ok(object(&FoldArrays {
            cage: (*cage).clone(),
            weights: BoundArrays::of(&weights, offsets),
            positions: Float32Array::from(flat(&positions).as_slice()),
            triangles: Uint32Array::from(triangles.as_flattened()),
        }))
    }
}
