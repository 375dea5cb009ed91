//! Draws a frame.

use std::sync::Arc;

use cagework_core::field::Field;
use cagework_core::{Bounds, Controls};
use glam::Vec3;

use super::cage::CageView;
use super::camera::{Camera, Projection};
use super::gizmo::GizmoShape;
use super::layout::Camera as Uniform;
use super::marks::{MarksView, Wires};
use super::mesh::Mesh;
use super::model::DrawModel;
use super::pipelines::{DEPTH_FORMAT, Kind, Layouts, Pipelines};
use super::scene::{MeshStyle, SceneOptions};
use super::shadow::ShadowMap;
use super::slice::SlicePlane;
use super::splats::SplatLayer;
use super::theme::linear;
use crate::device::GpuContext;
use crate::error::GpuError;
use crate::table::Table;

/// Radius of the floor, as a multiple of the scene's radius.
const FLOOR_REACH: f32 = 5.0;

/// Depth range of the gizmo: in front of everything, with depth tests within the gizmo.
const GIZMO_DEPTHS: [f32; 2] = [0.0, 1e-3];

/// Largest number of samples per pixel. WebGPU supports 1 and 4.
pub(crate) const MAX_SAMPLES: u32 = 4;

/// Render target of a frame.
#[derive(Clone, Copy, Debug)]
pub struct Target<'a> {
    /// View to draw into.
    pub view: &'a wgpu::TextureView,
    /// Format of the view.
    pub format: wgpu::TextureFormat,
    /// Width and height, pixels.
    pub size: [u32; 2],
    /// Number of samples per pixel: 1 or 4.
    pub samples: u32,
    /// Pixels per CSS pixel.
    pub scale: f32,
}

/// Attachments of a frame.
#[derive(Debug)]
struct Targets {
    format: wgpu::TextureFormat,
    size: [u32; 2],
    samples: u32,
    /// Colours of several samples per pixel; none if the frame is drawn with one sample.
    color: Option<wgpu::Texture>,
    depth: wgpu::Texture,
}

impl Drop for Targets {
    /// Frees memory immediately, not at garbage collection: adaptive resolution changes the size often.
    fn drop(&mut self) {
        self.color.iter().for_each(wgpu::Texture::destroy);
        self.depth.destroy();
    }
}

/// Draws the scene.
#[derive(Debug)]
pub struct Renderer {
    layouts: Arc<Layouts>,
    pipelines: Vec<Pipelines>,
    camera: wgpu::Buffer,
    camera_group: wgpu::BindGroup,
    targets: Option<Targets>,
    mesh: Option<Mesh>,
    splats: Option<SplatLayer>,
    wires: Option<Wires>,
    cage: Option<CageView>,
    slice: Option<SlicePlane>,
    /// Marks of problems, grabbed points and joints, topmost last.
    marks: Vec<MarksView>,
    gizmo: GizmoShape,
    shadow: ShadowMap,
    scene: SceneOptions,
    floor: Bounds,
    /// Values of the first and last colour of the heat map.
    range: [f32; 2],
}

impl Renderer {
    pub(crate) fn new(context: &GpuContext) -> Self {
        let layouts = Arc::new(Layouts::new(context));
        let camera = context.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("camera"),
            size: size_of::<Uniform>() as u64,
            usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let camera_group = context.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("camera"),
            layout: &layouts.camera,
            entries: &[wgpu::BindGroupEntry { binding: 0, resource: camera.as_entire_binding() }],
        });
        Self {
            gizmo: GizmoShape::new(context, &layouts),
            shadow: ShadowMap::new(context, &layouts),
            layouts,
            pipelines: Vec::new(),
            camera,
            camera_group,
            targets: None,
            mesh: None,
            splats: None,
            wires: None,
            cage: None,
            slice: None,
            marks: Vec::new(),
            scene: SceneOptions::default(),
            floor: Bounds { min: Vec3::splat(-1.0), max: Vec3::ONE },
            range: [0.0, 1.0],
        }
    }

    /// Sets the model at rest. `normals`: normals of the model's vertices.
    pub(crate) async fn set_model(
        &mut self,
        context: &GpuContext,
        model: &DrawModel,
        normals: &[Vec3],
    ) -> Result<(), GpuError> {
        let padded: Vec<[f32; 4]> = normals.iter().map(|n| n.extend(0.0).to_array()).collect();
        self.wires = None;
        self.splats = match &model.splats {
            Some(splats) => Some(SplatLayer::new(context, &self.layouts, splats).await?),
            None => None,
        };
        self.touch_shadow();
        self.mesh = Some(Mesh::new(context, &self.layouts, model, &padded).await?);
        self.apply(context, Some(model), None);
        Ok(())
    }

    /// Sets the cage, in its rest pose.
    pub(crate) async fn set_cage(
        &mut self,
        context: &GpuContext,
        controls: Controls<'_>,
    ) -> Result<(), GpuError> {
        self.cage = Some(CageView::new(context, &self.layouts, controls).await?);
        self.apply(context, None, None);
        Ok(())
    }

    /// Sets the tables of positions and normals; `None` for the rest pose.
    pub(crate) fn set_vertices(&mut self, context: &GpuContext, tables: Option<[&Table; 2]>) {
        self.shadow.is_stale = true;
        let Some(mesh) = &mut self.mesh else { return };
        match tables {
            Some([positions, normals]) => mesh.set_vertices(context, &self.layouts, positions, normals),
            None => mesh.set_rest(context, &self.layouts),
        }
        if let Some(wires) = &mut self.wires {
            wires.edges.set_positions(context, &self.layouts, &mesh.positions);
        }
        self.make_marks(context);
    }

    /// Uploads the positions of the controls, if there is a cage.
    pub(crate) fn pose(&self, context: &GpuContext, positions: &[Vec3]) {
        if let Some(cage) = &self.cage {
            cage.pose(context, positions);
        }
    }

    /// Sets the indices of the floaters, splats that the scene options can hide.
    pub(crate) fn set_floaters(&mut self, context: &GpuContext, floaters: &[u32]) {
        if let Some(splats) = &mut self.splats {
            splats.mover.set_floaters(context, floaters);
            splats.drawn = None;
        }
    }

    /// Sets the field that deforms the splats, and the bounds of the posed cage; `None` for the rest pose.
    pub(crate) fn set_field(&mut self, context: &GpuContext, field: Option<(Field, Bounds)>) {
        if let Some(splats) = &mut self.splats {
            splats.mover.set_field(context, field);
            splats.drawn = None;
        }
    }

    /// Uploads a value per vertex for the heat map. `range`: values of the first and last colour.
    pub(crate) fn set_values(&mut self, context: &GpuContext, values: &[f32], range: [f32; 2]) {
        let Some(mesh) = self.mesh.as_ref().filter(|_| !values.is_empty()) else { return };
        debug_assert_eq!(values.len(), mesh.n_vertices as usize, "one value per vertex");
        mesh.values.write(context, bytemuck::cast_slice(values));
        self.range = range;
        mesh.set_style(context, self.scene.mesh, range, self.scene.overlay());
    }

    /// Makes the next frame draw the shadow map again, because the model has moved.
    pub(crate) fn touch_shadow(&mut self) {
        self.shadow.is_stale = true;
    }

    /// Sets the bounds of the model at rest, which determine the position and size of the floor.
    pub(crate) fn set_bounds(&mut self, bounds: Bounds) {
        self.touch_shadow();
        self.floor = bounds;
    }

    /// Replaces the scene options, and updates what depends on options that changed.
    pub(crate) fn set_scene(&mut self, context: &GpuContext, scene: SceneOptions, model: Option<&DrawModel>) {
        let before = std::mem::replace(&mut self.scene, scene);
        self.apply(context, model, Some(&before));
    }

    /// Applies the members of the scene that differ from `before`; all members if `before` is `None`.
    fn apply(&mut self, context: &GpuContext, model: Option<&DrawModel>, before: Option<&SceneOptions>) {
        let scene = &self.scene;
        let theme_changed = before.is_none_or(|b| b.view.theme != scene.view.theme);
        if let Some(cage) = &mut self.cage {
            let steps = before.is_none_or(|b| b.cage_faint != scene.cage_faint);
            if theme_changed || steps {
                cage.set_theme(context, scene.view.theme, scene.cage_faint);
            }
            if steps || before.is_none_or(|b| b.selection != scene.selection) {
                cage.select(context, &self.layouts, &scene.selection, scene.cage_faint);
            }
        }
        if let Some(mesh) = &self.mesh {
            if before.is_none_or(|b| b.mesh != scene.mesh || b.overlay() != scene.overlay()) {
                mesh.set_style(context, scene.mesh, self.range, scene.overlay());
                self.shadow.is_stale = true;
            }
            if before.is_none_or(|b| b.hidden != scene.hidden) {
                self.wires = None;
                self.shadow.is_stale = true;
            }
            if (scene.view.base_wireframe || scene.mesh_edges)
                && self.wires.is_none()
                && let Some(model) = model
            {
                let wires = Wires::new(context, &self.layouts, mesh, model, &scene.hidden);
                wires.set_theme(context, scene.view.theme);
                self.wires = Some(wires);
            }
        }
        if let Some(wires) = self.wires.as_ref().filter(|_| theme_changed) {
            wires.set_theme(context, scene.view.theme);
        }
        if theme_changed || before.is_none_or(|b| b.slice != scene.slice) {
            self.slice =
                scene.slice.as_ref().map(|s| SlicePlane::new(context, &self.layouts, s, scene.view.theme));
        }
        let is_same = |b: &SceneOptions| {
            (&b.marks, &b.held, &b.joints, &b.draft)
                == (&scene.marks, &scene.held, &scene.joints, &scene.draft)
        };
        if theme_changed || !before.is_some_and(is_same) {
            self.make_marks(context);
        }
    }

    fn make_marks(&mut self, context: &GpuContext) {
        let mesh = self.mesh.as_ref().map(|m| &m.positions);
        let cage = self.cage.as_ref().map(|c| &c.positions);
        self.marks = MarksView::all(context, &self.layouts, &self.scene, mesh, cage);
    }

    /// Records the commands that draw a frame.
    pub(crate) fn draw(
        &mut self,
        context: &GpuContext,
        encoder: &mut wgpu::CommandEncoder,
        target: Target<'_>,
        camera: &Camera,
    ) {
        let Target { view, format, size, samples, .. } = target;
        let uniform = self.uniform(target, camera);
        context.queue.write_buffer(&self.camera, 0, bytemuck::bytes_of(&uniform));
        if let Some(gizmo) = &self.scene.gizmo {
            self.gizmo.update(context, gizmo, camera);
        }
        let is_for_target = |p: &Pipelines| (p.format, p.samples) == (format, samples);
        if !self.pipelines.iter().any(is_for_target) {
            self.pipelines.push(Pipelines::new(context, &self.layouts, format, samples));
        }
        if self.targets.as_ref().is_none_or(|t| (t.format, t.size, t.samples) != (format, size, samples)) {
            self.targets = Some(Targets::new(context, format, size, samples));
        }
        let (Some(targets), Some(pipelines)) =
            (&self.targets, self.pipelines.iter().find(|p| is_for_target(p)))
        else {
            return;
        };
        if let Some(splats) = self.splats.as_mut().filter(|_| self.scene.mesh == MeshStyle::Solid) {
            let pipeline = pipelines.get(Kind::Splats);
            let hides = !self.scene.view.floaters;
            splats.encode(context, &self.layouts, encoder, pipeline, &self.camera_group, &uniform, hides);
        }
        if self.shadow.is_stale && self.scene.view.floor {
            let mut pass = self.shadow.pass(encoder);
            if let Some(mesh) = self.mesh.as_ref().filter(|_| self.scene.mesh != MeshStyle::Hidden) {
                pass.set_bind_group(0, &self.camera_group, &[]);
                pass.set_pipeline(pipelines.get(Kind::Shadow));
                mesh.draw_plain(&mut pass, &self.scene.hidden);
            }
            self.shadow.is_stale = false;
        }
        let view_of = |texture: &wgpu::Texture| texture.create_view(&wgpu::TextureViewDescriptor::default());
        let (color, depth) = (targets.color.as_ref().map(view_of), view_of(&targets.depth));
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("picture"),
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: color.as_ref().unwrap_or(view),
                depth_slice: None,
                resolve_target: color.as_ref().map(|_| view),
                ops: wgpu::Operations {
                    load: wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT),
                    // Of several samples only the resolved picture is needed.
                    store: if color.is_some() { wgpu::StoreOp::Discard } else { wgpu::StoreOp::Store },
                },
            })],
            depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                view: &depth,
                depth_ops: Some(wgpu::Operations {
                    load: wgpu::LoadOp::Clear(1.0),
                    store: wgpu::StoreOp::Discard,
                }),
                stencil_ops: None,
            }),
            ..wgpu::RenderPassDescriptor::default()
        });
        pass.set_bind_group(0, &self.camera_group, &[]);
        self.draw_model(&mut pass, pipelines);
        self.draw_over(&mut pass, pipelines);
        if self.scene.gizmo.is_some() {
            let [near, far] = GIZMO_DEPTHS;
            pass.set_viewport(0.0, 0.0, size[0] as f32, size[1] as f32, near, far);
            pass.set_pipeline(pipelines.get(Kind::Gizmo));
            self.gizmo.draw(&mut pass);
        }
    }

    fn draw_model(&self, pass: &mut wgpu::RenderPass<'_>, pipelines: &Pipelines) {
        let scene = &self.scene;
        if scene.backdrop {
            pass.set_pipeline(pipelines.get(Kind::Background));
            pass.draw(0..3, 0..1);
        }
        let floor = |pass: &mut wgpu::RenderPass<'_>| {
            if scene.view.floor {
                pass.set_pipeline(pipelines.get(Kind::Floor));
                pass.set_bind_group(1, &self.shadow.group, &[]);
                pass.draw(0..6, 0..1);
            }
        };
        let mesh = self.mesh.as_ref().filter(|_| scene.mesh != MeshStyle::Hidden);
        let splats = self.splats.as_ref().filter(|_| scene.mesh == MeshStyle::Solid);
        if let Some(splats) = splats {
            floor(pass);
            pass.set_pipeline(pipelines.get(Kind::Layer));
            splats.draw(pass);
        }
        if let Some(mesh) = mesh {
            pass.set_pipeline(pipelines.get(if splats.is_some() { Kind::MeshDepth } else { Kind::Mesh }));
            mesh.draw(pass, scene.mesh, false, &scene.hidden);
        }
        if let Some(slice) = &self.slice {
            pass.set_pipeline(pipelines.get(Kind::Slice));
            slice.draw(pass);
        }
        if let Some(mesh) = mesh {
            pass.set_pipeline(pipelines.get(Kind::MeshBlended));
            mesh.draw(pass, scene.mesh, true, &scene.hidden);
        }
        if splats.is_none() {
            floor(pass);
        }
        if let Some(wires) = &self.wires {
            pass.set_pipeline(pipelines.get(Kind::Lines));
            if scene.mesh_edges && mesh.is_some() {
                wires.edges.draw(pass, false);
            }
            if scene.view.base_wireframe {
                wires.base.draw(pass, false);
            }
        }
    }

    fn draw_over(&self, pass: &mut wgpu::RenderPass<'_>, pipelines: &Pipelines) {
        if let Some(cage) = &self.cage {
            if self.scene.cage_lines {
                pass.set_pipeline(pipelines.get(Kind::Faces));
                cage.faces.draw_faces(pass);
                for (behind, kind) in [(true, Kind::LinesBehind), (false, Kind::Lines)] {
                    pass.set_pipeline(pipelines.get(kind));
                    for lines in cage.all_lines() {
                        lines.draw(pass, behind);
                    }
                }
            }
            if self.scene.handles {
                for (behind, kind) in [(true, Kind::PointsBehind), (false, Kind::Points)] {
                    pass.set_pipeline(pipelines.get(kind));
                    cage.inner.draw(pass, behind);
                    cage.handles.draw(pass, behind);
                }
            }
        }
        for marks in &self.marks {
            for (behind, [lines, points]) in
                [(true, [Kind::LinesBehind, Kind::PointsBehind]), (false, [Kind::Lines, Kind::Points])]
            {
                if let Some(segments) = &marks.segments {
                    pass.set_pipeline(pipelines.get(lines));
                    segments.draw(pass, behind);
                }
                for overlay in &marks.points {
                    pass.set_pipeline(pipelines.get(points));
                    overlay.draw(pass, behind);
                }
            }
        }
    }

    fn uniform(&self, target: Target<'_>, camera: &Camera) -> Uniform {
        let Target { format, size, scale, .. } = target;
        let palette = self.scene.view.theme.palette();
        let viewport = size.map(|s| s as f32);
        let radius = (0.5 * self.floor.diagonal()).max(f32::MIN_POSITIVE);
        let middle = self.floor.center().with_y(self.floor.min.y + self.scene.floor_height);
        Uniform {
            clip_from_world: camera.clip_from_world().to_cols_array_2d(),
            view_from_world: camera.view_from_world().to_cols_array_2d(),
            eye: camera.eye().to_array(),
            perspective: f32::from(u8::from(camera.projection == Projection::Perspective)),
            viewport,
            scale,
            encode: u32::from(!format.is_srgb()),
            background_top: linear(palette.background_top),
            background_bottom: linear(palette.background_bottom),
            floor_color: linear(palette.floor),
            floor_center: middle.to_array(),
            floor_radius: FLOOR_REACH * radius,
            floor_spacing: 10f32.powf((0.15 * radius).log10().round()),
            lift: camera.lift(),
            pixel: viewport.map(|s| 2.0 / s),
        }
    }
}

impl Targets {
    fn new(context: &GpuContext, format: wgpu::TextureFormat, size: [u32; 2], samples: u32) -> Self {
        let texture =
            |label, format| context.target(label, size, samples, format, wgpu::TextureUsages::empty());
        let color = (samples > 1).then(|| texture("samples", format));
        Self { format, size, samples, color, depth: texture("depth", DEPTH_FORMAT) }
    }
}
