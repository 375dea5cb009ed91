//! What is shown, and what its colours mean.

use cagework_gpu::render::MeshStyle;
use cagework_gpu::render::colormap::{ERROR_RANGE, MIN_WEIGHT_RANGE};
use wasm_bindgen::JsValue;
use wasm_bindgen::prelude::wasm_bindgen;

use super::Engine;
use crate::error::Fault;
use crate::options::{SceneAsked, SliceShown, taken};
use crate::views::{ColorMap, Legend, object};

#[wasm_bindgen]
impl Engine {
    /// What to show: `SceneOptions` of contract.ts.
    ///
    /// # Errors
    /// When it is something else.
    #[wasm_bindgen(js_name = setScene)]
    pub fn set_scene(
        &self,
        #[wasm_bindgen(unchecked_param_type = "SceneOptions")] scene: JsValue,
    ) -> Result<(), JsValue> {
        let asked: SceneAsked = taken(scene)?;
        self.change(|state| {
            state.is_moved |= asked.original != state.view.original;
            state.view = asked;
            state.is_changed = true;
            state.place_viewport();
        });
        Ok(())
    }

    /// What colours of the model or the slice mean; undefined while they mean nothing.
    ///
    /// # Errors
    /// Never.
    #[wasm_bindgen(unchecked_return_type = "Legend | undefined")]
    pub fn legend(&self) -> Result<JsValue, JsValue> {
        let (slice, style) =
            self.read(|state| (state.slice.as_ref().map(|_| state.view.slice), state.mesh_style()));
        let coordinate = |high| Legend { low: 0.0, high, logarithmic: false, map: ColorMap::Viridis };
        let legend = match (slice, style) {
            (Some(SliceShown::Kinds), _) => {
                Some(Legend { low: 0.0, high: 2.0, logarithmic: false, map: ColorMap::Kinds })
            }
            (Some(SliceShown::Value), _) => Some(coordinate(1.0)),
            (_, MeshStyle::Weights { column }) => Some(coordinate(self.largest_weight(column))),
            (_, MeshStyle::Errors) => {
                let [low, high] = ERROR_RANGE.map(|e| 10.0_f32.powf(e));
                Some(Legend { low, high, logarithmic: true, map: ColorMap::Error })
            }
            _ => None,
        };
        Ok(legend.map_or(Ok(JsValue::UNDEFINED), |legend| object(&legend))?)
    }
}

impl Engine {
    /// The value that the last colour of a heat map of weights stands for.
    fn largest_weight(&self, column: u32) -> f32 {
        let largest = self.with_session(|session| {
            let weights =
                session.weights().ok_or_else(|| Fault::missing("weights", "bind the model first"))?;
            Ok(weights.column(column).fold(MIN_WEIGHT_RANGE, f32::max))
        });
        // The GPU is busy with other weights: the page asks again when they are in.
        largest.unwrap_or(1.0)
    }
}
