//! Methods for dragging the model's surface while a worker solves for the cage.

use std::sync::Arc;

use cagework_editor::{Grab, SurfacePoint};
use glam::{Vec2, Vec3};
use js_sys::{Array, Float64Array, Uint32Array};
use wasm_bindgen::JsValue;
use wasm_bindgen::prelude::wasm_bindgen;

use super::Engine;
use crate::error::Answer;
use crate::options::decode;
use crate::state::State;
use crate::views::{object, optional};

#[wasm_bindgen]
impl Engine {
    /// Finds the surface point under the pointer; undefined if the pointer is not on a model, without weights, or
    /// during playback.
    #[wasm_bindgen(js_name = surfaceAt, unchecked_return_type = "SurfacePoint | undefined")]
    pub fn surface_at(&self, x: f32, y: f32) -> JsValue {
        let found = self.posed(|state| state.shown_models().surface_at(state.pointer(x, y))).ok().flatten();
        optional(found)
    }

    /// Returns the position in which the view shows a surface point; empty if the point does not exist. `[3]`
    ///
    /// # Errors
    /// If `point` is not a surface point. Without weights.
    #[wasm_bindgen(js_name = placeOf)]
    pub fn place_of(
        &self,
        #[wasm_bindgen(unchecked_param_type = "SurfacePoint")] point: JsValue,
    ) -> Answer<Vec<f32>> {
        let point = decode(point)?;
        let place = self.posed(|state| state.shown_models().place_of(point))?;
        Ok(place.map_or_else(Vec::new, |p| p.to_array().to_vec()))
    }

    /// Returns the weights of the bind at the points of a pull, `[n, n_columns]`, the nearest vertex of the model for
    /// each point, or 2^32 - 1 for a vertex of the cage, and the frames of the bind. The points are `grabs`, then all
    /// pins except the one under the pointer.
    ///
    /// # Errors
    /// If `grabs` are neither surface points nor vertices. Without weights.
    #[wasm_bindgen(js_name = gripsOf, unchecked_return_type = "[Float64Array, Uint32Array, Frames]")]
    pub fn grips_of(
        &self,
        #[wasm_bindgen(unchecked_param_type = "readonly (SurfacePoint | number)[]")] grabs: JsValue,
        x: f32,
        y: f32,
    ) -> Answer<JsValue> {
        let grabs: Vec<Grab> = decode(grabs)?;
        let (rows, seeds): (Vec<Vec<f64>>, Vec<u32>) = self.posed(|state| {
            let pins = state.shown_models().pins_beside(state.pointer(x, y)).into_iter().map(Grab::Surface);
            grabs.into_iter().chain(pins).filter_map(|grab| state.bound_document().grip_of(grab)).unzip()
        })?;
        let rows = Float64Array::from(rows.concat().as_slice());
        let frames =
            self.read(|state| Answer::Ok(object(&*state.bound_document().require_bound()?.frames)))?;
        Ok(Array::of3(&rows, &Uint32Array::from(seeds.as_slice()), &frames).into())
    }

    /// Returns the pins after a click. A pin under the pointer is removed. If no pin is there and `may_pin` is set, a
    /// pin is added at the surface point under the pointer. Undefined if nothing changes, or without weights.
    #[wasm_bindgen(js_name = pinsAfter, unchecked_return_type = "SurfacePoint[] | undefined")]
    pub fn pins_after(&self, x: f32, y: f32, may_pin: bool) -> JsValue {
        let pins = self.posed(|state| state.shown_models().pins_after(state.pointer(x, y), may_pin));
        optional(pins.ok().flatten())
    }

    /// Finds the vertex nearest to the mirror image of a surface point. Undefined if no vertex is near the image, or if
    /// the point is near the mirror plane.
    ///
    /// # Errors
    /// If `point` is not a `SurfacePoint`.
    #[wasm_bindgen(js_name = imageOf, unchecked_return_type = "SurfacePoint | undefined")]
    pub fn image_of(
        &self,
        #[wasm_bindgen(unchecked_param_type = "SurfacePoint")] point: JsValue,
    ) -> Answer<JsValue> {
        let point = decode(point)?;
        let image = self.read(|state| state.editor.image_of(point));
        Ok(optional(image))
    }

    /// Moves a position of the posed models, without the motion of a clip, so that the view shows it moved by `dx`, `dy`
    /// CSS pixels parallel to the view plane. `point`: the surface point at the position. `[3]`
    ///
    /// # Errors
    /// If `point` is neither undefined nor a surface point.
    #[wasm_bindgen(js_name = followed)]
    pub fn followed(
        &self,
        place: &[f32],
        dx: f32,
        dy: f32,
        #[wasm_bindgen(unchecked_param_type = "SurfacePoint | undefined")] point: JsValue,
    ) -> Answer<Vec<f32>> {
        let point = decode(point)?;
        let [x, y, z] = place.first_chunk().copied().unwrap_or_default();
        let moved = self.read(|state| state.moved_in_view(Vec3::new(x, y, z), Vec2::new(dx, dy), point));
        Ok(moved.to_array().to_vec())
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
    ) -> Answer<()> {
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
    ///
    /// # Errors
    /// Before a bind.
    pub(super) fn posed<T>(&self, read: impl FnOnce(&State) -> T) -> Answer<T> {
        let mut state = self.state.borrow_mut();
        state.pose_models()?;
        Ok(read(&state))
    }
}
