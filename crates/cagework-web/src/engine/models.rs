//! Methods for adding models to a cage and for painting regions that stay in place.

use std::sync::Arc;

use cagework_editor::edit::pick_surface;
use cagework_gpu::render::check_layers;
use cagework_io::Model;
use glam::Vec3;
use js_sys::Uint8Array;
use wasm_bindgen::JsValue;
use wasm_bindgen::prelude::wasm_bindgen;

use super::{Engine, lost, one_capture};
use crate::error::Answer;
use crate::gpu::upload;
use crate::incoming::page_turn;
use crate::loaded::LoadedModel;
use crate::state::State;
use crate::views::{ModelInfo, object};

/// [Painted amount](cagework_editor::Member::painted) of a vertex that stays in place.
const MAX_AMOUNT: f32 = 255.0;
/// Fraction of the brush radius within which the full amount is painted; beyond it, the amount falls linearly to 0 at
/// the rim.
const FULL_SHARE: f32 = 0.5;

#[wasm_bindgen]
impl Engine {
    /// Adds models. Keeps the cage and its pose, and drops the weights. With a label, adds a step to the history.
    /// Consumes the JavaScript handles of the models.
    ///
    /// # Errors
    /// The errors of `open`. The document is then unchanged.
    pub async fn add(&self, models: Vec<LoadedModel>, label: Option<String>) -> Result<(), JsValue> {
        let is_capture = self.read(|state| state.models().splats().is_some());
        if is_capture || models.iter().any(|loaded| loaded.model.n_faces() == 0) {
            return Err(one_capture().into());
        }
        let (up, origin) = self.read(|state| (state.up(), state.models().origin()));
        let (mut added, mut draws) = (Vec::new(), Vec::new());
        for mut loaded in models {
            loaded.turn_to(up);
            loaded.model.set_origin(origin);
            draws.push(Arc::new(loaded.draw_model()));
            let settings = loaded.member_settings();
            added.push((loaded.model, settings));
            page_turn().await;
        }
        let added = self.change_models(label, |state| {
            let ids = state.editor.add_models(added);
            state.draws.extend(ids.zip(draws));
            Ok(())
        });
        Ok(added.await?)
    }

    /// Replaces a model by one with the same surface, as a step of the history, see `Models::replace`. Drops the weights.
    /// Consumes the JavaScript handle of the model.
    ///
    /// # Errors
    /// If there is no such model, and the errors of `open`. The document is then unchanged.
    pub async fn replace(&self, id: u32, mut loaded: LoadedModel, label: String) -> Result<(), JsValue> {
        let draw = Arc::new(loaded.draw_model());
        let replaced = self.change_models(Some(label), |state| {
            let own = state.editor.replace_model(id, loaded.model)?;
            state.draws.insert(own, draw);
            Ok(())
        });
        Ok(replaced.await?)
    }

    /// Converts a model to arrays, from which `LoadedModel.restore` recreates it in a worker.
    ///
    /// # Errors
    /// If no open model has this id.
    #[wasm_bindgen(js_name = storedModel)]
    pub fn stored_model(&self, id: u32) -> Result<Vec<Uint8Array>, JsValue> {
        let model = self.read(|state| Answer::Ok(Model::clone(&state.models().get(id)?.model)))?;
        Ok(LoadedModel::new(model).store())
    }

    /// Total number of pixels of the models' textures, at the sizes at which they are drawn, without those of one model.
    #[wasm_bindgen(js_name = texturePixels)]
    pub fn texture_pixels(&self, without: Option<u32>) -> f64 {
        self.read(|state| {
            let ids = state.models().iter().map(|member| member.id).filter(|id| Some(*id) != without);
            let draws = ids.filter_map(|id| state.draws.get(&id));
            let textures = draws.flat_map(|draw| &draw.textures);
            textures.map(|texture| f64::from(texture.width) * f64::from(texture.height)).sum()
        })
    }

    /// Properties of the models, for panels.
    ///
    /// # Errors
    /// If no model is open.
    #[wasm_bindgen(js_name = modelInfo, unchecked_return_type = "ModelInfo")]
    pub fn model_info(&self) -> Result<JsValue, JsValue> {
        Ok(self.read(|state| ModelInfo::of(state.models()).map(|info| object(&info)))?)
    }

    /// Painted amount of each vertex of a model, 0 (moves with the cage) to 255 (stays in place). `[n_vertices]`, empty
    /// if unpainted
    ///
    /// # Errors
    /// If no open model has this id.
    pub fn painted(&self, id: u32) -> Result<Vec<u8>, JsValue> {
        Ok(self.read(|state| Answer::Ok(state.models().get(id)?.painted.to_vec()))?)
    }

    /// Shows in colour how much each vertex of a model stays in place, and selects this model for `paint`; undefined
    /// removes the colour.
    #[wasm_bindgen(js_name = showPainting)]
    pub fn show_painting(&self, id: Option<u32>) {
        self.change(|state| {
            state.painting = id.map(|id| (id, Arc::default()));
            state.show_painting();
        });
    }

    /// Paints the model of `showPainting` around the surface point under the pointer. `radius`: fraction of the models'
    /// diagonal; `amount`: 255 keeps vertices in place, 0 lets them move. Returns false if the pointer is not on this
    /// model. The posed vertices change only after a `set_painted` command or a commit.
    ///
    /// # Errors
    /// Without weights.
    pub fn paint(&self, x: f32, y: f32, radius: f32, amount: u8) -> Result<bool, JsValue> {
        let Some(id) = self.read(|state| state.painting.as_ref().map(|(id, _)| *id)) else {
            return Ok(false);
        };
        // Update the posed models, which `dab` picks from.
        self.posed(|_| ())?;
        Ok(self.change(|state| {
            let is_painted = state.dab(id, [x, y], radius, amount);
            if is_painted {
                state.show_painting();
            }
            is_painted
        }))
    }

    /// Returns the brush radius of [`Engine::paint`] at the pointer, in CSS pixels; undefined if `paint` would have no
    /// effect there.
    #[wasm_bindgen(js_name = brushRadius)]
    pub fn brush_radius(&self, x: f32, y: f32, radius: f32) -> Option<f32> {
        let radius = |state: &State| {
            let (id, _) = state.painting.as_ref()?;
            let (center, reach) = state.touched(*id, [x, y], radius)?;
            Some(reach / state.camera.units_per_pixel(center))
        };
        self.posed(radius).ok().flatten()
    }
}

impl Engine {
    /// Changes the models and uploads them, as a step of the history if there is a label. An error reverts the change.
    async fn change_models(
        &self,
        label: Option<String>,
        change: impl FnOnce(&mut State) -> Answer<()>,
    ) -> Answer<()> {
        let mut gpu = self.gpu.lock().await;
        let gpu = gpu.as_mut().ok_or_else(lost)?;
        self.change(|state| {
            change(state)?;
            state.is_adding = true;
            Answer::Ok(())
        })?;
        let is_too_much = self.read(|state| {
            let (positions, triangles) = (state.models().positions(), state.models().triangles());
            // Count layers from a camera that frames all models. The current camera may be close to one of them, where
            // the models would cover far more of the picture than usual.
            let (camera, size) = state.view_of(positions);
            check_layers(gpu.main.context(), &camera, positions, triangles, size)
        });
        let outcome = match is_too_much {
            Ok(()) => upload(&self.state, gpu).await,
            Err(error) => Err(error.into()),
        };
        self.change(|state| {
            state.is_adding = false;
            match (&outcome, label) {
                (Err(_), _) => state.editor.revert(),
                (Ok(()), Some(label)) => {
                    state.editor.commit(label);
                }
                (Ok(()), None) => state.editor.amend(),
            }
        });
        outcome
    }
}

impl State {
    /// Finds the surface point of a model under the pointer, and the brush radius in object units. `None` if the
    /// pointer is on another model or on no model.
    fn touched(&self, id: u32, [x, y]: [f32; 2], radius: f32) -> Option<(Vec3, f32)> {
        let (at, posed) = (self.pointer(x, y), &self.held.posed);
        if posed.len() != self.models().positions().len() {
            return None;
        }
        let (triangle, bary) = pick_surface(posed, self.models().shown_triangles(), &self.camera, at)?;
        let corners = self.models().triangles()[triangle as usize];
        let center = corners.iter().zip(bary).map(|(&v, share)| share * posed[v as usize]).sum();
        let reach = radius * self.editor.bounds()?.diagonal();
        let is_own = self.models().get(id).ok()?.triangles.contains(&(triangle as usize));
        (is_own && reach > 0.0).then_some((center, reach))
    }

    /// Paints vertices of a model around the point under the pointer; false if the pointer is not on this model.
    fn dab(&mut self, id: u32, at: [f32; 2], radius: f32, amount: u8) -> bool {
        let Some((center, reach)) = self.touched(id, at, radius) else { return false };
        let Ok(member) = self.models().get(id) else { return false };
        if amount == 0 && member.painted.is_empty() {
            return true;
        }
        let (n, vertices) = (member.positions().len(), member.vertices.clone());
        let posed = &self.held.posed[vertices];
        self.editor.paint(id, |painted| {
            painted.resize(n, 0);
            for (painted, at) in painted.iter_mut().zip(posed) {
                let share =
                    1.0 - ((at.distance(center) / reach - FULL_SHARE) / (1.0 - FULL_SHARE)).clamp(0.0, 1.0);
                // Take the maximum or minimum, so that a second dab at the same place changes nothing.
                let dab =
                    if amount > 0 { share * f32::from(amount) } else { MAX_AMOUNT * (1.0 - share) } as u8;
                *painted = if amount > 0 { dab.max(*painted) } else { dab.min(*painted) };
            }
        });
        true
    }
}
