//! Methods that show faults of the cage, and count vertices outside it while the user reshapes it.

use cagework_editor::CageWatch;
use wasm_bindgen::JsValue;
use wasm_bindgen::prelude::wasm_bindgen;

use super::Engine;
use crate::error::Answer;
use crate::options::decode;

#[wasm_bindgen]
impl Engine {
    /// Marks the faults of the cage that `Binder.checkCage` found.
    ///
    /// # Errors
    /// If `problems` are not an array of problems.
    #[wasm_bindgen(js_name = showFaults)]
    pub fn show_faults(
        &self,
        #[wasm_bindgen(unchecked_param_type = "readonly Problem[]")] problems: JsValue,
    ) -> Answer<()> {
        let faults = decode(problems)?;
        self.change(|state| {
            state.faults = faults;
            state.is_changed = true;
        });
        Ok(())
    }

    /// Counts the vertices outside the dragged cage, in a sample of the models' vertices that is small enough to be
    /// tested at every pointer event. The check of all vertices runs after the drag.
    pub fn strays(&self) -> usize {
        // Borrow the state directly: `change` would request a frame, but nothing visible changes.
        let state = &mut *self.state.borrow_mut();
        let document = state.editor.document();
        if state.watch.is_none() {
            state.watch = CageWatch::new(document);
        }
        state.watch.as_ref().map_or(0, |watch| watch.n_outside(document))
    }
}
