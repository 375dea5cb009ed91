//! Methods that create, read, reshape and pose the cage.

use cagework_cage::generate::BOX_MARGIN;
use cagework_core::bind::{estimate_memory, estimate_updates};
use cagework_core::{Bounds, subdivided_box};
use cagework_editor::edit::Topology;
use cagework_editor::{CageState, Command, PageBindOptions};
use cagework_io::{decode_pose, encode_pose};
use wasm_bindgen::JsValue;
use wasm_bindgen::prelude::wasm_bindgen;

use super::Engine;
use crate::arrays::{flat, points};
use crate::cage::CageArrays;
use crate::error::{Answer, Fault};
use crate::options::decode;
use crate::views::{object, optional};

#[wasm_bindgen]
impl Engine {
    /// Builds a box around the model. Its longest side has `divisions` segments; the other sides have segments of about
    /// this length.
    ///
    /// # Errors
    /// If no model is open.
    #[wasm_bindgen(js_name = boxCage, unchecked_return_type = "CageArrays")]
    pub fn box_cage(&self, divisions: u32) -> Answer<JsValue> {
        let bounds = self.read(|state| Bounds::around(state.models().positions()));
        let bounds = bounds.ok_or_else(|| Fault::missing("model", "open one first"))?;
        let longest = bounds.extent().max_element().max(f32::MIN_POSITIVE);
        let cut = |side: f32| (side / longest * divisions as f32).round().max(1.0) as u32;
        let mesh = subdivided_box(bounds, BOX_MARGIN, bounds.extent().to_array().map(cut));
        Ok(object(&CageArrays::of(&mesh)))
    }

    /// Replaces the cage. A mesh that is not a valid cage is stored as a draft; `Binder.checkCage` finds its faults. With a
    /// label, adds a step to the history.
    ///
    /// # Errors
    /// If the arrays are not a polygon mesh, or a control does not fit into the cage. The document is then unchanged.
    #[wasm_bindgen(js_name = setCage, unchecked_return_type = "CageState")]
    pub fn set_cage(
        &self,
        #[wasm_bindgen(unchecked_param_type = "CageArrays")] cage: JsValue,
        label: Option<String>,
    ) -> Answer<JsValue> {
        let cage: CageArrays = decode(cage)?;
        let (mesh, is_step) = (cage.mesh()?, label.is_some());
        let CageArrays { controls, notices, rings, .. } = cage;
        let rings = rings.map_or_else(Vec::new, |rings| rings.loops().into_values().collect());
        self.step(Command::ReplaceCage { mesh, controls, notices, rings }, label)?;
        if !is_step {
            self.change(|state| state.editor.amend());
        }
        Ok(self.cage_state())
    }

    /// Draws the edges of another cage in place of the current one, until this is called without a cage or the cage
    /// changes.
    ///
    /// # Errors
    /// If the arrays are not a polygon mesh.
    #[wasm_bindgen(js_name = showDraft)]
    pub fn show_draft(
        &self,
        #[wasm_bindgen(unchecked_param_type = "CageArrays | undefined")] cage: JsValue,
    ) -> Answer<()> {
        let cage: Option<CageArrays> = decode(cage)?;
        let mesh = cage.map(|cage| cage.mesh()).transpose()?.unwrap_or_default();
        let edges = Topology::new(&mesh.faces).edges.into_iter();
        self.change(|state| {
            state.draft = edges.map(|edge| edge.map(|i| mesh.positions[i as usize])).collect();
            state.is_changed = true;
        });
        Ok(())
    }

    /// Draws line segments, `[n_segments, 2, 3]`, in place of the cage, until `showDraft` is called or the cage changes.
    #[wasm_bindgen(js_name = showLines)]
    pub fn show_lines(&self, segments: &[f32]) {
        self.change(|state| {
            state.draft = points(segments).as_chunks().0.to_vec();
            state.is_changed = true;
        });
    }

    /// Properties of the cage for panels; undefined without a cage.
    #[wasm_bindgen(js_name = cageState, unchecked_return_type = "CageState | undefined")]
    pub fn cage_state(&self) -> JsValue {
        self.read(|state| optional(CageState::from_cage(state.cage())))
    }

    /// Applies a command to the document. With a label, adds a step to the history; otherwise the next history step
    /// includes the change.
    ///
    /// # Errors
    /// If the command cannot be applied. The document is then unchanged.
    pub fn apply(
        &self,
        #[wasm_bindgen(unchecked_param_type = "Command")] command: JsValue,
        label: Option<String>,
    ) -> Answer<()> {
        self.step(decode(command)?, label)
    }

    /// Adds a step to the history with all changes since the last history step; false if nothing has changed.
    pub fn commit(&self, label: &str) -> bool {
        self.change(|state| state.editor.commit(label))
    }

    /// Adds all changes since the last history step to that step.
    pub fn amend(&self) {
        self.change(|state| state.editor.amend());
    }

    /// Reverts all changes since the last history step.
    pub fn revert(&self) {
        self.change(|state| {
            state.editor.revert();
            state.show_painting();
            state.is_changed = true;
        });
    }

    /// Undoes the last history step; false if there is no step to undo, or while models are being added.
    pub fn undo(&self) -> bool {
        self.change(|state| !state.is_adding && state.editor.undo())
    }

    /// Redoes the history step that was undone last; false if nothing was undone, or while models are being added.
    pub fn redo(&self) -> bool {
        self.change(|state| !state.is_adding && state.editor.redo())
    }

    /// Deletes all history steps, so that nothing can be undone or redone.
    #[wasm_bindgen(js_name = clearHistory)]
    pub fn clear_history(&self) {
        self.change(|state| state.editor.clear_history());
    }

    /// The cage at rest, with its inner controls.
    #[wasm_bindgen(js_name = cageArrays, unchecked_return_type = "CageArrays & { controls: CageControls }")]
    pub fn cage_arrays(&self) -> JsValue {
        self.read(|state| {
            let controls = Some(state.cage().controls.clone());
            object(&CageArrays { controls, ..CageArrays::of(state.rest()) })
        })
    }

    /// Cage vertices and inner controls at rest. `[n_controls, 3]`
    #[wasm_bindgen(js_name = restPositions)]
    pub fn rest_positions(&self) -> Vec<f32> {
        self.read(|state| flat(&state.rest().positions))
    }

    /// Current positions of cage vertices and inner controls. `[n_controls, 3]`
    #[wasm_bindgen(js_name = cagePositions)]
    pub fn cage_positions(&self) -> Vec<f32> {
        self.read(|state| flat(state.pose()))
    }

    /// Sets the pose. Does nothing if `positions` has another number of controls than the cage.
    #[wasm_bindgen(js_name = setCagePositions)]
    pub fn set_cage_positions(&self, positions: &[f32]) {
        // The result of a job for an earlier cage may arrive after the cage has changed.
        let _ = self.change(|state| state.editor.set_pose(points(positions)));
    }

    /// Returns the current pose and each saved pose that fits this cage, for `Binder.carryPoses`.
    /// `[n_poses, n_controls, 3]`
    pub fn carriable(&self) -> Vec<f32> {
        self.read(|state| {
            let document = state.editor.document();
            let saved = document.fitting_poses().flat_map(|pose| flat(&pose.positions));
            flat(state.pose()).into_iter().chain(saved).collect()
        })
    }

    /// Starts or ends reshaping the cage. If the start resets a pose, adds a step to the history with this label, which
    /// the end removes if nothing has changed since.
    #[wasm_bindgen(js_name = setEditingRest)]
    pub fn set_editing_rest(&self, editing: bool, label: &str) {
        self.change(|state| {
            state.editor.set_editing_rest(editing, label);
            state.is_changed = true;
        });
    }

    /// Estimates the memory of a bind, bytes.
    ///
    /// # Errors
    /// Without a cage, or if an option is out of range.
    #[wasm_bindgen(js_name = estimateMemory)]
    pub fn estimate_memory(
        &self,
        #[wasm_bindgen(unchecked_param_type = "BindOptions")] options: JsValue,
    ) -> Answer<f64> {
        let request: PageBindOptions = decode(options)?;
        self.read(|state| {
            let n = state.models().positions().len() + state.models().extra_points()?.len();
            Ok(estimate_memory(state.require_set()?, n, &request.options)? as f64)
        })
    }

    /// Estimates the work of a bind as a number of updates of one value at a grid node. A processor core does about
    /// 10^9 updates per second.
    ///
    /// # Errors
    /// Without a cage, or if an option is out of range.
    #[wasm_bindgen(js_name = estimateUpdates)]
    pub fn estimate_updates(
        &self,
        #[wasm_bindgen(unchecked_param_type = "BindOptions")] options: JsValue,
    ) -> Answer<f64> {
        let request: PageBindOptions = decode(options)?;
        self.read(|state| Ok(estimate_updates(state.require_set()?, &request.options)?))
    }

    /// Encodes the current pose compactly, in the axes of the model's file.
    #[wasm_bindgen(js_name = encodePose)]
    pub fn encode_pose(&self) -> Vec<u8> {
        self.read(|state| {
            let in_file = |positions| state.up().turned_back(positions);
            encode_pose(&in_file(&state.rest().positions), &in_file(state.pose()))
        })
    }

    /// Sets the pose from the bytes of `encodePose`.
    ///
    /// # Errors
    /// If the bytes are damaged or belong to another cage.
    #[wasm_bindgen(js_name = decodePose)]
    pub fn decode_pose(&self, bytes: &[u8]) -> Answer<()> {
        self.change(|state| {
            let up = state.up();
            let pose = decode_pose(&up.turned_back(&state.rest().positions), bytes)?;
            Ok(state.editor.set_pose(up.turned(&pose).into_owned())?)
        })
    }
}

impl Engine {
    /// Applies a command; with a label, adds a step to the history.
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
