//! A model, a cage and their weights on one GPU: loading, binding, posing, drawing, reading back.
//!
//! Tests, the command line and the page use sessions. A page has two: the session on its main thread draws and deforms
//! with weights that it gets by [`Session::adopt`]; the session in a worker computes these by [`Session::bind`].

mod again;
mod columns;
mod mover;
mod parts;
mod picture;
mod playing;

use std::sync::Arc;

use cagework_core::deform::{deform_bound, vertex_normals};
use cagework_core::field::Field;
use cagework_core::options::BindOptions;
use cagework_core::{BindReport, Bounds, Cage, ControlSet, Controls, Coordinates, Frames, Progress, Weights};
use cagework_pose::parts::{BoundParts, Parts};
use glam::{Vec2, Vec3};

use crate::bind::bind_gpu;
use crate::deform::GpuWeights;
use crate::device::GpuContext;
use crate::error::GpuError;
use crate::render::{Camera, DrawModel, MAX_SAMPLES, MeshStyle, Renderer, SceneOptions, Target, colormap};
use crate::skin::Skinner;

pub use picture::MAX_PICTURE;

use columns::check_size;
use mover::Mover;

/// A model, its cage and weights on one GPU.
#[derive(Debug)]
pub struct Session {
    context: GpuContext,
    renderer: Renderer,
    camera: Camera,
    scene: SceneOptions,
    model: Option<Arc<DrawModel>>,
    controls: Option<ControlSet>,
    pose: Vec<Vec3>,
    bound: Option<SessionBind>,
    /// Parts of the model that stay in place or are rigid.
    parts: Parts,
    /// Skinning of the model while a clip plays.
    playing: Option<Skinner>,
    /// Whether the mesh follows the cage although a clip plays.
    interrupted: bool,
    /// Whether pose, skin or parts changed since the last recorded deformation.
    moved: bool,
}

/// Weights of a bind, on the CPU and on the GPU.
#[derive(Debug)]
struct SessionBind {
    kind: Coordinates,
    /// The weights, shared so that [`Session::recover`] needs no copy.
    weights: Arc<Weights>,
    frames: Arc<Frames>,
    mover: Mover,
    /// Parts that stay in place or are rigid, if there are any.
    parts: Option<Arc<BoundParts>>,
}

impl Session {
    /// Creates a session without a model.
    #[must_use]
    pub fn new(context: GpuContext) -> Self {
        Self {
            renderer: Renderer::new(&context),
            context,
            camera: Camera::default(),
            scene: SceneOptions::default(),
            model: None,
            controls: None,
            pose: Vec::new(),
            bound: None,
            parts: Parts::default(),
            playing: None,
            interrupted: false,
            moved: false,
        }
    }

    /// The GPU that the session uses.
    #[must_use]
    pub fn context(&self) -> &GpuContext {
        &self.context
    }

    /// Replaces the model and drops the weights. The camera does not move; see [`Self::frame_all`].
    ///
    /// # Errors
    /// [`GpuError::Model`] if the model's lists are inconsistent; otherwise as [`crate::buffers::Allocator::zeros`].
    pub async fn set_model(&mut self, model: DrawModel) -> Result<(), GpuError> {
        self.set_shared_model(Arc::new(model)).await
    }

    /// Like [`Self::set_model`], without copying the model.
    ///
    /// # Errors
    /// As [`Self::set_model`].
    pub async fn set_shared_model(&mut self, model: Arc<DrawModel>) -> Result<(), GpuError> {
        if let Some(reason) = model.fault() {
            return Err(GpuError::Model { reason });
        }
        self.drop_weights();
        self.parts = Parts::default();
        let normals = vertex_normals(&model.with_copies(&model.positions), &model.shading_triangles());
        self.renderer.set_model(&self.context, &model, &normals).await?;
        self.model = Some(model);
        self.update_bounds();
        // The scene may have requested a wireframe before there was a model.
        self.write_scene();
        Ok(())
    }

    /// Replaces the controls, which start in their rest pose, and drops the weights.
    ///
    /// # Errors
    /// As [`crate::buffers::Allocator::zeros`].
    pub async fn set_cage<'a>(&mut self, controls: impl Into<Controls<'a>>) -> Result<(), GpuError> {
        let controls = controls.into();
        self.drop_weights();
        self.renderer.set_cage(&self.context, controls).await?;
        self.pose = controls.rest().to_vec();
        self.controls = Some(controls.to_set());
        self.update_bounds();
        Ok(())
    }

    /// The cage in its rest pose; `None` before a cage is set.
    #[must_use]
    pub fn cage(&self) -> Option<&Cage> {
        self.controls.as_ref().map(ControlSet::cage)
    }

    /// Binds the model to the cage: on this GPU, or on the CPU if the device only draws.
    ///
    /// # Errors
    /// [`GpuError::NotReady`] if there is no model or no cage; otherwise as [`bind_gpu`].
    pub async fn bind(
        &mut self,
        options: &BindOptions,
        progress: &dyn Progress,
    ) -> Result<BindReport, GpuError> {
        let (model, controls) = self.parts()?;
        if self.context.draws_only() {
            let binding = cagework_core::bind(&model.positions, controls, options, progress)?;
            self.bound(Coordinates::Harmonic, binding.weights.into(), binding.frames.into(), None).await?;
            return Ok(binding.report);
        }
        let (binding, weights) =
            bind_gpu(&model.positions, controls, options, progress, &self.context).await?;
        self.bound(Coordinates::Harmonic, binding.weights.into(), binding.frames.into(), Some(weights))
            .await?;
        Ok(binding.report)
    }

    /// Replaces the weights by weights of harmonic coordinates that were computed elsewhere, such as in a worker.
    ///
    /// # Errors
    /// [`GpuError::NotReady`] without model or cage, [`GpuError::Model`] if sizes do not match them;
    /// otherwise as [`crate::buffers::Allocator::zeros`].
    pub async fn adopt(
        &mut self,
        weights: impl Into<Arc<Weights>>,
        frames: impl Into<Arc<Frames>>,
    ) -> Result<(), GpuError> {
        let (weights, frames) = (weights.into(), frames.into());
        let (model, controls) = self.parts()?;
        let (rows, columns) = (model.positions.len(), controls.n_controls());
        if !frames.fits(columns) {
            let reason = "the frames beside the weights name controls that do not exist".to_owned();
            return Err(GpuError::Model { reason });
        }
        check_size(&weights, rows, columns + frames.n_columns())?;
        self.bound(Coordinates::Harmonic, weights, frames, None).await
    }

    fn parts(&self) -> Result<(&Arc<DrawModel>, Controls<'_>), GpuError> {
        match (&self.model, &self.controls) {
            (Some(model), Some(controls)) => Ok((model, controls.into())),
            (None, _) => Err(GpuError::NotReady { missing: "model" }),
            (_, None) => Err(GpuError::NotReady { missing: "cage" }),
        }
    }

    async fn bound(
        &mut self,
        kind: Coordinates,
        weights: Arc<Weights>,
        frames: Arc<Frames>,
        on_gpu: Option<GpuWeights>,
    ) -> Result<(), GpuError> {
        let (model, _) = self.parts()?;
        let mover = Mover::new(&self.context, model, &weights, &frames, on_gpu).await?;
        mover.pose(&self.context, &self.columns(kind, &self.pose));
        self.renderer.set_vertices(&self.context, Some(mover.tables()));
        self.playing = None;
        self.bound = Some(SessionBind { kind, weights, frames, mover, parts: None });
        self.hold().await?;
        self.write_values();
        Ok(())
    }

    fn drop_weights(&mut self) {
        self.playing = None;
        self.bound = None;
        self.renderer.set_vertices(&self.context, None);
    }

    /// The weights, if bound.
    #[must_use]
    pub fn weights(&self) -> Option<&Weights> {
        self.bound.as_ref().map(|b| b.weights.as_ref())
    }

    /// Coordinate frames that define the columns of the weights after those of the controls; `None` before a bind.
    #[must_use]
    pub fn frames(&self) -> Option<&Frames> {
        self.bound.as_ref().map(|b| b.frames.as_ref())
    }

    /// Sets the positions of the controls for the next frame. Uploads only them and, after a bind, the columns computed
    /// from them.
    ///
    /// # Panics
    /// If the number of positions differs from the number of controls.
    pub fn pose(&mut self, cage_positions: &[Vec3]) {
        assert_eq!(cage_positions.len(), self.pose.len(), "one position per control");
        self.pose.copy_from_slice(cage_positions);
        self.renderer.pose(&self.context, cage_positions);
        if let Some(bound) = &self.bound {
            bound.mover.pose(&self.context, &self.columns(bound.kind, cage_positions));
            self.moved = true;
        }
    }

    /// Sets the indices of the floaters, which are the splats outside the cage.
    pub fn set_floaters(&mut self, floaters: &[u32]) {
        self.renderer.set_floaters(&self.context, floaters);
    }

    /// Sets the field that deforms the splats; `None` for splats at rest. `pose`: positions of the controls.
    pub fn set_field(&mut self, field: Option<Field>, pose: &[Vec3]) {
        let posed = Bounds::around(pose).or_else(|| self.bounds());
        self.renderer.set_field(&self.context, field.zip(posed));
    }

    /// Draws the cage at other positions without deforming the mesh, for editing the rest cage.
    ///
    /// # Panics
    /// If the number of positions differs from the number of controls.
    pub fn show_cage(&mut self, cage_positions: &[Vec3]) {
        assert_eq!(cage_positions.len(), self.pose.len(), "one position per control");
        self.renderer.pose(&self.context, cage_positions);
    }

    /// Current pose of the controls. `[n_controls]`, object units.
    #[must_use]
    pub fn cage_positions(&self) -> &[Vec3] {
        &self.pose
    }

    /// Sets the scene to draw.
    pub fn set_scene(&mut self, scene: SceneOptions) {
        let is_other = |a: &SceneOptions, b: &SceneOptions| {
            (a.mesh, a.view.weights_to_one) != (b.mesh, b.view.weights_to_one)
                || a.greyed.as_ref().map(Arc::as_ptr) != b.greyed.as_ref().map(Arc::as_ptr)
        };
        let other_values = is_other(&scene, &self.scene);
        self.scene = scene;
        self.write_scene();
        if other_values {
            self.write_values();
        }
    }

    /// Options of the scene that frames show.
    #[must_use]
    pub fn scene(&self) -> &SceneOptions {
        &self.scene
    }

    fn write_scene(&mut self) {
        self.renderer.set_scene(&self.context, self.scene.clone(), self.model.as_deref());
    }

    /// Uploads the value of each vertex for the scene's heat map or greying. Heat maps need weights.
    fn write_values(&mut self) {
        let is_plain = matches!(self.scene.mesh, MeshStyle::Solid | MeshStyle::Clay);
        if let (true, Some(greyed), Some(model)) = (is_plain, &self.scene.greyed, &self.model) {
            if greyed.len() == model.positions.len() {
                self.renderer.set_values(&self.context, &model.with_copies(greyed), [0.0, 1.0]);
            }
            return;
        }
        let Some(range) = self.value_range() else { return };
        let (Some(model), Some(bound), Some(set)) = (&self.model, &self.bound, &self.controls) else {
            return;
        };
        let values: Vec<f32> = match self.scene.mesh {
            MeshStyle::Weights { column } => bound.weights.column(column).collect(),
            MeshStyle::Errors => {
                let at_rest = self.columns(bound.kind, Controls::from(set).rest());
                let rebuilt = deform_bound(&bound.weights, &bound.frames, &at_rest);
                let scale = 1.0 / set.cage().diagonal();
                rebuilt.iter().zip(&model.positions).map(|(a, b)| scale * a.distance(*b)).collect()
            }
            MeshStyle::Hidden | MeshStyle::Solid | MeshStyle::Clay => return,
        };
        self.renderer.set_values(&self.context, &model.with_copies(&values), range);
    }

    /// Values of the first and last colour of the heat map, for a legend: weights, or log10(error / cage
    /// diagonal). `None` without a heat map or weights.
    #[must_use]
    pub fn value_range(&self) -> Option<[f32; 2]> {
        let weights = self.weights()?;
        match self.scene.mesh {
            MeshStyle::Weights { .. } if self.scene.view.weights_to_one => Some([0.0, 1.0]),
            MeshStyle::Weights { column } => {
                Some([0.0, weights.column(column).fold(colormap::MIN_WEIGHT_RANGE, f32::max)])
            }
            MeshStyle::Errors => Some(colormap::ERROR_RANGE),
            MeshStyle::Hidden | MeshStyle::Solid | MeshStyle::Clay => None,
        }
    }

    /// The camera. Its unit of length in the picture is the CSS pixel of the last drawn frame.
    #[must_use]
    pub fn camera(&self) -> &Camera {
        &self.camera
    }

    /// Mutable access to the camera, to change the view.
    pub fn camera_mut(&mut self) -> &mut Camera {
        &mut self.camera
    }

    /// Bounds of model and cage at rest, if any.
    #[must_use]
    pub fn bounds(&self) -> Option<Bounds> {
        let model = self.model.as_ref().and_then(|m| Bounds::around(&m.positions));
        let cage = self.cage().map(Cage::bounds);
        match (model, cage) {
            (Some(a), Some(b)) => Some(Bounds { min: a.min.min(b.min), max: a.max.max(b.max) }),
            (one, other) => one.or(other),
        }
    }

    /// Fits model and cage into the picture.
    pub fn frame_all(&mut self) {
        if let Some(bounds) = self.bounds() {
            self.camera.frame(bounds);
        }
    }

    /// Puts the floor below `bounds` and sets the camera's depth range to contain them, until a model or cage is set.
    pub fn set_floor(&mut self, bounds: Bounds) {
        self.camera.set_scene(bounds);
        self.renderer.set_bounds(bounds);
    }

    fn update_bounds(&mut self) {
        if let Some(bounds) = self.bounds() {
            self.camera.set_scene(bounds);
            // The floor is below the model, not the cage.
            let model = self.model.as_ref().and_then(|m| Bounds::around(&m.positions));
            self.renderer.set_bounds(model.unwrap_or(bounds));
        }
    }

    /// Draws a frame into `target`, a view of `format` and `size` (pixels), with `scale` pixels per CSS
    /// pixel. First deforms the mesh if pose, skin or parts changed. Submits without waiting. Formats: see
    /// [`crate::render`]. In browsers, a software rasteriser draws one sample per pixel: with four, a frame of 57,000
    /// triangles takes SwiftShader 370 ms of processor time, not 90 ms.
    ///
    /// # Errors
    /// [`GpuError::DeviceLost`], [`GpuError::Refused`]: errors since the last call.
    pub fn frame(
        &mut self,
        target: &wgpu::TextureView,
        format: wgpu::TextureFormat,
        size: [u32; 2],
        scale: f32,
    ) -> Result<(), GpuError> {
        self.context.check()?;
        // A canvas that is collapsed on the page has no area.
        if size.contains(&0) {
            return Ok(());
        }
        self.camera.set_viewport(Vec2::from(size.map(|s| s as f32)) / scale);
        let camera = self.camera;
        let mut encoder = self.encoder();
        let is_software_in_browser = cfg!(target_family = "wasm") && self.context.is_software();
        let samples = if is_software_in_browser { 1 } else { MAX_SAMPLES };
        self.encode(&mut encoder, Target { view: target, format, size, samples, scale }, &camera);
        self.context.queue.submit([encoder.finish()]);
        Ok(())
    }

    fn encoder(&self) -> wgpu::CommandEncoder {
        self.context.device.create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some("frame") })
    }

    fn encode(&mut self, encoder: &mut wgpu::CommandEncoder, target: Target<'_>, camera: &Camera) {
        self.encode_deformation(encoder);
        self.renderer.draw(&self.context, encoder, target, camera);
    }

    fn encode_deformation(&mut self, encoder: &mut wgpu::CommandEncoder) {
        if let Some(bound) = self.bound.as_ref().filter(|_| self.moved) {
            match self.playing.as_ref().filter(|_| !self.interrupted) {
                Some(skinner) => bound.mover.encode_skinned(&self.context, encoder, skinner),
                None => {
                    let positions = || self.deformed(&self.pose).unwrap_or_default();
                    bound.mover.encode(&self.context, encoder, positions);
                }
            }
            self.moved = false;
            self.renderer.touch_shadow();
        }
    }

    /// Current positions of the mesh, `[n_vertices]`, object units: deformed if bound, else at rest.
    ///
    /// # Errors
    /// [`GpuError::NotReady`] without a model; [`GpuError::OutOfMemory`], [`GpuError::DeviceLost`],
    /// [`GpuError::Refused`].
    pub async fn read_positions(&self) -> Result<Vec<Vec3>, GpuError> {
        let Some(model) = &self.model else { return Err(GpuError::NotReady { missing: "model" }) };
        match &self.bound {
            Some(bound) => {
                let by_processor = || self.deformed(&self.pose).unwrap_or_default();
                let mut positions = bound.mover.read_positions(&self.context, by_processor).await?;
                // Drop the copies of vertices, which are stored after the vertices.
                positions.truncate(model.positions.len());
                Ok(positions)
            }
            None => Ok(model.positions.clone()),
        }
    }
}
