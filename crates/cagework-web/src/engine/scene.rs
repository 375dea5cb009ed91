//! Methods that set the scene's options and read its legend.

use cagework_gpu::render::MeshStyle;
use cagework_gpu::render::colormap::{ERROR_RANGE, MIN_WEIGHT_RANGE};
use wasm_bindgen::JsValue;
use wasm_bindgen::prelude::wasm_bindgen;

use super::Engine;
use crate::options::{JsSceneOptions, SliceContent, decode};
use crate::views::{ColorMap, LargestWeight, Legend, optional};

#[wasm_bindgen]
impl Engine {
    /// Sets what the scene shows.
    ///
    /// # Errors
    /// If the options are invalid.
    #[wasm_bindgen(js_name = setScene)]
    pub fn set_scene(
        &self,
        #[wasm_bindgen(unchecked_param_type = "SceneOptions")] scene: JsValue,
    ) -> Result<(), JsValue> {
        let request: JsSceneOptions = decode(scene)?;
        self.change(|state| {
            state.is_moved |= request.original != state.view.original;
            state.view = request;
            state.is_changed = true;
            state.place_viewport();
        });
        Ok(())
    }

    /// Legend of the colours of the slice or the model; undefined if the colours show no quantity.
    #[wasm_bindgen(unchecked_return_type = "Legend | undefined")]
    pub fn legend(&self) -> JsValue {
        let (slice, style) =
            self.read(|state| (state.slice.as_ref().map(|_| state.view.slice), state.mesh_style()));
        let plain = |low, high, map| Legend { low, high, logarithmic: false, map, largest: None };
        let legend = match (slice, style) {
            (Some(SliceContent::Kinds), _) => Some(plain(0.0, 2.0, ColorMap::Kinds)),
            (Some(SliceContent::Value), _) => Some(plain(0.0, 1.0, ColorMap::Viridis)),
            (_, MeshStyle::Weights { column }) => {
                let largest = self.largest_weight(column);
                let high = match largest {
                    Some(largest) if !self.read(|state| state.view.options.weights_to_one) => {
                        largest.value.max(MIN_WEIGHT_RANGE)
                    }
                    _ => 1.0,
                };
                Some(Legend { largest, ..plain(0.0, high, ColorMap::Viridis) })
            }
            (_, MeshStyle::Errors) => {
                let [low, high] = ERROR_RANGE.map(|e| 10.0_f32.powf(e));
                Some(Legend { logarithmic: true, ..plain(low, high, ColorMap::Error) })
            }
            _ => None,
        };
        optional(legend)
    }
}

impl Engine {
    /// Finds the largest weight in a column. `None` before a bind.
    fn largest_weight(&self, column: u32) -> Option<LargestWeight> {
        self.read(|state| {
            let weights = state.bound.as_ref()?.weights.column(column);
            let numbered = weights.zip(0..).map(|(value, vertex)| LargestWeight { value, vertex });
            numbered.max_by(|a, b| a.value.total_cmp(&b.value))
        })
    }
}
