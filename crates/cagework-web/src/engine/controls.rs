//! Methods that read, add and show inner controls.

use cagework_core::{ControlError, InnerControls};
use cagework_editor::Command;
use cagework_editor::edit::pick_middle;
use cagework_io::read_inner_controls;
use glam::Vec3;
use wasm_bindgen::prelude::wasm_bindgen;

use super::Engine;
use crate::arrays::points;
use crate::error::Answer;
use crate::options::READ_LIMIT;

#[wasm_bindgen]
impl Engine {
    /// Replaces the inner controls by the controls in an OBJ file, and adds a step to the history.
    ///
    /// # Errors
    /// If the file cannot be read, or a control does not fit into the cage. The document is then unchanged.
    #[wasm_bindgen(js_name = readControls)]
    pub fn read_controls(&self, bytes: &[u8], label: String) -> Answer<()> {
        let origin = self.read(|state| state.models().origin());
        let InnerControls { positions, elements, .. } = read_inner_controls(bytes, origin, READ_LIMIT)?;
        if elements.is_empty() {
            return Err(ControlError::Empty.into());
        }
        let positions = self.read(|state| state.up().turned(&positions).into_owned());
        self.step(Command::ReplaceControls { positions, elements }, Some(label))
    }

    /// Chooses the position of a new control: a point inside the rest model under the pointer, midway between the first
    /// two surfaces. If the pointer is not on the model, the point of the pointer's ray that is nearest to the centre
    /// of model and cage. `[3]`
    #[wasm_bindgen(js_name = middleAt)]
    pub fn middle_at(&self, x: f32, y: f32) -> Vec<f32> {
        let middle = self.read(|state| {
            let center = state.editor.bounds().map_or(Vec3::ZERO, |b| b.center());
            pick_middle(
                state.models().positions(),
                state.models().triangles(),
                &state.camera,
                state.pointer(x, y),
                center,
            )
        });
        middle.to_array().to_vec()
    }

    /// Adds a sheet around `center`, parallel to the view plane and shrunk until it fits into the cage, and adds a step
    /// to the history.
    ///
    /// # Errors
    /// If even the smallest sheet does not fit.
    #[wasm_bindgen(js_name = addSheet)]
    pub fn add_sheet(&self, center: &[f32], label: String) -> Answer<()> {
        let axes = self.read(|state| {
            let (right, up) = (state.camera.right(), state.camera.up());
            let half = 0.5 * state.editor.bounds().map_or(Vec3::ZERO, |b| b.extent());
            [right * right.abs().dot(half), up * up.abs().dot(half)]
        });
        let center = points(center).first().copied().unwrap_or_default();
        self.step(Command::AddSheet { center, axes }, Some(label))
    }

    /// Shows the points of an inner control that is being placed. `[n, 3]`
    #[wasm_bindgen(js_name = showPlaced)]
    pub fn show_placed(&self, places: &[f32]) {
        self.change(|state| {
            state.held.placed = points(places);
            state.is_changed = true;
        });
    }
}
