//! Methods that move the cage: gestures, typed positions, and playback of saved poses.

use cagework_core::view::View as _;
use cagework_editor::edit::{Constraint, Gesture, GestureKind};
use cagework_gpu::render::{GizmoMode, GizmoPart, pick_gizmo};
use glam::{Vec2, Vec3};
use wasm_bindgen::JsValue;
use wasm_bindgen::prelude::wasm_bindgen;

use super::Engine;
use crate::error::Answer;
use crate::options::decode;
use crate::state::State;
use crate::views::{object, optional};

/// Smallest movement of the selection that changes the cage, pixels.
const MIN_MOVE: f32 = 1e-3;

#[wasm_bindgen]
impl Engine {
    /// Begins a gesture that moves, rotates or scales the selection; false if nothing is selected or another gesture is
    /// in progress.
    ///
    /// # Errors
    /// If the kind of gesture is unknown.
    #[wasm_bindgen(js_name = beginTransform)]
    pub fn begin_transform(
        &self,
        #[wasm_bindgen(unchecked_param_type = "Gesture")] kind: JsValue,
        x: f32,
        y: f32,
    ) -> Answer<bool> {
        let kind = decode(kind)?;
        Ok(self.change(|state| {
            let at = state.pointer(x, y);
            state.editor.begin(kind, at, Constraint::Free)
        }))
    }

    /// Highlights and returns the gizmo's handle under the pointer, or the nearest handle within `radius` CSS pixels.
    /// Undefined if there is no such handle.
    #[wasm_bindgen(js_name = gizmoAt, unchecked_return_type = "GizmoPart | undefined")]
    pub fn gizmo_at(&self, x: f32, y: f32, radius: f32) -> JsValue {
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
        optional(part)
    }

    /// Begins the gesture that dragging a handle of the gizmo performs; false if nothing is selected or another gesture
    /// is in progress.
    ///
    /// # Errors
    /// If the handle is unknown.
    #[wasm_bindgen(js_name = beginGizmo)]
    pub fn begin_gizmo(
        &self,
        #[wasm_bindgen(unchecked_param_type = "GizmoPart")] part: JsValue,
        x: f32,
        y: f32,
    ) -> Answer<bool> {
        let part = decode(part)?;
        Ok(self.change(|state| {
            let kind = match state.view.gizmo.unwrap_or_default() {
                GizmoMode::Move => GestureKind::Grab,
                GizmoMode::Rotate => GestureKind::Rotate,
                GizmoMode::Scale => GestureKind::Scale,
            };
            let constraint = match part {
                GizmoPart::Axis(axis) => Constraint::Axis(axis.min(2).into()),
                GizmoPart::Plane(axis) => Constraint::Plane(axis.min(2).into()),
                GizmoPart::View => Constraint::Free,
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

    /// State of the gesture for the status line; null without one.
    #[wasm_bindgen(js_name = gestureView, unchecked_return_type = "GestureView | null")]
    pub fn gesture_view(&self) -> JsValue {
        object(&self.read(|state| state.editor.gesture().as_ref().map(|g| g.view(&state.camera))))
    }

    /// Ends the gesture, and reverts it unless `keep` is set. Returns true if `keep` is set and a vertex has moved.
    #[wasm_bindgen(js_name = endTransform)]
    pub fn end_transform(&self, keep: bool) -> bool {
        self.change(|state| {
            state.active_part = None;
            state.is_changed = true;
            state.editor.end(keep)
        })
    }

    /// Moves the selection so that its centre is at a point; false if nothing is selected or the movement is too small.
    #[wasm_bindgen(js_name = moveSelectionTo)]
    pub fn move_selection_to(&self, x: f32, y: f32, z: f32) -> bool {
        self.change(|state| {
            let Some(center) = state.editor.selection.center(state.pose()) else { return false };
            state.shift(Vec3::new(x, y, z) - center)
        })
    }

    /// Moves the selection in the view plane by CSS pixels; false if nothing is selected or the movement is too small.
    pub fn nudge(&self, right: f32, up: f32) -> bool {
        self.change(|state| {
            let Some(center) = state.editor.selection.center(state.pose()) else { return false };
            let by = state.camera.in_view_plane(center, Vec2::new(right, -up));
            state.shift(by)
        })
    }

    /// Whether a vertex of the cage has no mirror image, so that it moves alone while editing is symmetric.
    #[wasm_bindgen(js_name = movesAlone)]
    pub fn moves_alone(&self, vertex: u32) -> bool {
        self.read(|state| state.editor.tools().symmetry && state.editor.symmetry().partner(vertex).is_none())
    }

    /// Centre of the selection and radius of proportional editing around it, CSS pixels: x, y, radius. Empty while
    /// proportional editing is off or no gesture is in progress.
    #[wasm_bindgen(js_name = reachCircle)]
    pub fn reach_circle(&self) -> Vec<f32> {
        self.read(|state| {
            let (reach, center) = (state.editor.reach(), state.editor.selection.center(state.pose()));
            let Some(center) = center.filter(|_| reach > 0.0 && state.editor.gesture().is_some()) else {
                return Vec::new();
            };
            let radius = reach / state.camera.units_per_pixel(center);
            let at = state.camera.project(center).map(|image| image.position);
            at.map_or_else(Vec::new, |at| vec![at.x, at.y, radius])
        })
    }

    /// Moves the cage to its pose at a time, in seconds, of the animation of the saved poses, and sets the shares of
    /// the poses.
    #[wasm_bindgen(js_name = playAt)]
    pub fn play_at(&self, seconds: f32) {
        self.change(|state| state.editor.play_at(seconds));
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
