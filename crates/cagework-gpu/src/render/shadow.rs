//! Map of the model's shadow on the floor.

use super::pipelines::{Layouts, SHADOW_FORMAT};
use crate::device::GpuContext;

/// Number of pixels along a side of the map. The floor interpolates the map by cubic splines, which blur it over about
/// two pixels.
const SIDE: u32 = 96;

#[derive(Debug)]
pub(super) struct ShadowMap {
    pub(super) view: wgpu::TextureView,
    /// Bind group with which the floor reads the map.
    pub(super) group: wgpu::BindGroup,
    /// Whether the model has moved since the map was drawn.
    pub(super) is_stale: bool,
}

impl ShadowMap {
    pub(super) fn new(context: &GpuContext, layouts: &Layouts) -> Self {
        let sampled = wgpu::TextureUsages::TEXTURE_BINDING;
        let texture = context.target("shadow", [SIDE; 2], 1, SHADOW_FORMAT, sampled);
        let view = texture.create_view(&wgpu::TextureViewDescriptor::default());
        let sampler = context.device.create_sampler(&wgpu::SamplerDescriptor {
            label: Some("shadow"),
            mag_filter: wgpu::FilterMode::Linear,
            min_filter: wgpu::FilterMode::Linear,
            ..wgpu::SamplerDescriptor::default()
        });
        let group = context.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("shadow"),
            layout: &layouts.floor,
            entries: &[
                wgpu::BindGroupEntry { binding: 0, resource: wgpu::BindingResource::TextureView(&view) },
                wgpu::BindGroupEntry { binding: 1, resource: wgpu::BindingResource::Sampler(&sampler) },
            ],
        });
        Self { view, group, is_stale: true }
    }

    /// Starts a pass that draws the map.
    pub(super) fn pass<'a>(&self, encoder: &'a mut wgpu::CommandEncoder) -> wgpu::RenderPass<'a> {
        encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("shadow"),
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: &self.view,
                depth_slice: None,
                resolve_target: None,
                ops: wgpu::Operations {
                    load: wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT),
                    store: wgpu::StoreOp::Store,
                },
            })],
            ..wgpu::RenderPassDescriptor::default()
        })
    }
}
