//! Methods for the proportions of a humanoid. Commands change the factors.

use cagework_editor::FoldSample;
use js_sys::{Float32Array, Uint32Array};
use wasm_bindgen::JsValue;
use wasm_bindgen::prelude::wasm_bindgen;

use super::Engine;
use crate::arrays::flat;
use crate::cage::RigArrays;
use crate::error::{Answer, ErrorName, Fault};
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

    /// The humanoid and a part of its bind, for `Binder.proportionRanges`.
    ///
    /// # Errors
    /// Before a bind, or if the models are not a humanoid.
    #[wasm_bindgen(js_name = foldSample, unchecked_return_type = "FoldArrays")]
    pub fn fold_sample(&self) -> Answer<JsValue> {
        let info = {
            let editor = &mut self.state.borrow_mut().editor;
            // Prepare the cage now, so that the first move of a slider does not wait for it.
            editor.humanoid_cage()?;
            editor.humanoid_info()
        };
        let bones = info.into_iter().flat_map(|info| info.bones);
        self.read(|state| {
            let FoldSample { weights, frames, positions, triangles } =
                state.bound_document().fold_sample()?;
            let (points, _) =
                state.models().states(None).map_err(|error| Fault::new(ErrorName::Error, error))?;
            let offsets = Offsets { frames: (*frames).clone(), outside: Vec::new() };
            Ok(object(&FoldArrays {
                rest: Float32Array::from(flat(&state.rest().positions).as_slice()),
                rings: state.cage().controls.rings.clone(),
                rig: RigArrays::of(&state.models().rest_rig().unwrap_or_default()),
                bones: bones.filter_map(|bone| Some((bone.bone, bone.joint?))).collect(),
                points: Float32Array::from(flat(&points).as_slice()),
                weights: BoundArrays::of(&weights, offsets),
                positions: Float32Array::from(flat(&positions).as_slice()),
                triangles: Uint32Array::from(triangles.as_flattened()),
            }))
        })
    }
}
