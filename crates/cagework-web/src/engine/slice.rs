//! A slice through the grid.

use std::sync::Arc;

use cagework_core::slice::Slice;
use cagework_core::{BindOptions, Controls, Weights};
use wasm_bindgen::JsValue;
use wasm_bindgen::prelude::wasm_bindgen;

use super::Engine;
use crate::error::Answer;
use crate::options::{BindAsked, taken};

#[wasm_bindgen]
impl Engine {
    /// Takes a slice: its axis, where along it (0 to 1), the options of its bind, and the worker's rows of weights, which
    /// may be missing where no cell is inside.
    ///
    /// # Errors
    /// When there is no cage or the rows belong to another slice.
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
        let asked: BindAsked = taken(options)?;
        let slice = self.read(|state| {
            let set = state.the_set()?;
            let mut slice = Slice::new(set, &BindOptions::from(asked), axis.min(2), fraction);
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
