//! Methods that move the cage: gestures, typed positions, and playback of saved poses.

use cagework_core::view::View as _;
use cagework_editor::edit::{Constraint, Gesture, GestureKind};
use cagework_gpu::render::{GizmoPart, pick_gizmo};
use glam::{Vec2, Vec3};
use wasm_bindgen::JsValue;
use wasm_bindgen::prelude::wasm_bindgen;

use super::Engine;
use crate::options::{GizmoHandle, JsGizmo, decode};
use crate::state::State;
use crate::views::object;

/// Smallest movement of the selection that changes the cage, pixels.
const MIN_MOVE: f32 = 1e-3;

#[wasm_bindgen]
impl Engine {
    /// Begins a gesture that moves, rotates or scales the selection; false if nothing is selected.
    ///
    /// # Errors
    /// If the kind of gesture is unknown.
    #[wasm_bindgen(js_name = beginTransform)]
    pub fn begin_transform(
        &self,
        #[wasm_bindgen(unchecked_param_type = "Gesture")] kind: JsValue,
        x: f32,
        y: f32,
    ) -> Result<bool, JsValue> {
        let kind = decode(kind)?;
        Ok(self.change(|state| {
            let at = state.pointer(x, y);
            state.editor.begin(kind, at, Constraint::Free)
        }))
    }

    /// The handle of the gizmo under the pointer, or the nearest handle within `radius` CSS pixels; otherwise
    /// undefined.
    ///
    /// # Errors
    /// Never.
    #[wasm_bindgen(js_name = gizmoAt, unchecked_return_type = "GizmoHandle | undefined")]
    pub fn gizmo_at(&self, x: f32, y: f32, radius: f32) -> Result<JsValue, JsValue> {
        let part = self.read(|state| {
            let gizmo = state.gizmo().filter(|_| state.has_cage_in_view())?;
            pick_gizmo(&state.camera, &gizmo, state.pointer(x, y), radius)
        });
        if self.read(|state| state.editor.gesture().is_none() && state.active_part != part) {
            self.change(|state| {
                state.active_part = part;
                state.is_changed = true;
            });
        }
        Ok(part.map_or(Ok(JsValue::UNDEFINED), |part| object(&handle_of(part)))?)
    }

    /// Begins the gesture that dragging a handle of the gizmo performs.
    ///
    /// # Errors
    /// If the handle is unknown.
    #[wasm_bindgen(js_name = beginGizmo)]
    pub fn begin_gizmo(
        &self,
        #[wasm_bindgen(unchecked_param_type = "GizmoHandle")] handle: JsValue,
        x: f32,
        y: f32,
    ) -> Result<bool, JsValue> {
        let (part, constraint) = part_of(decode(handle)?);
        Ok(self.change(|state| {
            let kind = match state.view.gizmo {
                JsGizmo::None | JsGizmo::Move => GestureKind::Grab,
                JsGizmo::Rotate => GestureKind::Rotate,
                JsGizmo::Scale => GestureKind::Scale,
            };
            let at = state.pointer(x, y);
            let began = state.editor.begin(kind, at, constraint);
            if began {
                state.active_part = Some(part);
            }
            began
        }))
    }

    /// Passes a pointer position, CSS pixels, to the gesture in progress.
    #[wasm_bindgen(js_name = dragTransform)]
    pub fn drag_transform(&self, x: f32, y: f32) {
        self.with_gesture(|gesture, pointer| gesture.drag(pointer(x, y)));
    }

    /// Restricts the gesture to an axis, 0 to 2, or with `plane` to the plane normal to it; any other number removes
    /// the restriction.
    pub fn constrain(&self, axis: i32, plane: bool) {
        self.with_gesture(|gesture, _| {
            gesture.constrain(match (axis, plane) {
                (0..=2, false) => Constraint::Axis(axis as usize),
                (0..=2, true) => Constraint::Plane(axis as usize),
                _ => Constraint::Free,
            });
        });
    }

    /// Sets the amount of the gesture to a typed number instead of the pointer movement; undefined returns to the
    /// pointer.
    #[wasm_bindgen(js_name = typeTransform)]
    pub fn type_transform(&self, amount: Option<f32>) {
        self.with_gesture(|gesture, _| gesture.type_amount(amount));
    }

    /// Sets the radius of proportional editing, in multiples of the cage's diagonal; 0 turns proportional editing off.
    #[wasm_bindgen(js_name = setProportional)]
    pub fn set_proportional(&self, radius: f32) {
        self.change(|state| state.editor.set_radius(radius, &state.camera));
    }

    /// State of the gesture for the status line; null without one.
    ///
    /// # Errors
    /// Never.
    #[wasm_bindgen(js_name = gestureView, unchecked_return_type = "GestureView | null")]
    pub fn gesture_view(&self) -> Result<JsValue, JsValue> {
        Ok(object(&self.read(|state| state.editor.gesture().as_ref().map(|g| g.view(&state.camera))))?)
    }

    /// Ends the gesture, and reverts it unless `keep` is set. Returns true if `keep` is set and a vertex has moved.
    #[wasm_bindgen(js_name = endTransform)]
    #[must_use]
    pub fn end_transform(&self, keep: bool) -> bool {
        self.change(|state| {
            state.active_part = None;
            state.is_changed = true;
            state.editor.end(keep)
        })
    }

    /// Moves the selection so that its centre is at a point; false if nothing is selected or the movement is too small.
    #[wasm_bindgen(js_name = moveSelectionTo)]
    #[must_use]
    pub fn move_selection_to(&self, x: f32, y: f32, z: f32) -> bool {
        self.change(|state| {
            let Some(center) = state.editor.selection.center(state.pose()) else { return false };
            state.shift(Vec3::new(x, y, z) - center)
        })
    }

    /// Moves the selection in the view plane by CSS pixels; false if nothing is selected or the movement is too small.
    #[must_use]
    pub fn nudge(&self, right: f32, up: f32) -> bool {
        self.change(|state| {
            let Some(center) = state.editor.selection.center(state.pose()) else { return false };
            let by = state.camera.in_view_plane(center, Vec2::new(right, -up));
            state.shift(by)
        })
    }

    /// Sets the centre about which gestures rotate and scale.
    ///
    /// # Errors
    /// If the pivot type is unknown.
    #[wasm_bindgen(js_name = setPivot)]
    pub fn set_pivot(
        &self,
        #[wasm_bindgen(unchecked_param_type = "Pivot")] pivot: JsValue,
    ) -> Result<(), JsValue> {
        let pivot = decode(pivot)?;
        self.change(|state| {
            state.editor.pivot = pivot;
            state.is_changed = true;
        });
        Ok(())
    }

    /// Moves the cage to its pose at a time, in seconds, of the animation of the saved poses.
    #[wasm_bindgen(js_name = playAt)]
    pub fn play_at(&self, seconds: f32) {
        self.change(|state| state.editor.play_at(seconds));
    }
}

/// The handle that stands for a part of the gizmo.
fn handle_of(part: GizmoPart) -> GizmoHandle {
    match part {
        GizmoPart::Axis(0) => GizmoHandle::X,
        GizmoPart::Axis(1) => GizmoHandle::Y,
        GizmoPart::Axis(_) => GizmoHandle::Z,
        GizmoPart::Plane(0) => GizmoHandle::PlaneX,
        GizmoPart::Plane(1) => GizmoHandle::PlaneY,
        GizmoPart::Plane(_) => GizmoHandle::PlaneZ,
        GizmoPart::View => GizmoHandle::All,
    }
}

/// The gizmo part that a handle stands for, and the constraint on gestures that drag it.
fn part_of(handle: GizmoHandle) -> (GizmoPart, Constraint) {
    match handle {
        GizmoHandle::X => (GizmoPart::Axis(0), Constraint::Axis(0)),
        GizmoHandle::Y => (GizmoPart::Axis(1), Constraint::Axis(1)),
        GizmoHandle::Z => (GizmoPart::Axis(2), Constraint::Axis(2)),
        GizmoHandle::PlaneX => (GizmoPart::Plane(0), Constraint::Plane(0)),
        GizmoHandle::PlaneY => (GizmoPart::Plane(1), Constraint::Plane(1)),
        GizmoHandle::PlaneZ => (GizmoPart::Plane(2), Constraint::Plane(2)),
        GizmoHandle::All => (GizmoPart::View, Constraint::Free),
    }
}

impl Engine {
    /// Changes the gesture in progress and moves the cage accordingly.
    fn with_gesture(&self, change: impl FnOnce(&mut Gesture, &dyn Fn(f32, f32) -> Vec2)) {
        self.change(|state| {
            let pointers = state.pointers();
            state.editor.drag(&state.camera, |gesture| change(gesture, &|x, y| pointers.at(x, y)));
        });
    }
}

impl State {
    /// Moves the selection; false if the movement is below [`MIN_MOVE`].
    fn shift(&mut self, by: Vec3) -> bool {
        let smallest = MIN_MOVE * self.camera.units_per_pixel(self.camera.target);
        by.length() >= smallest && self.editor.shift(by)
    }
}
