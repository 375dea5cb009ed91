//! Methods that read and move the camera.

use std::f32::consts::TAU;

use cagework_core::Bounds;
use cagework_gpu::render::{AxisView, Projection};
use glam::{Vec2, Vec3};
use wasm_bindgen::JsValue;
use wasm_bindgen::prelude::wasm_bindgen;

use super::Engine;
use crate::error::{Answer, ErrorName, Fault};
use crate::options::decode;
use crate::state::State;
use crate::views::object;

/// Length of a pointer movement that orbits the camera by 360 degrees, CSS pixels.
const PIXELS_PER_TURN: f32 = 900.0;

#[wasm_bindgen]
impl Engine {
    /// Target, direction, distance and projection of the camera.
    #[wasm_bindgen(unchecked_return_type = "CameraView")]
    pub fn camera(&self) -> JsValue {
        self.read(|state| object(&state.camera.view()))
    }

    /// Sets the camera's target, direction, distance and projection.
    ///
    /// # Errors
    /// If a number is not finite or is out of range.
    #[wasm_bindgen(js_name = setCamera)]
    pub fn set_camera(
        &self,
        #[wasm_bindgen(unchecked_param_type = "CameraView")] view: JsValue,
    ) -> Answer<()> {
        let view = decode(view)?;
        let is_view = self.change(|state| state.camera.set_view(view));
        let invalid = || Fault::new(ErrorName::Error, "the camera of this link is invalid");
        is_view.then_some(()).ok_or_else(invalid)
    }

    /// Orbits the camera by a pointer movement in CSS pixels.
    pub fn orbit(&self, dx: f32, dy: f32) {
        self.change(|state| state.camera.orbit(Vec2::new(dx, dy) * (TAU / PIXELS_PER_TURN)));
    }

    /// Pans the camera by a pointer movement in CSS pixels.
    pub fn pan(&self, dx: f32, dy: f32) {
        self.change(|state| state.camera.pan(Vec2::new(dx, dy)));
    }

    /// Zooms by `factor` about the point (`x`, `y`) of the view, CSS pixels.
    #[wasm_bindgen(js_name = zoomAt)]
    pub fn zoom_at(&self, x: f32, y: f32, factor: f32) {
        if factor.is_finite() && factor > 0.0 {
            self.change(|state| {
                let at = state.pointer(x, y);
                state.camera.zoom_at(factor.recip(), at);
            });
        }
    }

    /// Moves the camera to fit the posed cage into the view, or the models if there is no cage.
    #[wasm_bindgen(js_name = frameAll)]
    pub fn frame_all(&self) {
        self.change(State::frame_all);
    }

    /// Moves the camera so that the selected vertices fit into the view. If nothing is selected, acts as `frameAll`.
    #[wasm_bindgen(js_name = frameSelection)]
    pub fn frame_selection(&self) {
        self.change(|state| {
            let selected: Vec<Vec3> =
                state.editor.selection.vertices().iter().map(|&i| state.pose()[i as usize]).collect();
            match Bounds::around(&selected) {
                Some(bounds) => state.camera.frame(bounds),
                None => state.frame_all(),
            }
        });
    }

    /// Directions of the axes x, y, z in the view: right, up, and towards the eye. `[3, 3]`
    pub fn axes(&self) -> Vec<f32> {
        self.read(|state| state.camera.axes()).iter().flat_map(Vec3::to_array).collect()
    }

    /// Looks along an axis, 0 to 2, from its positive end, or from its negative end if `negative` is set.
    #[wasm_bindgen(js_name = axisView)]
    pub fn axis_view(&self, axis: u32, negative: bool) {
        self.change(|state| state.camera.look_along(AxisView::from_end(axis, negative)));
    }

    /// Toggles between perspective and parallel projection; returns true if the projection is now parallel.
    #[wasm_bindgen(js_name = toggleOrtho)]
    pub fn toggle_ortho(&self) -> bool {
        self.change(|state| {
            let parallel = state.camera.projection == Projection::Perspective;
            state.camera.projection =
                if parallel { Projection::Orthographic } else { Projection::Perspective };
            parallel
        })
    }

    /// Projects a point to the view. Returns x and y in CSS pixels, then 1; all zero if the point is behind the camera.
    /// `[3]`
    pub fn project(&self, x: f32, y: f32, z: f32) -> Vec<f32> {
        let projected = self.read(|state| state.camera.project(Vec3::new(x, y, z)));
        projected.map_or_else(|| vec![0.0; 3], |p| vec![p.position.x, p.position.y, 1.0])
    }
}
