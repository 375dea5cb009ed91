//! Draws Gaussian splats into a layer of their own. The layer is kept until pose, camera or size change.
//!
//! The layer has one sample per pixel, and its colours are blended in sRGB, as in the optimisation that produces
//! captures.

use cagework_core::splats::Splats;
use glam::Vec3;

use super::layout::Camera;
use super::pipelines::{LAYER_FORMAT, Layouts};
use crate::device::GpuContext;
use crate::error::GpuError;
use crate::splats::SplatMover;

/// Splats, and the layer that they are drawn into.
#[derive(Debug)]
pub(super) struct SplatLayer {
    pub(super) mover: SplatMover,
    group: wgpu::BindGroup,
    layer: Option<Layer>,
    /// Camera that the layer was drawn for, and whether floaters were hidden; `None` if the splats have moved since.
    pub(super) drawn: Option<(Camera, bool)>,
}

#[derive(Debug)]
struct Layer {
    texture: wgpu::Texture,
    group: wgpu::BindGroup,
}

impl Drop for Layer {
    /// Frees memory immediately: adaptive resolution changes the size often.
    fn drop(&mut self) {
        self.texture.destroy();
    }
}

impl SplatLayer {
    pub(super) async fn new(
        context: &GpuContext,
        layouts: &Layouts,
        splats: &Splats,
    ) -> Result<Self, GpuError> {
        let mover = SplatMover::new(context, splats).await?;
        let group = context.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("splats"),
            layout: &layouts.splats,
            entries: &[
                wgpu::BindGroupEntry { binding: 0, resource: mover.splats.resource() },
                wgpu::BindGroupEntry { binding: 1, resource: mover.order.resource() },
            ],
        });
        Ok(Self { mover, group, layer: None, drawn: None })
    }

    /// Records the drawing of the layer, unless it is up to date.
    #[expect(clippy::too_many_arguments, reason = "all belong to the renderer")]
    pub(super) fn encode(
        &mut self,
        context: &GpuContext,
        layouts: &Layouts,
        encoder: &mut wgpu::CommandEncoder,
        pipeline: &wgpu::RenderPipeline,
        camera_group: &wgpu::BindGroup,
        camera: &Camera,
        hides: bool,
    ) {
        // Ignore the theme's colours, which do not affect the layer.
        let view = Camera {
            background_top: [0.0; 4],
            background_bottom: [0.0; 4],
            floor_color: [0.0; 4],
            ..*camera
        };
        if self.drawn == Some((view, hides)) {
            return;
        }
        let [width, height] = camera.viewport.map(|side| side as u32);
        if self.layer.as_ref().is_none_or(|l| [l.texture.width(), l.texture.height()] != [width, height]) {
            self.layer = Some(Layer::new(context, layouts, width, height));
        }
        let Some(layer) = &self.layer else { return };
        let [x, y, z, _] = camera.view_from_world.map(|column| column[2]);
        let backward = Vec3::new(x, y, z);
        let viewer = if camera.perspective > 0.0 { Vec3::from(camera.eye) } else { backward };
        self.mover.encode(context, encoder, backward, viewer.extend(camera.perspective).to_array(), hides);
        let target = layer.texture.create_view(&wgpu::TextureViewDescriptor::default());
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("splats"),
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: &target,
                depth_slice: None,
                resolve_target: None,
                ops: wgpu::Operations {
                    load: wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT),
                    store: wgpu::StoreOp::Store,
                },
            })],
            ..wgpu::RenderPassDescriptor::default()
        });
        pass.set_bind_group(0, camera_group, &[]);
        pass.set_bind_group(1, &self.group, &[]);
        pass.set_pipeline(pipeline);
        // One instance of many vertices: see `Overlay::draw_vertices`.
        pass.draw(0..6 * self.mover.len() as u32, 0..1);
        self.drawn = Some((view, hides));
    }

    /// Draws the layer into the picture.
    pub(super) fn draw(&self, pass: &mut wgpu::RenderPass<'_>) {
        if let Some(layer) = &self.layer {
            pass.set_bind_group(1, &layer.group, &[]);
            pass.draw(0..3, 0..1);
        }
    }
}

impl Layer {
    fn new(context: &GpuContext, layouts: &Layouts, width: u32, height: u32) -> Self {
        let sampled = wgpu::TextureUsages::TEXTURE_BINDING;
        let texture = context.target("layer of splats", [width, height], 1, LAYER_FORMAT, sampled);
        let view = texture.create_view(&wgpu::TextureViewDescriptor::default());
        let group = context.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("layer of splats"),
            layout: &layouts.layer,
            entries: &[wgpu::BindGroupEntry {
                binding: 0,
                resource: wgpu::BindingResource::TextureView(&view),
            }],
        });
        Self { texture, group }
    }
}
