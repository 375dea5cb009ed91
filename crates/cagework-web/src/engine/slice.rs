//! Methods that show a slice through the grid.

use std::sync::Arc;

use cagework_core::slice::Slice;
use cagework_core::{Controls, Weights};
use wasm_bindgen::JsValue;
use wasm_bindgen::prelude::wasm_bindgen;

use super::Engine;
use crate::error::Answer;
use crate::options::{JsBindOptions, decode};

#[wasm_bindgen]
impl Engine {
    /// Shows one layer of grid cells, normal to `axis` (0 to 2) at `fraction` (0 to 1) of the grid's length along it.
    /// `options` determine the grid. The arrays are the weights that `Binder.bindSlice` returned; they are empty if no
    /// cell of the layer is inside the cage.
    ///
    /// # Errors
    /// Without a cage, or if the number of weights does not match the slice.
    #[wasm_bindgen(js_name = takeSlice)]
    pub fn take_slice(
        &self,
        axis: usize,
        fraction: f32,
        #[wasm_bindgen(unchecked_param_type = "BindOptions")] options: JsValue,
        indptr: Vec<u32>,
        indices: Vec<u32>,
        data: Vec<f32>,
    ) -> Result<(), JsValue> {
        let request: JsBindOptions = decode(options)?;
        let slice = self.read(|state| {
            let set = state.require_set()?;
            let mut slice = Slice::new(set, &request.options, axis.min(2), fraction);
            if !data.is_empty() {
                slice.set_weights(Weights::new(
                    Controls::from(set).n_controls() as u32,
                    indptr,
                    indices,
                    data,
                )?)?;
            }
            Answer::Ok(slice)
        })?;
        self.change(|state| {
            state.slice = Some(Arc::new(slice));
            state.is_changed = true;
        });
        Ok(())
    }
}
