//! The cage: made, read, edited at rest, posed.

use cagework_core::bind::estimate_memory;
use cagework_core::subdivided_box;
use cagework_editor::Command;
use cagework_io::{decode_pose, encode_pose};
use wasm_bindgen::JsValue;
use wasm_bindgen::prelude::wasm_bindgen;

use super::Engine;
use crate::arrays::{corners, flat, points, polygon_mesh};
use crate::binder::Polygons;
use crate::controls;
use crate::error::{Answer, Fault};
use crate::options::{BindAsked, taken};
use crate::views::object;

/// Room between the model and a box around it, in diagonals of the model.
const BOX_MARGIN: f32 = 0.04;

#[wasm_bindgen]
impl Engine {
    /// A box around the model, its longest side cut into `divisions`, the others to match.
    ///
    /// # Errors
    /// When no model is open.
    #[wasm_bindgen(js_name = boxCage)]
    pub fn box_cage(&self, divisions: u32) -> Result<Polygons, JsValue> {
        let mesh = self.read(|state| {
            let bounds = cagework_core::Bounds::of(state.models().positions())
                .ok_or_else(|| Fault::missing("model", "open one first"))?;
            let longest = bounds.extent().max_element().max(f32::MIN_POSITIVE);
            let cut = |side: f32| (side / longest * divisions as f32).round().max(1.0) as u32;
            Answer::Ok(subdivided_box(bounds, BOX_MARGIN, bounds.extent().to_array().map(cut)))
        })?;
        Ok(mesh.into())
    }

    /// Takes a cage given as arrays; `corners`: for each face their number, then them. A mesh that is no cage yet becomes a draft, whose
    /// faults `Binder.checkCage` finds. Without `controls` the present ones stay as far as they fit. One step of the history, or none
    /// without a label.
    ///
    /// # Errors
    /// When the arrays are no mesh, or the controls do not fit; nothing changes then.
    #[wasm_bindgen(js_name = setCage, unchecked_return_type = "CageState")]
    pub fn set_cage(
        &self,
        positions: &[f32],
        corners: &[u32],
        #[wasm_bindgen(unchecked_param_type = "CageControls | undefined")] controls: JsValue,
        notices: Vec<String>,
        label: Option<String>,
    ) -> Result<JsValue, JsValue> {
        let (mesh, controls) = (polygon_mesh(positions, corners)?, controls::from_js(controls)?);
        let is_step = label.is_some();
        self.step(Command::ReplaceCage { mesh, controls, notices }, label)?;
        if !is_step {
            self.change(|state| state.editor.amend());
        }
        self.cage_state()
    }

    /// The cage; undefined without one.
    ///
    /// # Errors
    /// Never.
    #[wasm_bindgen(js_name = cageState, unchecked_return_type = "CageState | undefined")]
    pub fn cage_state(&self) -> Result<JsValue, JsValue> {
        Ok(self.read(|state| state.cage_state().map_or(Ok(JsValue::UNDEFINED), |shown| object(&shown)))?)
    }

    /// Changes the document as a command says: one step of the history, or with the next step without a label.
    ///
    /// # Errors
    /// When the command cannot be applied; nothing changes then.
    pub fn apply(
        &self,
        #[wasm_bindgen(unchecked_param_type = "Command")] command: JsValue,
        label: Option<String>,
    ) -> Result<(), JsValue> {
        Ok(self.step(taken(command)?, label)?)
    }

    /// Makes one step of the history of everything since the last step; false if nothing has changed.
    #[must_use]
    pub fn commit(&self, label: &str) -> bool {
        self.change(|state| state.editor.commit(label))
    }

    /// Keeps everything since the last step without making a step of it.
    pub fn amend(&self) {
        self.change(|state| state.editor.amend());
    }

    /// Takes back everything since the last step.
    pub fn revert(&self) {
        self.change(|state| {
            state.editor.revert();
            state.show_painting();
            state.is_changed = true;
        });
    }

    /// Takes back the last step; false if there is none, or while models are added.
    #[must_use]
    pub fn undo(&self) -> bool {
        self.change(|state| !state.is_adding && state.editor.undo())
    }

    /// Repeats the step that was taken back last; false if there is none, or while models are added.
    #[must_use]
    pub fn redo(&self) -> bool {
        self.change(|state| !state.is_adding && state.editor.redo())
    }

    /// Drops all steps.
    #[wasm_bindgen(js_name = clearHistory)]
    pub fn clear_history(&self) {
        self.change(|state| state.editor.clear_history());
    }

    /// For each face of the cage the number of its corners, then them.
    #[wasm_bindgen(js_name = cageCorners)]
    #[must_use]
    pub fn cage_corners(&self) -> Vec<u32> {
        self.read(|state| corners(&state.rest().faces))
    }

    /// Cage vertices and controls inside at rest. `[n_controls, 3]`
    #[wasm_bindgen(js_name = restPositions)]
    #[must_use]
    pub fn rest_positions(&self) -> Vec<f32> {
        self.read(|state| flat(&state.rest().positions))
    }

    /// Cage vertices and controls inside of the moment. `[n_controls, 3]`
    #[wasm_bindgen(js_name = cagePositions)]
    #[must_use]
    pub fn cage_positions(&self) -> Vec<f32> {
        self.read(|state| flat(state.pose()))
    }

    /// Moves the cage; the model follows. Positions of another cage change nothing.
    #[wasm_bindgen(js_name = setCagePositions)]
    pub fn set_cage_positions(&self, positions: &[f32]) {
        // A job of another cage may end late.
        let _ = self.change(|state| state.editor.set_pose(points(positions)));
    }

    /// The pose, then each saved pose that belongs to the cage: what is carried over to another cage. `[n_poses, n_controls, 3]`
    #[must_use]
    pub fn carriable(&self) -> Vec<f32> {
        self.read(|state| {
            let document = state.editor.document();
            let saved = document.fitting_poses().flat_map(|pose| flat(&pose.positions));
            flat(state.pose()).into_iter().chain(saved).collect()
        })
    }

    /// Starts or ends reshaping the cage. A pose that this takes back is one step of the history.
    #[wasm_bindgen(js_name = setEditingRest)]
    pub fn set_editing_rest(&self, editing: bool, label: &str) {
        self.change(|state| {
            state.editor.set_editing_rest(editing);
            state.is_changed = true;
            if editing {
                state.editor.commit(label);
            }
        });
    }

    /// Bytes that a bind would need.
    ///
    /// # Errors
    /// When there is no cage or an option is out of range.
    #[wasm_bindgen(js_name = estimateMemory)]
    pub fn estimate_memory(
        &self,
        #[wasm_bindgen(unchecked_param_type = "BindOptions")] options: JsValue,
    ) -> Result<f64, JsValue> {
        let asked: BindAsked = taken(options)?;
        if self.read(|state| state.n_rig.is_none()) {
            let n = self.read(|state| Answer::Ok(state.models().extra_points()?.len()))?;
            self.state.borrow_mut().n_rig = Some(n);
        }
        let bytes = self.read(|state| {
            let set = state.the_set()?;
            let n = state.models().positions().len() + state.n_rig.unwrap_or(0);
            Answer::Ok(estimate_memory(set, n, &asked.into())?)
        })?;
        Ok(bytes as f64)
    }

    /// The pose of the moment in few bytes, in the axes of the model's file.
    #[wasm_bindgen(js_name = encodePose)]
    #[must_use]
    pub fn encode_pose(&self) -> Vec<u8> {
        self.read(|state| {
            let in_file = |positions| state.up().turned_back(positions);
            encode_pose(&in_file(&state.rest().positions), &in_file(state.pose()))
        })
    }

    /// Takes a pose from `encodePose`.
    ///
    /// # Errors
    /// When it is damaged or belongs to another cage.
    #[wasm_bindgen(js_name = decodePose)]
    pub fn decode_pose(&self, bytes: &[u8]) -> Result<(), JsValue> {
        let pose = self.read(|state| decode_pose(&state.up().turned_back(&state.rest().positions), bytes));
        let pose = pose.map_err(Fault::from)?;
        let pose = self.read(|state| state.up().turned(&pose).into_owned());
        Ok(self.change(|state| state.editor.set_pose(pose)).map_err(Fault::from)?)
    }
}

impl Engine {
    /// Applies a command; one step of the history with a label.
    pub(super) fn step(&self, command: Command, label: Option<String>) -> Answer<()> {
        self.change(|state| {
            state.editor.apply(command)?;
            state.is_changed = true;
            if let Some(label) = label {
                state.editor.commit(label);
            }
            Ok(())
        })
    }
}
