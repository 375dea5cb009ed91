//! The engine: the Rust methods that the page's main thread calls.
//!
//! Each file adds the methods of one topic. Only methods that return promises wait for the GPU. Each change of the
//! state asks the page for a new frame, which the page draws by calling `drawFrame`.

mod cage;
mod camera;
mod controls;
mod export;
mod gesture;
mod models;
mod picture;
mod play;
mod proportions;
mod pull;
mod rest;
mod scene;
mod select;
mod slice;
mod walk;

use std::cell::RefCell;
use std::f32::consts::PI;
use std::rc::Rc;
use std::sync::Arc;

use async_lock::Mutex;
use cagework_core::Coordinates;
use cagework_editor::BoundModels;
use cagework_gpu::Session;
use cagework_gpu::render::{Camera, check_layers};
use glam::Vec2;
use js_sys::Function;
use wasm_bindgen::JsValue;
use wasm_bindgen::prelude::wasm_bindgen;
use wasm_bindgen_futures::spawn_local;
use web_sys::HtmlCanvasElement;

use crate::error::{Answer, ErrorName, Fault};
use crate::gpu::{Gpu, SharedGpu, upload};
use crate::incoming::{self, page_turn};
use crate::loaded::LoadedModel;
use crate::opening::OpenContents;
use crate::options::decode;
use crate::state::{State, joined};
use crate::surface::CanvasSurface;
use crate::views::{View, object};
use crate::weights::Offsets;

/// Models, cage, camera and rendering of one page.
#[wasm_bindgen]
#[derive(Clone)]
pub struct Engine {
    state: Rc<RefCell<State>>,
    gpu: SharedGpu,
    /// JavaScript callback that requests a frame from the page.
    invalidate: Function,
    /// JavaScript callback that receives a changed [`View`].
    changed: Function,
    /// The last view that was passed to `changed`.
    last_view: Rc<RefCell<View>>,
}

#[wasm_bindgen]
impl Engine {
    /// Creates an engine that draws into a canvas. It calls `invalidate` when a frame is needed, and `changed` with a
    /// `View` after the document, the selection or the weights change.
    ///
    /// # Errors
    /// `NoAdapter` or `NoDevice` if no GPU can be opened; `Canvas` if the GPU cannot draw into the canvas.
    pub async fn create(
        canvas: HtmlCanvasElement,
        invalidate: Function,
        #[wasm_bindgen(unchecked_param_type = "(view: View) => void")] changed: Function,
    ) -> Answer<Engine> {
        let (surface, context) = CanvasSurface::open(canvas).await?;
        let gpu = Gpu { main: Session::new(context), others: Vec::new(), surface };
        Ok(Self {
            state: Rc::default(),
            gpu: Rc::new(Mutex::new(Some(gpu))),
            invalidate,
            changed,
            last_view: Rc::default(),
        })
    }

    /// Replaces the open models, cage and poses, and clears the history. Consumes the JavaScript handles of the models.
    /// Turns a capture upright, unless it belongs to a sample or a project. Returns notices for the user, one sentence each.
    ///
    /// # Errors
    /// If the GPU runs out of memory, or cannot draw the models' transparent layers fast enough. The previous models
    /// then remain open.
    pub async fn open(
        &self,
        models: Vec<LoadedModel>,
        #[wasm_bindgen(unchecked_param_type = "OpenContents")] contents: JsValue,
    ) -> Answer<Vec<String>> {
        let contents: OpenContents = decode(contents)?;
        let mut models = models;
        if models.len() > 1 && models.iter().any(|loaded| loaded.model.n_faces() == 0) {
            return Err(one_capture());
        }
        let Some(first) = models.first_mut() else {
            return Err(Fault::missing("model", "open one first"));
        };
        if contents.is_new_file() {
            first.stand_up();
        }
        let (contents, settings) = contents.read(first)?;
        let mut notices = Vec::new();
        let (up, origin) = (first.model.up(), first.model.origin());
        let mut draws = Vec::new();
        for (k, loaded) in models.iter_mut().enumerate() {
            if k > 0 {
                loaded.turn_to(up);
                loaded.model.set_origin(origin);
            }
            draws.push(Arc::new(loaded.draw_model()));
            page_turn().await;
        }
        let models: Vec<_> = models
            .into_iter()
            .map(|loaded| {
                let settings = loaded.member_settings();
                (loaded.model, settings)
            })
            .collect();
        {
            let mut gpu = self.gpu.lock().await;
            let gpu = gpu.as_mut().ok_or_else(lost)?;
            for (model, _) in &models {
                let (camera, size) = self.read(|state| state.view_of(&model.positions));
                check_layers(gpu.main.context(), &camera, &model.positions, &model.triangles, size)?;
            }
            page_turn().await;
            let draw = joined(&draws.iter().collect::<Vec<_>>());
            gpu.others.clear();
            self.state.borrow_mut().forget_gpu();
            if let Err(error) = gpu.main.set_shared_model(draw).await {
                // `change` starts an upload of the previous models, because `forget_gpu` marked all data as missing.
                self.change(|_| ());
                return Err(error.into());
            }
            self.change(|state| {
                state.editor.open(models, contents);
                state.draws = (0..).zip(draws).collect();
                state.cache.clear();
                state.has_uploaded_mesh();
                state.camera = Camera::default();
                if state.models().faces_negative_z() {
                    state.camera.orbit(Vec2::new(PI, 0.0));
                }
                state.fit_camera();
                state.frame_all();
                notices.extend(state.editor.take_pose(&settings).err().map(str::to_owned));
            });
        }
        page_turn().await;
        Ok(notices)
    }

    /// Uses the weights that `Binder.bind` computed: row pointers, a function that returns a range of column indices
    /// and values, the offsets, and the report. If `is_final` is set, also caches the weights for undo.
    ///
    /// # Errors
    /// If the arrays do not match models and cage, or the GPU runs out of memory. `Cancelled` if models or cage change
    /// during the upload.
    pub async fn adopt(
        &self,
        indptr: Vec<u32>,
        #[wasm_bindgen(unchecked_param_type = "WeightRows")] rows: Function,
        #[wasm_bindgen(unchecked_param_type = "Offsets")] offsets: JsValue,
        #[wasm_bindgen(unchecked_param_type = "BindReport")] report: JsValue,
        is_final: bool,
    ) -> Result<(), JsValue> {
        let (revision, key) = self.read(|state| (state.revision, state.editor.key()));
        let n_columns = self.read(|state| state.rest().positions.len() as u32);
        let Offsets { frames, outside } = decode(offsets)?;
        let n_columns = n_columns + frames.n_columns() as u32;
        let all = incoming::weights(n_columns, &indptr, &rows).await?;
        let is_current = || self.read(|state| state.require(revision));
        is_current()?;
        let bound = self.read(|state| BoundModels::new(state.editor.document(), all, frames, outside));
        let bound = Arc::new(bound);
        let mut gpu = self.gpu.lock().await;
        let gpu = gpu.as_mut().ok_or_else(lost)?;
        // Finish pending uploads first: uploading a cage drops the weights on the GPU.
        upload(&self.state, gpu).await?;
        is_current()?;
        gpu.main.adopt(Arc::clone(&bound.weights), Arc::clone(&bound.frames)).await.map_err(Fault::from)?;
        is_current()?;
        self.change(|state| {
            let (bytes, bound) = (bound.bytes(), (bound, Rc::new(report)));
            if is_final {
                state.cache.insert(key, bound.clone(), bytes);
            }
            state.set_bound(bound);
        });
        Ok(())
    }

    /// Whether weights of the current models and cage are in use, or cached from an earlier bind.
    #[wasm_bindgen(getter, js_name = hasWeights)]
    pub fn has_weights(&self) -> bool {
        self.read(|state| state.bound.is_some() || state.cache.contains(state.editor.key()))
    }

    /// Bind report of the weights in use; undefined without weights.
    #[wasm_bindgen(js_name = boundReport, unchecked_return_type = "BindReport | undefined")]
    pub fn bound_report(&self) -> JsValue {
        self.read(|state| state.bound.as_ref().map_or(JsValue::UNDEFINED, |_| JsValue::clone(&state.report)))
    }

    /// Adds closed-form coordinates of a kind, for comparison. Arrays as for `adopt`.
    ///
    /// # Errors
    /// The errors of `adopt`.
    #[wasm_bindgen(js_name = adoptOther)]
    pub async fn adopt_other(
        &self,
        #[wasm_bindgen(unchecked_param_type = "Coordinates")] kind: JsValue,
        indptr: Vec<u32>,
        #[wasm_bindgen(unchecked_param_type = "WeightRows")] rows: Function,
    ) -> Result<(), JsValue> {
        let kind: Coordinates = decode(kind)?;
        if self.read(|state| state.models().splats().is_some()) {
            let reason = "coordinates cannot be compared on splats and points: open a mesh";
            return Err(Fault::new(ErrorName::Error, reason).into());
        }
        let (revision, n_columns) = self
            .read(|state| (state.revision, state.set().map_or(0, |set| kind.n_columns(set.cage())) as u32));
        let weights = incoming::weights(n_columns, &indptr, &rows).await?;
        self.read(|state| state.require(revision))?;
        let mut gpu = self.gpu.lock().await;
        let gpu = gpu.as_mut().ok_or_else(lost)?;
        let mut other = gpu.main.twin().await.map_err(Fault::from)?;
        other.adopt_closed_form(kind, weights).await.map_err(Fault::from)?;
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

    /// Whether coordinates of this kind are available for comparison.
    ///
    /// # Errors
    /// If the kind is unknown.
    #[wasm_bindgen(js_name = hasOther)]
    pub fn has_other(
        &self,
        #[wasm_bindgen(unchecked_param_type = "Coordinates")] kind: JsValue,
    ) -> Answer<bool> {
        let kind = decode(kind)?;
        Ok(self.read(|state| state.others.contains(&kind)))
    }

    /// Number that increases with each change of the models' joined mesh or of the rest cage.
    #[wasm_bindgen(getter)]
    pub fn revision(&self) -> u32 {
        self.read(|state| state.revision)
    }

    /// Checks that the result of a job that was started at `revision` is still valid.
    ///
    /// # Errors
    /// `Cancelled` if models or cage have changed since that revision.
    #[wasm_bindgen(js_name = requireCurrent)]
    pub fn require_current(&self, revision: u32) -> Answer<()> {
        self.read(|state| state.require(revision))
    }

    /// Whether weights are in use, so that the model follows the cage.
    #[wasm_bindgen(getter)]
    pub fn bound(&self) -> bool {
        self.read(|state| state.bound.is_some())
    }

    /// Resolves with the reason when the GPU device is lost.
    ///
    /// # Errors
    /// If no device is open.
    pub async fn lost(&self) -> Answer<String> {
        let receiver = {
            let gpu = self.gpu.lock().await;
            gpu.as_ref().ok_or_else(lost)?.main.context().lost()
        };
        receiver.await.map_err(|_| Fault::new(ErrorName::DeviceLost, "the GPU is gone"))
    }

    /// Marks the GPU device as lost. The page calls this when the browser reports a loss; tests call it to simulate
    /// one.
    pub fn lose(&self) {
        if let Some(gpu) = self.gpu.try_lock().as_ref().and_then(|gpu| gpu.as_ref()) {
            gpu.main.context().lose("the browser took it away");
        }
    }

    /// Opens a new GPU device and uploads all data to it. Can be called again after an error.
    ///
    /// # Errors
    /// `NoAdapter` or `NoDevice` if no GPU can be opened yet; `Canvas` if the GPU cannot draw into the canvas. Also if
    /// the GPU runs out of memory.
    pub async fn recover(&self, canvas: HtmlCanvasElement) -> Answer<()> {
        let (surface, context) = CanvasSurface::open(canvas).await?;
        {
            let mut shared = self.gpu.lock().await;
            let gpu = shared.as_mut().ok_or_else(lost)?;
            let main = gpu.main.recover(context).await?;
            *gpu = Gpu { main, others: Vec::new(), surface };
            // The document may have changed while the device was opened.
            upload(&self.state, gpu).await?;
        }
        self.change(|state| {
            state.others.clear();
            state.on_gpu.floaters = None;
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

    /// Changes the state, drops derived state that the change made out of date, notifies the page, requests a frame,
    /// and starts an upload if the GPU lacks data.
    fn change<T>(&self, change: impl FnOnce(&mut State) -> T) -> T {
        let changed = {
            let mut state = self.state.borrow_mut();
            let changed = change(&mut state);
            state.follow_document();
            changed
        };
        self.announce();
        self.start_upload();
        self.follow_pose();
        changed
    }

    /// Passes the view to the page if it has changed, and requests a frame.
    fn announce(&self) {
        let view = self.read(State::document_view);
        if *self.last_view.borrow() != view {
            let given = object(&view);
            *self.last_view.borrow_mut() = view;
            // Ignore exceptions that the page's callback throws.
            let _ = self.changed.call1(&JsValue::NULL, &given);
        }
        let _ = self.invalidate.call0(&JsValue::NULL);
    }

    /// Starts an upload of the document to the GPU if the GPU's copy is out of date and no upload is in progress.
    fn start_upload(&self) {
        {
            let mut state = self.state.borrow_mut();
            if state.is_uploading || !state.needs_upload() {
                return;
            }
            state.is_uploading = true;
        }
        let engine = self.clone();
        spawn_local(async move {
            let outcome = match engine.gpu.lock().await.as_mut() {
                Some(gpu) => upload(&engine.state, gpu).await,
                None => Ok(()),
            };
            {
                let mut state = engine.state.borrow_mut();
                state.is_uploading = false;
                state.fault = outcome.err().or_else(|| state.fault.take());
            }
            engine.announce();
        });
    }
}

fn one_capture() -> Fault {
    Fault::new(ErrorName::Error, "splats and points cannot share a cage with other models: open them alone")
}

fn lost() -> Fault {
    Fault::new(ErrorName::DeviceLost, "the GPU is gone: reload the page")
}
