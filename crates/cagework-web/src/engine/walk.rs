//! Methods that let the cage follow the clip of a humanoid rig.

use wasm_bindgen::JsValue;
use wasm_bindgen::prelude::wasm_bindgen;

use super::Engine;
use crate::error::Answer;
use crate::loaded::LoadedModel;
use crate::views::object;

#[wasm_bindgen]
impl Engine {
    /// Fits a humanoid rig with clips to the open models; `walkAt` then moves the cage.
    ///
    /// # Errors
    /// Without a cage, or if the rig is not a humanoid with clips.
    #[wasm_bindgen(js_name = openWalk, unchecked_return_type = "WalkInfo")]
    pub fn open_walk(&self, rig: &LoadedModel) -> Answer<JsValue> {
        let info = self.change(|state| {
            state.is_changed = true;
            state.editor.set_walk(&rig.model)
        })?;
        Ok(object(&info))
    }

    /// Moves the cage to its pose at a time, in seconds, of a clip of the fitted rig. False if no rig is fitted to these
    /// models and this cage.
    #[wasm_bindgen(js_name = walkAt)]
    pub fn walk_at(&self, clip: u32, seconds: f32) -> bool {
        self.change(|state| state.editor.walk_at(clip as usize, seconds))
    }
}
