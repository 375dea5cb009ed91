//! Moving the cage: gestures, exact numbers, poses.

use cagework_core::edit::{Constraint, Gesture, GestureKind, View as _, moment, reblend};
use cagework_gpu::render::{GizmoPart, pick_gizmo};
use glam::{Vec2, Vec3};
use js_sys::{Array, Float32Array};
use wasm_bindgen::prelude::wasm_bindgen;
use wasm_bindgen::{JsCast as _, JsValue};

use super::Engine;
use crate::arrays::points;
use crate::error::Fault;
use crate::options::{GizmoAsked, GizmoHandle, taken};
use crate::state::State;
use crate::views::object;

/// Movements below this fraction of a pixel are none.
const STILL: f32 = 1e-3;

#[wasm_bindgen]
impl Engine {
    /// Begins a gesture, grab, rotate or scale; false when nothing is selected.
    ///
    /// # Errors
    /// When the gesture is another.
    #[wasm_bindgen(js_name = beginTransform)]
    pub fn begin_transform(
        &self,
        #[wasm_bindgen(unchecked_param_type = "Gesture")] kind: JsValue,
        x: f32,
        y: f32,
    ) -> Result<bool, JsValue> {
        let kind = taken(kind)?;
        Ok(self.change(|state| state.begin(kind, x, y)))
    }

    /// The gizmo's handle under the pointer, or the nearest one within `radius`, CSS pixels; undefined for none.
    ///
    /// # Errors
    /// Never.
    #[wasm_bindgen(js_name = gizmoAt, unchecked_return_type = "GizmoHandle | undefined")]
    pub fn gizmo_at(&self, x: f32, y: f32, radius: f32) -> Result<JsValue, JsValue> {
        let part = self.read(|state| {
            let gizmo = state.gizmo().filter(|_| state.has_cage_in_view())?;
            pick_gizmo(&state.camera, &gizmo, state.pointer(x, y), radius)
        });
        if self.read(|state| state.gesture.is_none() && state.active_part != part) {
            self.change(|state| {
                state.active_part = part;
                state.is_changed = true;
            });
        }
        Ok(part.map_or(Ok(JsValue::UNDEFINED), |part| object(&handle_of(part)))?)
    }

    /// Begins the gesture of one of the gizmo's handles.
    ///
    /// # Errors
    /// When there is no such handle.
    #[wasm_bindgen(js_name = beginGizmo)]
    pub fn begin_gizmo(
        &self,
        #[wasm_bindgen(unchecked_param_type = "GizmoHandle")] handle: JsValue,
        x: f32,
        y: f32,
    ) -> Result<bool, JsValue> {
        let (part, constraint) = part_of(taken(handle)?);
        Ok(self.change(|state| {
            let kind = match state.view.gizmo {
                GizmoAsked::None | GizmoAsked::Move => GestureKind::Grab,
                GizmoAsked::Rotate => GestureKind::Rotate,
                GizmoAsked::Scale => GestureKind::Scale,
            };
            let began = state.begin(kind, x, y);
            if let Some(gesture) = state.gesture.as_mut().filter(|_| began) {
                gesture.constrain(constraint);
                state.active_part = Some(part);
            }
            began
        }))
    }

    /// Follows the pointer.
    #[wasm_bindgen(js_name = dragTransform)]
    pub fn drag_transform(&self, x: f32, y: f32) {
        self.with_gesture(|gesture, pointer| gesture.drag(pointer(x, y)));
    }

    /// Limits the gesture to an axis, 0 to 2, or to the plane across it; any other number frees it.
    pub fn constrain(&self, axis: i32, plane: bool) {
        self.with_gesture(|gesture, _| {
            gesture.constrain(match (axis, plane) {
                (0..=2, false) => Constraint::Axis(axis as usize),
                (0..=2, true) => Constraint::Plane(axis as usize),
                _ => Constraint::Free,
            });
        });
    }

    /// Takes an amount instead of the pointer; undefined goes back to the pointer.
    #[wasm_bindgen(js_name = typeTransform)]
    pub fn type_transform(&self, amount: Option<f32>) {
        self.with_gesture(|gesture, _| gesture.type_amount(amount));
    }

    /// How far gestures draw others along, in diagonals of the cage; 0 for not at all.
    #[wasm_bindgen(js_name = setProportional)]
    pub fn set_proportional(&self, radius: f32) {
        self.change(|state| {
            state.radius = radius.max(0.0);
            if let Some(mut gesture) = state.gesture.take() {
                gesture.set_pull(state.pull(gesture.start()));
                let positions = gesture.positions(&state.camera);
                state.gesture = Some(gesture);
                state.move_to(positions);
            }
        });
    }

    /// What the gesture does now.
    #[wasm_bindgen(js_name = transformLabel)]
    #[must_use]
    pub fn transform_label(&self) -> String {
        self.read(|state| state.gesture.as_ref().map(|g| g.label(&state.camera)).unwrap_or_default())
    }

    /// Ends the gesture; true when it moved something and is kept.
    #[wasm_bindgen(js_name = endTransform)]
    #[must_use]
    pub fn end_transform(&self, keep: bool) -> bool {
        self.change(|state| {
            let Some(gesture) = state.gesture.take() else { return false };
            state.active_part = None;
            state.is_changed = true;
            let moved = gesture.start() != state.positions;
            if !keep {
                state.move_to(gesture.start().to_vec());
            }
            keep && moved
        })
    }

    /// Moves the selection's middle to a point.
    #[wasm_bindgen(js_name = moveSelectionTo)]
    #[must_use]
    pub fn move_selection_to(&self, x: f32, y: f32, z: f32) -> bool {
        self.change(|state| {
            let Some(center) = state.selection.center(&state.positions) else { return false };
            state.shift(Vec3::new(x, y, z) - center)
        })
    }

    /// Moves the selection in the view plane, CSS pixels.
    #[must_use]
    pub fn nudge(&self, right: f32, up: f32) -> bool {
        self.change(|state| {
            let Some(center) = state.selection.center(&state.positions) else { return false };
            let by = state.camera.in_view_plane(center, Vec2::new(right, -up));
            state.shift(by)
        })
    }

    /// What turns and scales go about.
    ///
    /// # Errors
    /// When it is something else.
    #[wasm_bindgen(js_name = setPivot)]
    pub fn set_pivot(
        &self,
        #[wasm_bindgen(unchecked_param_type = "Pivot")] pivot: JsValue,
    ) -> Result<(), JsValue> {
        let pivot = taken(pivot)?;
        self.change(|state| {
            state.pivot = pivot;
            state.is_changed = true;
        });
        Ok(())
    }

    /// Mixes poses by their shares: `from` had the shares `before`, and keeps what a hand has moved since.
    ///
    /// # Errors
    /// When a pose belongs to another cage.
    pub fn blend(
        &self,
        #[wasm_bindgen(unchecked_param_type = "readonly Float32Array[]")] poses: &Array,
        from: &[f32],
        before: &[f32],
        shares: &[f32],
    ) -> Result<(), JsValue> {
        let poses = pose_list(poses);
        let mixed = self
            .read(|state| reblend(&state.rest().positions, &poses, &points(from), before, shares))
            .map_err(Fault::from)?;
        self.change(|state| state.move_to(mixed));
        Ok(())
    }

    /// A moment of the animation through the poses.
    ///
    /// # Errors
    /// When a pose belongs to another cage.
    #[wasm_bindgen(js_name = playAt)]
    pub fn play_at(
        &self,
        #[wasm_bindgen(unchecked_param_type = "readonly Float32Array[]")] poses: &Array,
        seconds: f32,
    ) -> Result<(), JsValue> {
        let poses = pose_list(poses);
        let now = self.read(|state| moment(&state.rest().positions, &poses, seconds)).map_err(Fault::from)?;
        self.change(|state| state.move_to(now));
        Ok(())
    }
}

/// The name of a part of the gizmo.
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

/// The part of that name, and what it limits a gesture to.
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
    /// Changes the gesture under way, and the cage with it.
    fn with_gesture(&self, change: impl FnOnce(&mut Gesture, &dyn Fn(f32, f32) -> Vec2)) {
        self.change(|state| {
            let Some(mut gesture) = state.gesture.take() else { return };
            change(&mut gesture, &|x, y| state.pointer(x, y));
            let positions = gesture.positions(&state.camera);
            state.gesture = Some(gesture);
            state.move_to(positions);
        });
    }
}

impl State {
    fn begin(&mut self, kind: GestureKind, x: f32, y: f32) -> bool {
        let pivot = self.selection.pivot(&self.positions, &self.topology, self.pivot);
        let Some(pivot) = pivot else { return false };
        let pull = self.pull(&self.positions);
        let at = self.pointer(x, y);
        self.gesture = Some(Gesture::new(kind, self.positions.clone(), pull, pivot, at));
        true
    }

    /// Moves the selection, and what goes along with it.
    fn shift(&mut self, by: Vec3) -> bool {
        let smallest = STILL * self.camera.units_per_pixel(self.camera.target);
        if !by.is_finite() || by.length() < smallest {
            return false;
        }
        let moved = self.pull(&self.positions).apply(&self.positions, &|p, share| p + share * by);
        self.move_to(moved);
        true
    }
}

/// Poses as arrays of JavaScript to points.
pub(super) fn pose_list(poses: &Array) -> Vec<Vec<Vec3>> {
    poses
        .iter()
        .map(|pose| pose.dyn_into::<Float32Array>().map(|p| points(&p.to_vec())).unwrap_or_default())
        .collect()
}
