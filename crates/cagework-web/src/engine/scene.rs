//! What is shown, and what its colours mean.

use cagework_gpu::render::MeshStyle;
use cagework_gpu::render::colormap::ERROR_RANGE;
use wasm_bindgen::JsValue;
use wasm_bindgen::prelude::wasm_bindgen;

use super::Engine;
use crate::error::Fault;
use crate::options::{SceneAsked, SliceShown};
use crate::views::{Legend, object};

#[wasm_bindgen]
impl Engine {
    /// What to show: `SceneOptions` of contract.ts.
    ///
    /// # Errors
    /// When it is something else.
    #[wasm_bindgen(js_name = setScene)]
    pub fn set_scene(&self, scene: JsValue) -> Result<(), JsValue> {
        let asked: SceneAsked = serde_wasm_bindgen::from_value(scene).map_err(Fault::from)?;
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
    pub fn legend(&self) -> Result<JsValue, JsValue> {
        let legend = self.read(|state| {
            let coordinate = || Legend { low: 0.0, high: 1.0, logarithmic: false, map: "viridis" };
            match (state.slice.as_ref().map(|_| state.view.slice), state.mesh_style()) {
                (_, MeshStyle::Weights { .. }) | (Some(SliceShown::Value), _) => Some(coordinate()),
                (_, MeshStyle::Errors) => {
                    let [low, high] = ERROR_RANGE.map(|e| 10.0_f32.powf(e));
                    Some(Legend { low, high, logarithmic: true, map: "error" })
                }
                (Some(SliceShown::Kinds), _) => {
                    Some(Legend { low: 0.0, high: 2.0, logarithmic: false, map: "kinds" })
                }
                _ => None,
            }
        });
        Ok(legend.map_or(Ok(JsValue::UNDEFINED), |legend| object(&legend))?)
    }
}
