//! Methods that show a slice through the grid.

use std::sync::Arc;

use cagework_core::Controls;
use cagework_core::slice::Slice;
use cagework_editor::PageBindOptions;
use wasm_bindgen::JsValue;
use wasm_bindgen::prelude::wasm_bindgen;

use super::Engine;
use crate::error::Answer;
use crate::options::decode;
use crate::weights::BoundArrays;

#[wasm_bindgen]
impl Engine {
    /// Shows one layer of grid cells, normal to `axis` (0 to 2) at `fraction` (0 to 1) of the grid's length along it.
    /// `options` determine the grid. `rows`: the weights that `Binder.bindSlice` returned; undefined if no cell of the
    /// layer is inside the cage.
    ///
    /// # Errors
    /// Without a cage, or if the number of weights does not match the slice.
    #[wasm_bindgen(js_name = takeSlice)]
    pub fn take_slice(
        &self,
        axis: usize,
        fraction: f32,
        #[wasm_bindgen(unchecked_param_type = "BindOptions")] options: JsValue,
        #[wasm_bindgen(unchecked_param_type = "BoundArrays | undefined")] rows: JsValue,
    ) -> Answer<()> {
        let request: PageBindOptions = decode(options)?;
        let rows: Option<BoundArrays> = decode(rows)?;
        let slice = self.read(|state| {
            let set = state.require_set()?;
            let mut slice = Slice::new(set, &request.options, axis.min(2), fraction);
            if let Some(rows) = rows {
                slice.set_weights(rows.bound(Controls::from(set).n_controls())?.0)?;
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
