//! Methods for dragging the model's surface while a worker solves for the cage.

use std::sync::Arc;

use cagework_core::view::View as _;
use cagework_editor::SurfacePoint;
use cagework_gpu::Session;
use glam::{Vec2, Vec3};
use wasm_bindgen::JsValue;
use wasm_bindgen::prelude::wasm_bindgen;

use super::Engine;
use crate::error::{Answer, Fault};
use crate::options::decode;
use crate::state::State;
use crate::views::object;

#[wasm_bindgen]
impl Engine {
    /// Surface point under the pointer; undefined if the pointer is not on a model, without weights, during playback,
    /// or while the GPU is busy.
    ///
    /// # Errors
    /// Never.
    #[wasm_bindgen(js_name = surfaceAt, unchecked_return_type = "SurfacePoint | undefined")]
    pub fn surface_at(&self, x: f32, y: f32) -> Result<JsValue, JsValue> {
        if self.read(|state| state.playing.is_some()) {
            // During playback, the drawn surface differs from the posed surface that is picked.
            return Ok(JsValue::UNDEFINED);
        }
        let found = self.posed(|state, _| Ok(state.surface_at(state.pointer(x, y)))).ok().flatten();
        Ok(found.map_or(Ok(JsValue::UNDEFINED), |point| object(&point))?)
    }

    /// Posed position of a surface point; empty if the point does not exist. `[3]`
    ///
    /// # Errors
    /// Without weights, or while the GPU is busy.
    #[wasm_bindgen(js_name = placeOf)]
    pub fn place_of(
        &self,
        #[wasm_bindgen(unchecked_param_type = "SurfacePoint")] point: JsValue,
    ) -> Result<Vec<f32>, JsValue> {
        let point = decode(point)?;
        let place = self.posed(|state, _| Ok(state.place_of(point)))?;
        Ok(place.map_or_else(Vec::new, |p| p.to_array().to_vec()))
    }

    /// Weights of a surface point, and the nearest vertex of the model; undefined if the point does not exist.
    ///
    /// # Errors
    /// Without weights.
    #[wasm_bindgen(js_name = gripOf, unchecked_return_type = "Grip | undefined")]
    pub fn grip_of(
        &self,
        #[wasm_bindgen(unchecked_param_type = "SurfacePoint")] point: JsValue,
    ) -> Result<JsValue, JsValue> {
        let point: SurfacePoint = decode(point)?;
        let grip = self.posed(|state, session| {
            Ok(session.weights().zip(session.frames()).and_then(|bound| state.grip_of(point, bound)))
        })?;
        Ok(grip.map_or(Ok(JsValue::UNDEFINED), |grip| object(&grip))?)
    }

    /// Mirror image of a surface point; undefined if the surface is not symmetric there.
    ///
    /// # Errors
    /// Never.
    #[wasm_bindgen(js_name = imageOf, unchecked_return_type = "SurfacePoint | undefined")]
    pub fn image_of(
        &self,
        #[wasm_bindgen(unchecked_param_type = "SurfacePoint")] point: JsValue,
    ) -> Result<JsValue, JsValue> {
        let point = decode(point)?;
        let image = self.read(|state| state.image_of(point));
        Ok(image.map_or(Ok(JsValue::UNDEFINED), |image| object(&image))?)
    }

    /// Moves a position parallel to the view plane by `dx`, `dy` CSS pixels. `[3]`
    #[wasm_bindgen(js_name = followed)]
    #[must_use]
    pub fn followed(&self, place: &[f32], dx: f32, dy: f32) -> Vec<f32> {
        let [x, y, z] = place.first_chunk().copied().unwrap_or_default();
        let place = Vec3::new(x, y, z);
        let moved = self.read(|state| place + state.camera.in_view_plane(place, Vec2::new(dx, dy)));
        moved.to_array().to_vec()
    }

    /// Marks grabs and pins; the first point is the grab. `target`: position of the pointer, if the grab is not there.
    ///
    /// # Errors
    /// If `points` is not an array of surface points.
    #[wasm_bindgen(js_name = showHeld)]
    pub fn show_held(
        &self,
        #[wasm_bindgen(unchecked_param_type = "readonly SurfacePoint[]")] points: JsValue,
        target: Option<Vec<f32>>,
    ) -> Result<(), JsValue> {
        let points: Vec<SurfacePoint> = decode(points)?;
        if self.read(|state| state.held.points == points && state.held.target.is_none()) && target.is_none() {
            return Ok(());
        }
        self.change(|state| {
            state.held.points = points;
            state.held.target = target.filter(|t| t.len() == 3).map(|t| Vec3::from_slice(&t));
            state.is_changed = true;
        });
        Ok(())
    }

    /// Shades in grey how much each vertex stays in place, 0 to 1, `[n_vertices]`; undefined removes the shading.
    #[wasm_bindgen(js_name = showStays)]
    pub fn show_stays(&self, stays: Option<Vec<f32>>) {
        self.change(|state| {
            state.held.stays = stays.map(Arc::new);
            state.is_changed = true;
        });
    }
}

impl Engine {
    /// Updates the posed models, then reads the state.
    pub(super) fn posed<T>(&self, read: impl FnOnce(&State, &Session) -> Answer<T>) -> Answer<T> {
        self.with_session(|session| {
            session.weights().ok_or_else(|| Fault::missing("weights", "bind the model first"))?;
            let mut state = self.state.borrow_mut();
            state.pose_models(session);
            read(&state, session)
        })
    }
}
