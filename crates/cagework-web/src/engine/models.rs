//! Methods for adding models to a cage and for painting regions that stay in place.

use std::sync::Arc;

use cagework_editor::ModelInfo;
use cagework_gpu::render::check_layers;
use cagework_io::Model;
use js_sys::Uint8Array;
use wasm_bindgen::JsValue;
use wasm_bindgen::prelude::wasm_bindgen;

use super::{Engine, lost, one_capture};
use crate::error::Answer;
use crate::gpu::upload;
use crate::incoming::page_turn;
use crate::loaded::LoadedModel;
use crate::state::State;
use crate::views::object;

#[wasm_bindgen]
impl Engine {
    /// Adds models. Keeps the cage and its pose, and drops the weights. With a label, adds a step to the history.
    /// Consumes the JavaScript handles of the models.
    ///
    /// # Errors
    /// The errors of `open`. The document is then unchanged.
    pub async fn add(&self, models: Vec<LoadedModel>, label: Option<String>) -> Answer<()> {
        let is_capture = self.read(|state| state.models().splats().is_some());
        if is_capture || models.iter().any(|loaded| loaded.model.n_faces() == 0) {
            return Err(one_capture());
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
        let add = |state: &mut State| {
            let ids = state.editor.add_models(added);
            state.draws.extend(ids.zip(draws));
            Ok(())
        };
        self.change_models(label, add).await
    }

    /// Replaces a model by one with the same surface, as a step of the history, see `Models::replace`. Drops the weights.
    /// Consumes the JavaScript handle of the model.
    ///
    /// # Errors
    /// If there is no such model, and the errors of `open`. The document is then unchanged.
    pub async fn replace(&self, id: u32, mut loaded: LoadedModel, label: String) -> Answer<()> {
        let draw = Arc::new(loaded.draw_model());
        let replace = |state: &mut State| {
            let own = state.editor.replace_model(id, loaded.model)?;
            state.draws.insert(own, draw);
            Ok(())
        };
        self.change_models(Some(label), replace).await
    }

    /// Converts a model to arrays, from which `LoadedModel.restore` recreates it in a worker.
    ///
    /// # Errors
    /// If no open model has this id.
    #[wasm_bindgen(js_name = storedModel)]
    pub fn stored_model(&self, id: u32) -> Answer<Vec<Uint8Array>> {
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

    /// Approximate memory of the models, bytes, without one model.
    #[wasm_bindgen(js_name = modelBytes)]
    pub fn model_bytes(&self, without: Option<u32>) -> f64 {
        self.read(|state| {
            let others = state.models().iter().filter(|member| Some(member.id) != without);
            others.map(|member| member.model.bytes() as f64).sum()
        })
    }

    /// Properties of the models, for panels.
    ///
    /// # Errors
    /// If no model is open.
    #[wasm_bindgen(js_name = modelInfo, unchecked_return_type = "ModelInfo")]
    pub fn model_info(&self) -> Answer<JsValue> {
        self.read(|state| Ok(object(&ModelInfo::from_models(state.models())?)))
    }

    /// Painted amount of each vertex of a model, 0 (moves with the cage) to 255 (stays in place). `[n_vertices]`, empty
    /// if unpainted
    ///
    /// # Errors
    /// If no open model has this id.
    pub fn painted(&self, id: u32) -> Answer<Vec<u8>> {
        self.read(|state| Ok(state.models().get(id)?.painted.to_vec()))
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
    pub fn paint(&self, x: f32, y: f32, radius: f32, amount: u8) -> Answer<bool> {
        let Some(id) = self.read(|state| state.painting.as_ref().map(|(id, _)| *id)) else {
            return Ok(false);
        };
        let brush = self.posed(|state| state.posed_models().brush(id, state.pointer(x, y), radius))?;
        if let Some(brush) = brush {
            self.change(|state| {
                state.editor.dab(id, brush, &state.held.posed, amount);
                state.show_painting();
            });
        }
        Ok(brush.is_some())
    }

    /// Returns the brush radius of [`Engine::paint`] at the pointer, in CSS pixels; undefined if `paint` would have no
    /// effect there.
    #[wasm_bindgen(js_name = brushRadius)]
    pub fn brush_radius(&self, x: f32, y: f32, radius: f32) -> Option<f32> {
        let radius = |state: &State| {
            let (id, _) = state.painting.as_ref()?;
            let brush = state.posed_models().brush(*id, state.pointer(x, y), radius)?;
            Some(brush.radius / state.camera.units_per_pixel(brush.center))
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
