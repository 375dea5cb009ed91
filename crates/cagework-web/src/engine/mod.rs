//! The engine: everything that the page's main thread asks Rust for.
//!
//! Each file adds the methods of one kind. None of them waits, but those that return promises; a change asks the page
//! for a frame and is drawn with it.

mod cage;
mod camera;
mod controls;
mod export;
mod gesture;
mod models;
mod picture;
mod play;
mod pull;
mod rest;
mod scene;
mod select;
mod slice;

use std::cell::RefCell;
use std::rc::Rc;

use async_lock::Mutex;
use cagework_core::{Frames, Weights};
use cagework_gpu::Session;
use cagework_gpu::render::check_layers;
use js_sys::{Float32Array, Function, Uint32Array};
use wasm_bindgen::JsValue;
use wasm_bindgen::prelude::wasm_bindgen;
use wasm_bindgen_futures::spawn_local;
use web_sys::HtmlCanvasElement;

use crate::binder::Offsets;
use crate::controls::MadeCage;
use crate::error::{Answer, ErrorName, Fault};
use crate::gpu::{Gpu, SharedGpu};
use crate::incoming::{self, page_turn};
use crate::joints::JointDots;
use crate::loaded::Loaded;
use crate::models::Models;
use crate::options::{Coordinates, taken};
use crate::state::State;
use crate::surface::Surface;

/// Models, cage, camera and picture of one page.
#[wasm_bindgen]
pub struct Engine {
    state: Rc<RefCell<State>>,
    gpu: SharedGpu,
    /// Asks the page for a frame.
    invalidate: Function,
}

#[wasm_bindgen]
impl Engine {
    /// An engine that draws into a canvas; `invalidate` is called when a frame is needed.
    ///
    /// # Errors
    /// `NoAdapter`, `NoDevice`.
    pub async fn create(canvas: HtmlCanvasElement, invalidate: Function) -> Result<Engine, JsValue> {
        let (surface, context) = Surface::open(canvas).await?;
        let gpu = Gpu { main: Session::new(context), others: Vec::new(), surface };
        Ok(Self { state: Rc::default(), gpu: Rc::new(Mutex::new(Some(gpu))), invalidate })
    }

    /// Shows the model of a file that was read. The file's handle is used up.
    ///
    /// # Errors
    /// When the GPU has no room for it, or draws too slowly for its many layers; what was open stays open.
    #[wasm_bindgen(unchecked_return_type = "ModelInfo")]
    pub async fn open(&self, mut loaded: Loaded) -> Result<JsValue, JsValue> {
        let (camera, size) = self.read(|state| state.view_of(&loaded.model));
        let draw = loaded.draw_model();
        let settings = loaded.member_settings();
        page_turn().await;
        let models = Models::one(loaded.model, draw, settings);
        {
            let mut gpu = self.gpu.lock().await;
            let gpu = gpu.as_mut().ok_or_else(lost)?;
            let Models { positions, triangles, .. } = &models;
            check_layers(gpu.main.context(), &camera, positions, triangles, size).map_err(Fault::from)?;
            gpu.main.set_shared_model(models.draw()).await.map_err(Fault::from)?;
            gpu.main.set_parts(models.parts()).await.map_err(Fault::from)?;
            gpu.others.clear();
        }
        page_turn().await;
        self.change(|state| state.set_models(models));
        Ok(self.info()?)
    }

    /// Takes what the worker has bound: rows, columns and weights, and the columns of offsets.
    ///
    /// # Errors
    /// When the arrays do not fit model and cage, or the GPU has no room for them; `Cancelled` when another cage came meanwhile.
    pub async fn adopt(
        &self,
        indptr: Vec<u32>,
        indices: Uint32Array,
        data: Float32Array,
        #[wasm_bindgen(unchecked_param_type = "Offsets")] offsets: JsValue,
    ) -> Result<(), JsValue> {
        let (revision, n_columns) = self.read(|state| (state.revision, state.rest().positions.len() as u32));
        let n_vertices = self.read(|state| state.models.positions.len());
        let Offsets { frames, outside } = taken(offsets)?;
        let n_columns = n_columns + frames.n_columns() as u32;
        let all = incoming::weights(n_columns, &indptr, &indices, &data).await?;
        let (weights, rig) = split(all, n_vertices);
        let is_current = || self.read(|state| state.require(revision));
        let mut gpu = self.gpu.lock().await;
        let gpu = gpu.as_mut().ok_or_else(lost)?;
        // The cage may still be waiting for its turn, and would take the weights away again.
        upload_cage(&self.state, gpu).await?;
        is_current()?;
        gpu.main.adopt(weights, frames.clone()).await.map_err(Fault::from)?;
        is_current()?;
        self.change(|state| {
            state.is_bound = true;
            state.joints = rig.as_ref().and_then(|weights| {
                let of_rig = outside.iter().filter_map(|o| o.vertex.checked_sub(n_vertices as u32));
                let of_rig: Vec<u32> = of_rig.collect();
                // What is wrong with a rig is said when it is exported.
                JointDots::new(&state.models, weights, frames, &of_rig).ok()
            });
            (state.rig, state.outside) = (rig, outside);
            state.playing = None;
            (state.is_moved, state.is_changed) = (true, true);
        });
        Ok(())
    }

    /// Takes coordinates by formula to compare with; the arrays are those of `adopt`.
    ///
    /// # Errors
    /// As `adopt`.
    #[wasm_bindgen(js_name = adoptOther)]
    pub async fn adopt_other(
        &self,
        #[wasm_bindgen(unchecked_param_type = "Coordinates")] kind: JsValue,
        indptr: Vec<u32>,
        indices: Uint32Array,
        data: Float32Array,
    ) -> Result<(), JsValue> {
        let kind: Coordinates = taken(kind)?;
        let (revision, n_columns) = self.read(|state| {
            // Closed forms know the plain cage alone.
            let n_faces = state.set().map_or(0, |set| set.cage().triangles().len());
            let n_more = if kind == Coordinates::Green { n_faces } else { 0 };
            (state.revision, (state.made.n_cage() + n_more) as u32)
        });
        let weights = incoming::weights(n_columns, &indptr, &indices, &data).await?;
        self.read(|state| state.require(revision))?;
        let mut gpu = self.gpu.lock().await;
        let gpu = gpu.as_mut().ok_or_else(lost)?;
        let mut other = gpu.main.twin().await.map_err(Fault::from)?;
        match kind {
            Coordinates::Green => other.adopt_green(weights).await,
            _ => other.adopt(weights, Frames::default()).await,
        }
        .map_err(Fault::from)?;
        self.read(|state| state.require(revision))?;
        gpu.others.retain(|(before, _)| *before != kind);
        gpu.others.push((kind, other));
        self.change(|state| {
            state.others = gpu.others.iter().map(|(kind, _)| *kind).collect();
            (state.is_moved, state.is_changed) = (true, true);
            state.place_viewport();
        });
        Ok(())
    }

    /// Whether there are coordinates of a kind, to compare with.
    ///
    /// # Errors
    /// When it is no kind.
    #[wasm_bindgen(js_name = hasOther)]
    pub fn has_other(
        &self,
        #[wasm_bindgen(unchecked_param_type = "Coordinates")] kind: JsValue,
    ) -> Result<bool, JsValue> {
        let kind = taken(kind)?;
        Ok(self.read(|state| state.others.contains(&kind)))
    }

    /// Counts up with each change of model or rest cage.
    #[wasm_bindgen(getter)]
    #[must_use]
    pub fn revision(&self) -> u32 {
        self.read(|state| state.revision)
    }

    /// What a job that was started at a revision results in is taken only if this passes.
    ///
    /// # Errors
    /// `Cancelled` when there is another model or cage by now.
    #[wasm_bindgen(js_name = requireCurrent)]
    pub fn require_current(&self, revision: u32) -> Result<(), JsValue> {
        Ok(self.read(|state| state.require(revision))?)
    }

    /// Whether the model follows the cage.
    #[wasm_bindgen(getter)]
    #[must_use]
    pub fn bound(&self) -> bool {
        self.read(|state| state.is_bound)
    }

    /// Resolves with the reason when the GPU is lost.
    ///
    /// # Errors
    /// Never while the engine is alive.
    pub async fn lost(&self) -> Result<String, JsValue> {
        let receiver = {
            let gpu = self.gpu.lock().await;
            gpu.as_ref().ok_or_else(lost)?.main.context().lost()
        };
        Ok(receiver.await.map_err(|_| Fault::new(ErrorName::DeviceLost, "the GPU is gone"))?)
    }

    /// Gives the device up, as a reset of the driver would; called too when the browser says that it took it away.
    pub fn lose(&self) {
        if let Some(gpu) = self.gpu.try_lock().as_ref().and_then(|gpu| gpu.as_ref()) {
            gpu.main.context().lose("the browser took it away");
        }
    }

    /// Everything again on a new device. After an error it can be called again.
    ///
    /// # Errors
    /// `NoAdapter`, `NoDevice`: try again later; or the GPU has no room for the model.
    pub async fn recover(&self, canvas: HtmlCanvasElement) -> Result<(), JsValue> {
        let (surface, context) = Surface::open(canvas).await?;
        {
            let mut shared = self.gpu.lock().await;
            let gpu = shared.as_mut().ok_or_else(lost)?;
            let main = gpu.main.recover(context).await.map_err(Fault::from)?;
            *gpu = Gpu { main, others: Vec::new(), surface };
            // A cage may have come while there was no device to take it.
            upload_cage(&self.state, gpu).await?;
        }
        self.change(|state| {
            state.others.clear();
            (state.is_moved, state.is_changed) = (true, true);
            state.place_viewport();
        });
        Ok(())
    }
}

impl Engine {
    fn read<T>(&self, read: impl FnOnce(&State) -> T) -> T {
        read(&self.state.borrow())
    }

    /// Changes something, and asks for a frame.
    fn change<T>(&self, change: impl FnOnce(&mut State) -> T) -> T {
        let changed = change(&mut self.state.borrow_mut());
        // The page only notes that it has something to draw: there is nothing that could fail.
        let _ = self.invalidate.call0(&JsValue::NULL);
        changed
    }

    /// Another cage, here at once and on the GPU when it has answered.
    fn take_cage(&self, made: MadeCage) {
        self.change(|state| state.set_cage(made));
        let (state, gpu, invalidate) =
            (Rc::clone(&self.state), Rc::clone(&self.gpu), self.invalidate.clone());
        spawn_local(async move {
            let mut gpu = gpu.lock().await;
            let Some(gpu) = gpu.as_mut() else { return };
            let outcome = upload_cage(&state, gpu).await;
            let mut state = state.borrow_mut();
            state.fault = outcome.err().or_else(|| state.fault.take());
            (state.is_moved, state.is_changed) = (true, true);
            drop(state);
            let _ = invalidate.call0(&JsValue::NULL);
        });
    }

    /// Reads what is on the GPU, unless it is waiting for an answer.
    fn with_session<T>(&self, read: impl FnOnce(&Session) -> Answer<T>) -> Answer<T> {
        let gpu = self
            .gpu
            .try_lock()
            .ok_or_else(|| Fault::new(ErrorName::Error, "the GPU is busy: try again in a moment"))?;
        read(&gpu.as_ref().ok_or_else(lost)?.main)
    }
}

/// Weights of the vertices, and apart from them those of the rig's points, if there are any.
fn split(weights: Weights, n_vertices: usize) -> (Weights, Option<Weights>) {
    let n = weights.n_rows();
    if n <= n_vertices {
        return (weights, None);
    }
    let rows =
        |range: std::ops::Range<usize>| weights.with_rows(&range.map(|row| row as u32).collect::<Vec<_>>());
    (rows(0..n_vertices), Some(rows(n_vertices..n)))
}

/// Sees to it that the GPU has the cage of the moment; weights for the one before are dropped.
async fn upload_cage(state: &RefCell<State>, gpu: &mut Gpu) -> Answer<()> {
    let (revision, set) = {
        let state = state.borrow();
        let missing = state.set().filter(|_| !state.is_on_gpu());
        (state.revision, missing.cloned())
    };
    let Some(set) = set else { return Ok(()) };
    gpu.others.clear();
    gpu.main.set_cage(&set).await?;
    state.borrow_mut().on_gpu = Some(revision);
    Ok(())
}

fn lost() -> Fault {
    Fault::new(ErrorName::DeviceLost, "the GPU is gone: reload the page")
}
