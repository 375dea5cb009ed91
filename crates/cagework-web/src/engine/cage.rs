//! The cage: made, read, edited at rest, posed.

use cagework_core::bind::estimate_memory;
use cagework_core::{PolygonMesh, subdivided_box};
use cagework_io::{decode_pose, encode_pose};
use wasm_bindgen::JsValue;
use wasm_bindgen::prelude::wasm_bindgen;

use super::Engine;
use crate::arrays::{corners, flat, points, polygon_mesh};
use crate::binder::Polygons;
use crate::controls::{self, MadeCage};
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
            let bounds = cagework_core::Bounds::of(&state.models.positions)
                .ok_or_else(|| Fault::missing("model", "open one first"))?;
            let longest = bounds.extent().max_element().max(f32::MIN_POSITIVE);
            let cut = |side: f32| (side / longest * divisions as f32).round().max(1.0) as u32;
            Answer::Ok(subdivided_box(bounds, BOX_MARGIN, bounds.extent().to_array().map(cut)))
        })?;
        Ok(mesh.into())
    }

    /// Takes a cage given as arrays; `corners`: for each face their number, then them. A mesh that is no cage yet becomes
    /// a draft. What is wrong with it the worker's `Binder.checkCage` finds. Without `controls` those that there are stay as far
    /// as they fit into it.
    ///
    /// # Errors
    /// When the arrays are no mesh, or the controls do not fit; nothing changes then.
    #[wasm_bindgen(js_name = setCage, unchecked_return_type = "CageState")]
    pub fn set_cage(
        &self,
        positions: &[f32],
        corners: &[u32],
        #[wasm_bindgen(unchecked_optional_param_type = "CageControls")] controls: JsValue,
    ) -> Result<JsValue, JsValue> {
        let mesh = polygon_mesh(positions, corners)?;
        match controls::said(controls)? {
            Some(controls) => Ok(self.put_made(MadeCage::new(mesh, controls)?)?),
            None => Ok(self.put_cage(mesh)?),
        }
    }

    /// The cage, or undefined without one.
    ///
    /// # Errors
    /// Never.
    #[wasm_bindgen(js_name = cageState, unchecked_return_type = "CageState | undefined")]
    pub fn cage_state(&self) -> Result<JsValue, JsValue> {
        Ok(self.state_object()?)
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
        self.read(|state| flat(&state.positions))
    }

    /// Moves the cage; the model follows. Positions of another cage change nothing.
    #[wasm_bindgen(js_name = setCagePositions)]
    pub fn set_cage_positions(&self, positions: &[f32]) {
        self.change(|state| state.move_to(points(positions)));
    }

    /// Whether gestures change the rest cage. The cage goes back to rest when this begins or ends.
    #[wasm_bindgen(js_name = setEditingRest)]
    pub fn set_editing_rest(&self, editing: bool) {
        self.change(|state| {
            if state.editing_rest != editing {
                state.editing_rest = editing;
                state.gesture = None;
                state.positions.clone_from(&state.made.mesh.positions);
                (state.is_moved, state.is_changed) = (true, true);
            }
        });
    }

    /// The moved rest cage becomes the cage; it has to be bound again.
    ///
    /// # Errors
    /// When the positions are no cage; nothing changes then.
    #[wasm_bindgen(js_name = commitRest, unchecked_return_type = "CageState")]
    pub fn commit_rest(&self) -> Result<JsValue, JsValue> {
        let (mesh, controls, selection, last) = self.read(|state| {
            let mesh = PolygonMesh { positions: state.positions.clone(), faces: state.rest().faces.clone() };
            (mesh, state.made.controls.clone(), state.selection.clone(), state.set().is_some())
        });
        let made = MadeCage::new(mesh, controls)?;
        if last && let Err(fault) = made.set {
            return Err(Fault::from(fault).into());
        }
        let shown = self.put_made(made)?;
        self.change(|state| state.selection = selection);
        Ok(shown)
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
            let n = self.read(|state| Answer::Ok(state.models.extra_points()?.len()))?;
            self.state.borrow_mut().n_rig = Some(n);
        }
        let bytes = self.read(|state| {
            let set = state.the_set()?;
            let n = state.models.positions.len() + state.n_rig.unwrap_or(0);
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
            encode_pose(&in_file(&state.rest().positions), &in_file(&state.positions))
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
        self.change(|state| state.move_to(state.up().turned(&pose).into_owned()));
        Ok(())
    }
}

impl Engine {
    /// Another cage or draft with the controls there are, and what the page is told about it.
    pub(super) fn put_cage(&self, mesh: PolygonMesh) -> Answer<JsValue> {
        let made = self.read(|state| state.made.replaced(&mesh));
        self.put_made(made)
    }

    pub(super) fn put_made(&self, made: MadeCage) -> Answer<JsValue> {
        self.take_cage(made);
        self.state_object()
    }

    fn state_object(&self) -> Answer<JsValue> {
        self.read(|state| state.cage_state().map_or(Ok(JsValue::UNDEFINED), |shown| object(&shown)))
    }
}
