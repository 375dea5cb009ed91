//! Methods that set the scene's options and read its legend.

use cagework_gpu::render::MeshStyle;
use cagework_gpu::render::colormap::Legend;
use wasm_bindgen::JsValue;
use wasm_bindgen::prelude::wasm_bindgen;

use super::Engine;
use crate::error::Answer;
use crate::options::{JsSceneOptions, SliceContent, decode};
use crate::views::optional;

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
    ) -> Answer<()> {
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
        self.read(|state| {
            let weights = |column| Some(state.bound.as_ref()?.weights.column(column));
            optional(match (state.slice.as_ref().map(|_| state.view.slice), state.mesh_style()) {
                (Some(SliceContent::Kinds), _) => Some(Legend::kinds()),
                (Some(SliceContent::Value), _) => Some(Legend::fractions()),
                (_, MeshStyle::Weights { column }) => {
                    weights(column).map(|weights| Legend::weights(weights, state.view.options.weights_to_one))
                }
                (_, MeshStyle::Errors) => Some(Legend::errors()),
                _ => None,
            })
        })
    }
}
