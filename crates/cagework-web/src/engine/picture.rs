//! Methods that draw frames, render pictures, and read positions from the GPU.

use std::sync::Arc;

use cagework_core::{Bounds, Cage, Frames, Weights, subdivided_box};
use cagework_editor::BoundModels;
use cagework_gpu::Session;
use cagework_gpu::render::{DrawModel, MeshStyle};
use glam::{Vec2, Vec3};
use wasm_bindgen::JsValue;
use wasm_bindgen::prelude::wasm_bindgen;

use super::{Engine, lost};
use crate::arrays::flat;
use crate::error::{Answer, Fault};
use crate::options::decode;

/// Side of the offscreen texture that is drawn to compile pipelines, pixels.
const SMALL_SIDE: u32 = 16;

#[wasm_bindgen]
impl Engine {
    /// Sets the viewport's size, CSS pixels, and the number of device pixels per CSS pixel.
    pub fn resize(&self, width: f32, height: f32, scale: f32) {
        self.change(|state| {
            state.size = Vec2::new(width, height).max(Vec2::ONE);
            state.scale = scale.max(0.1);
            state.place_viewport();
        });
    }

    /// Sets the widths of the viewport's margins under overlays, CSS pixels. The camera's target is drawn in the middle
    /// of the uncovered area. If several pictures are shown side by side, each of them has these margins.
    pub fn cover(&self, left: f32, top: f32, right: f32, bottom: f32) {
        self.change(|state| {
            state.covered =
                [left, top, right, bottom].map(|width| if width.is_finite() { width } else { 0.0 });
            state.place_viewport();
        });
    }

    /// Draws a frame. A slow GPU draws at reduced resolution unless `sharp` is set. Returns whether the frame has full
    /// resolution; undefined if the GPU is busy and nothing was drawn, in which case the page has to draw again.
    ///
    /// # Errors
    /// `DeviceLost`. `Gpu` if the GPU refuses a command or runs out of memory.
    #[wasm_bindgen(js_name = drawFrame)]
    pub fn draw_frame(&self, sharp: bool) -> Answer<Option<bool>> {
        let Some(mut gpu) = self.gpu.try_lock() else { return Ok(None) };
        let Some(gpu) = gpu.as_mut() else { return Ok(None) };
        let mut state = self.state.borrow_mut();
        if let Some(fault) = state.fault.take() {
            return Err(fault);
        }
        gpu.take(&mut state);
        let pixels = (state.size * state.scale).round();
        let (size, scale) = ([pixels.x as u32, pixels.y as u32], state.scale);
        let (surface, sessions) = gpu.shown(&state.shown());
        surface.draw(sessions, size, scale, sharp)
    }

    /// Draws a small box mesh, bound to itself as its cage, into an offscreen texture. Drivers finish compiling a
    /// pipeline when it is first used; this draw moves that delay to before the first model opens.
    ///
    /// # Errors
    /// `DeviceLost`. `Gpu` if the GPU refuses a command or runs out of memory.
    pub async fn warm(&self) -> Answer<()> {
        let (context, (target, format)) = {
            let gpu = self.gpu.lock().await;
            let gpu = gpu.as_ref().ok_or_else(lost)?;
            (gpu.main.context().clone(), gpu.surface.parts.target(gpu.main.context(), [SMALL_SIDE; 2]))
        };
        let cage = subdivided_box(Bounds { min: Vec3::NEG_ONE, max: Vec3::ONE }, 0.0, [1; 3]);
        let cage = Cage::new(&cage)?;
        let n = cage.n_vertices() as u32;
        let identity = Weights::new(n, (0..=n).collect(), (0..n).collect(), vec![1.0; n as usize]);
        let mut session = Session::new(context);
        let model = DrawModel::plain(cage.positions().to_vec(), cage.triangles().to_vec());
        session.set_model(model).await?;
        session.set_cage(&cage).await?;
        session.adopt(identity?, Frames::default()).await?;
        session.frame_all();
        let view = target.create_view(&wgpu::TextureViewDescriptor::default());
        Ok(session.frame(&view, format, [SMALL_SIDE; 2], 1.0)?)
    }

    /// Waits until uploads in progress have finished. During an upload, the weights of an undone step are missing.
    pub async fn ready(&self) {
        drop(self.gpu.lock().await);
    }

    /// Renders the scene, or, if `alone` is set, only the model on a transparent background. RGBA pixels, rows from the
    /// top. `[height, width, 4]`
    ///
    /// # Errors
    /// If the GPU device is lost, or the picture is too large.
    pub async fn picture(&self, width: u32, height: u32, alone: bool) -> Answer<Vec<u8>> {
        self.render_picture([width, height], if alone { Subject::Model } else { Subject::Scene }).await
    }

    /// Renders the model in a saved pose, without the frame of a clip, on a transparent background. RGBA pixels, rows
    /// from the top. `[height, width, 4]`
    ///
    /// # Errors
    /// If the GPU device is lost, or the picture is too large. `Missing` if the pose does not exist or fits another cage,
    /// or while the cage is uploaded.
    #[wasm_bindgen(js_name = posePicture)]
    pub async fn pose_picture(&self, width: u32, height: u32, index: u32) -> Answer<Vec<u8>> {
        self.render_picture([width, height], Subject::Pose(index as usize)).await
    }

    /// Renders the model with the colours of one weight on a transparent background. `column`: index of the cage vertex
    /// or inner control. RGBA pixels, rows from the top. `[height, width, 4]`
    ///
    /// # Errors
    /// If the GPU device is lost, or the picture is too large. `Missing` before a bind.
    #[wasm_bindgen(js_name = weightPicture)]
    pub async fn weight_picture(&self, width: u32, height: u32, column: u32) -> Answer<Vec<u8>> {
        self.render_picture([width, height], Subject::Weight(column)).await
    }

    /// Index of the control whose weight `weightPicture` shows best from the current view; 0 before a bind.
    #[wasm_bindgen(js_name = clearestControl)]
    pub fn clearest_control(&self) -> u32 {
        self.read(|state| {
            let positions = state.models().positions();
            let clearest = |bound: &Arc<BoundModels>| {
                bound.clearest_control(positions, state.camera.backward(), state.pose().len())
            };
            state.bound.as_ref().map_or(0, clearest)
        })
    }

    /// Reads from the GPU the vertices deformed with one kind of coordinates. `[n_vertices, 3]`
    ///
    /// # Errors
    /// If no model is open. `Missing` if coordinates of this kind are not available.
    #[wasm_bindgen(js_name = readPositions)]
    pub async fn read_positions(
        &self,
        #[wasm_bindgen(unchecked_param_type = "Coordinates")] kind: JsValue,
    ) -> Answer<Vec<f32>> {
        let kind = decode(kind)?;
        let mut gpu = self.gpu.lock().await;
        let gpu = gpu.as_mut().ok_or_else(lost)?;
        gpu.take(&mut self.state.borrow_mut());
        let none = || Fault::missing("such coordinates", "compare with them first");
        let session = gpu.shown(&[kind]).1.pop().ok_or_else(none)?;
        let positions = session.read_positions().await?;
        self.change(|_| ());
        Ok(flat(&positions))
    }
}

/// What a picture shows.
enum Subject {
    /// The scene of the view.
    Scene,
    /// The model.
    Model,
    /// The model in the saved pose with this index.
    Pose(usize),
    /// The model, coloured by the weights of this control.
    Weight(u32),
}

impl Engine {
    async fn render_picture(&self, size: [u32; 2], subject: Subject) -> Answer<Vec<u8>> {
        let mut gpu = self.gpu.lock().await;
        let gpu = gpu.as_mut().ok_or_else(lost)?;
        let scale = {
            let mut state = self.state.borrow_mut();
            gpu.take(&mut state);
            if let Subject::Pose(index) = subject {
                state.write_saved_pose(index, &mut gpu.main)?;
                // The next frame writes the camera of the view again.
                if let Some(pose) = state.editor.document().poses.get(index) {
                    gpu.main.camera_mut().frame_points(&pose.positions);
                }
            }
            let mut scene = state.picture_scene(!matches!(subject, Subject::Scene));
            if let Subject::Weight(column) = subject {
                state.bound_document().require_bound()?;
                if column as usize >= state.pose().len() {
                    return Err(Fault::missing("such control", "choose another one"));
                }
                scene.mesh = MeshStyle::Weights { column };
            }
            gpu.main.set_scene(scene);
            size[1] as f32 / state.size.y
        };
        let picture = gpu.main.picture(size, scale).await.map_err(Fault::from);
        // The picture has replaced the scene on the GPU, so the next frame must write the scene of the view again.
        self.change(|state| state.is_changed = true);
        picture
    }
}
