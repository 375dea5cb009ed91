//! Several models in one cage: what comes and goes, and what of them the cage does not bend.

use std::rc::Rc;
use std::sync::Arc;

use cagework_core::edit::pick_surface;
use cagework_gpu::render::check_layers;
use glam::Vec3;
use wasm_bindgen::JsValue;
use wasm_bindgen::prelude::wasm_bindgen;
use wasm_bindgen_futures::spawn_local;

use super::{Engine, lost};
use crate::error::{Answer, ErrorName, Fault};
use crate::gpu::Gpu;
use crate::incoming::page_turn;
use crate::loaded::Loaded;
use crate::models::{Models, PartOptions};
use crate::options::taken;
use crate::state::State;
use crate::views::{ModelInfo, object};

/// What is painted whole.
const ALL: f32 = 255.0;
/// Share of a dab's radius that it paints whole; from there to its rim it fades.
const FULL: f32 = 0.5;

#[wasm_bindgen]
impl Engine {
    /// Puts the models of files that were read into the cage that is open. Cage and pose stay, weights are dropped. The files' handles
    /// are used up.
    ///
    /// # Errors
    /// As `open`; nothing changes then.
    #[wasm_bindgen(unchecked_return_type = "ModelInfo")]
    pub async fn add(&self, loaded: Vec<Loaded>) -> Result<JsValue, JsValue> {
        let (up, origin) = self.read(|state| (state.up(), state.models.origin()));
        let prepare = |mut loaded: Loaded| {
            loaded.turn_to(up);
            loaded.model.see_from(origin);
            let (draw, settings) = (loaded.draw_model(), loaded.member_settings());
            (loaded.model, draw, settings)
        };
        let others: Vec<_> = loaded.into_iter().map(prepare).collect();
        let add = |models: &mut Models| {
            models.add(others);
            Ok(())
        };
        Ok(self.show_models(add).await?)
    }

    /// Takes models out of the cage, or brings them back. Cage and pose stay, weights are dropped.
    ///
    /// # Errors
    /// When none would be left, or the GPU has no room for them; nothing changes then.
    #[wasm_bindgen(unchecked_return_type = "ModelInfo")]
    pub async fn bin(&self, ids: Vec<u32>, binned: bool) -> Result<JsValue, JsValue> {
        Ok(self.show_models(|models| models.bin(&ids, binned)).await?)
    }

    /// What of a model is shown, keeps its shape, or stays as it is. Weights stay.
    ///
    /// # Errors
    /// When a name is that of no part; nothing changes then.
    #[wasm_bindgen(js_name = setParts, unchecked_return_type = "ModelInfo")]
    pub fn set_parts(
        &self,
        id: u32,
        #[wasm_bindgen(unchecked_param_type = "PartOptions")] options: JsValue,
    ) -> Result<JsValue, JsValue> {
        let options: PartOptions = taken(options)?;
        self.state.borrow_mut().models.get_mut(id)?.set_options(options)?;
        self.parts_changed();
        Ok(self.info()?)
    }

    /// How much of each vertex of a model is painted to stay, 0 to 255; empty for nothing. `[n_vertices]`
    ///
    /// # Errors
    /// When there is no such model.
    pub fn painted(&self, id: u32) -> Result<Vec<u8>, JsValue> {
        Ok(self.read(|state| state.models.get(id).map(|member| member.painted.clone()))?)
    }

    /// Takes that back.
    ///
    /// # Errors
    /// When there is no such model, or it has another number of vertices.
    #[wasm_bindgen(js_name = setPainted, unchecked_return_type = "ModelInfo")]
    pub fn set_painted(&self, id: u32, amounts: Vec<u8>) -> Result<JsValue, JsValue> {
        {
            let mut state = self.state.borrow_mut();
            let member = state.models.get_mut(id)?;
            let n = member.model.positions.len();
            if !amounts.is_empty() && amounts.len() != n {
                let given = amounts.len();
                return Err(Fault::new(ErrorName::Error, format!("{given} amounts for {n} vertices")).into());
            }
            let is_any = amounts.iter().any(|&amount| amount > 0);
            member.painted = if is_any { amounts } else { Vec::new() };
        }
        self.parts_changed();
        Ok(self.info()?)
    }

    /// Greys what stays of a model while it is painted; undefined for none.
    #[wasm_bindgen(js_name = showPainting)]
    pub fn show_painting(&self, id: Option<u32>) {
        self.change(|state| {
            state.painting = id.map(|id| (id, Arc::default()));
            state.show_painting();
        });
    }

    /// Paints the model that is shown so around the point under the pointer: `radius` over the models' size, `amount` 255 to
    /// stay, 0 to follow. Whether there is such a point; what it changes moves with `setPainted` or the end of the stroke.
    ///
    /// # Errors
    /// Before there are weights, or while the GPU is busy.
    pub fn paint(&self, x: f32, y: f32, radius: f32, amount: u8) -> Result<bool, JsValue> {
        let Some(id) = self.read(|state| state.painting.as_ref().map(|(id, _)| *id)) else {
            return Ok(false);
        };
        // Brings the models to where the cage is.
        self.posed(|_, _| Ok(()))?;
        Ok(self.change(|state| {
            let is_painted = state.dab(id, [x, y], radius, amount);
            if is_painted {
                state.show_painting();
            }
            is_painted
        }))
    }

    /// Radius of the brush of [`Engine::paint`] around the point under the pointer, CSS pixels; undefined where it would paint
    /// nothing.
    ///
    /// # Errors
    /// Before there are weights, or while the GPU is busy.
    #[wasm_bindgen(js_name = brushRadius)]
    pub fn brush_radius(&self, x: f32, y: f32, radius: f32) -> Result<Option<f32>, JsValue> {
        self.posed(|_, _| Ok(()))?;
        Ok(self.read(|state| {
            let (id, _) = state.painting.as_ref()?;
            let (center, reach) = state.touched(*id, [x, y], radius)?;
            Some(reach / state.camera.units_per_pixel(center))
        }))
    }

    /// What a project keeps of the models besides their files; nothing if there is nothing to say.
    ///
    /// # Errors
    /// Never.
    #[wasm_bindgen(js_name = memberSettings, unchecked_return_type = "MemberSettings[]")]
    pub fn member_settings(&self) -> Result<JsValue, JsValue> {
        Ok(self.read(|state| object(&state.models.settings()))?)
    }
}

impl Engine {
    /// What the page is told of the models.
    pub(super) fn info(&self) -> Answer<JsValue> {
        self.read(|state| object(&ModelInfo::of(&state.models)?))
    }

    /// Brings other models in the same cage to the GPU. One change after the other: each waits for the GPU first.
    async fn show_models(&self, change: impl FnOnce(&mut Models) -> Answer<()>) -> Answer<JsValue> {
        page_turn().await;
        {
            let mut gpu = self.gpu.lock().await;
            let gpu = gpu.as_mut().ok_or_else(lost)?;
            let mut models = self.read(|state| state.models.clone());
            change(&mut models)?;
            let (draw, parts) = (models.draw(), models.parts());
            self.read(|state| {
                let size = (state.size * state.scale).as_uvec2().to_array();
                check_layers(gpu.main.context(), &state.camera, &models.positions, &models.triangles, size)
            })?;
            gpu.main.set_shared_model(draw).await?;
            gpu.main.set_parts(parts).await?;
            gpu.others.clear();
            // Before anybody else has the GPU: what it shows and what is known of it belong together.
            self.change(|state| {
                models.take_choices(&state.models);
                state.change_models(models);
            });
        }
        self.info()
    }

    /// Tells the GPU what the cage does not bend, once for many changes.
    pub(super) fn parts_changed(&self) {
        self.change(|state| {
            state.other_parts = true;
            state.is_changed = true;
            state.show_painting();
        });
        let (state, gpu, invalidate) =
            (Rc::clone(&self.state), Rc::clone(&self.gpu), self.invalidate.clone());
        spawn_local(async move {
            let mut gpu = gpu.lock().await;
            let Some(gpu) = gpu.as_mut() else { return };
            let is_told = !std::mem::take(&mut state.borrow_mut().other_parts);
            if is_told {
                return;
            }
            let parts = state.borrow().models.parts();
            let Gpu { main, others, .. } = gpu;
            for session in std::iter::once(main).chain(others.iter_mut().map(|(_, session)| session)) {
                if let Err(fault) = session.set_parts(parts.clone()).await {
                    state.borrow_mut().fault = Some(fault.into());
                }
            }
            let mut state = state.borrow_mut();
            state.held.posed_for.clear();
            (state.is_moved, state.is_changed) = (true, true);
            drop(state);
            // The page only notes that it has something to draw: there is nothing that could fail.
            let _ = invalidate.call0(&JsValue::NULL);
        });
    }
}

impl State {
    /// Greys what stays of the model that is painted.
    fn show_painting(&mut self) {
        let Some((id, _)) = self.painting else { return };
        let mut stays = vec![0.0; self.models.positions.len()];
        if let Ok(member) = self.models.get(id) {
            let own = member.parts().unwrap_or_default();
            stays[member.vertices.clone()].iter_mut().zip(own.stays).for_each(|(to, from)| *to = from);
        }
        self.painting = Some((id, Arc::new(stays)));
        self.is_changed = true;
    }

    /// The point of a model under the pointer, and how far a brush reaches from there, object units; nothing if another model is
    /// there, or none.
    fn touched(&self, id: u32, [x, y]: [f32; 2], radius: f32) -> Option<(Vec3, f32)> {
        let (at, posed) = (self.pointer(x, y), &self.held.posed);
        if posed.len() != self.models.positions.len() {
            return None;
        }
        let (triangle, bary) = pick_surface(posed, self.models.shown_triangles(), &self.camera, at)?;
        let corners = self.models.triangles[triangle as usize];
        let center = corners.iter().zip(bary).map(|(&v, share)| share * posed[v as usize]).sum();
        let reach = radius * self.bounds()?.diagonal();
        let is_own = self.models.get(id).ok()?.triangles.contains(&(triangle as usize));
        (is_own && reach > 0.0).then_some((center, reach))
    }

    /// Paints vertices of a model around the point under the pointer; false if another one is there, or none.
    fn dab(&mut self, id: u32, at: [f32; 2], radius: f32, amount: u8) -> bool {
        let Some((center, reach)) = self.touched(id, at, radius) else { return false };
        let posed = &self.held.posed;
        let Ok(member) = self.models.get_mut(id) else { return false };
        if amount == 0 && member.painted.is_empty() {
            return true;
        }
        member.painted.resize(member.model.positions.len(), 0);
        for (painted, at) in member.painted.iter_mut().zip(&posed[member.vertices.clone()]) {
            let share = 1.0 - ((at.distance(center) / reach - FULL) / (1.0 - FULL)).clamp(0.0, 1.0);
            // Again at the same place changes nothing more.
            let dab = if amount > 0 { share * f32::from(amount) } else { ALL * (1.0 - share) } as u8;
            *painted = if amount > 0 { dab.max(*painted) } else { dab.min(*painted) };
        }
        true
    }
}
