//! Composes pictures on a WebGL2 canvas by drawing them, because textures cannot be copied to such a canvas.

use super::pipelines::layout_of;
use super::shaders::PART;
use crate::device::GpuContext;

/// Pipeline that draws textures side by side.
#[derive(Debug)]
pub struct PartPainter {
    layout: wgpu::BindGroupLayout,
    pipeline: wgpu::RenderPipeline,
}

impl PartPainter {
    /// Creates the pipeline. `format`: format of the targets.
    #[must_use]
    pub fn new(context: &GpuContext, format: wgpu::TextureFormat) -> Self {
        let device = &context.device;
        let layout = layout_of(context, PART.name, PART.groups[0]);
        let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some(PART.name),
            source: wgpu::ShaderSource::Wgsl(PART.source(context).into()),
        });
        let pipeline_layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some(PART.name),
            // Group 0 is the camera, which this shader does not use.
            bind_group_layouts: &[None, Some(&layout)],
            immediate_size: 0,
        });
        let pipeline = device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: Some(PART.name),
            layout: Some(&pipeline_layout),
            vertex: wgpu::VertexState {
                module: &module,
                entry_point: Some("vertex"),
                compilation_options: wgpu::PipelineCompilationOptions::default(),
                buffers: &[],
            },
            primitive: wgpu::PrimitiveState::default(),
            depth_stencil: None,
            multisample: wgpu::MultisampleState::default(),
            fragment: Some(wgpu::FragmentState {
                module: &module,
                entry_point: Some("fragment"),
                compilation_options: wgpu::PipelineCompilationOptions::default(),
                targets: &[Some(format.into())],
            }),
            multiview_mask: None,
            cache: None,
        });
        Self { layout, pipeline }
    }

    /// Records the drawing of textures into `target`, each at a horizontal offset in pixels. All other pixels are
    /// cleared to black.
    pub fn paint(
        &self,
        context: &GpuContext,
        encoder: &mut wgpu::CommandEncoder,
        target: &wgpu::TextureView,
        parts: &[(u32, &wgpu::Texture)],
    ) {
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("parts"),
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: target,
                depth_slice: None,
                resolve_target: None,
                ops: wgpu::Operations {
                    load: wgpu::LoadOp::Clear(wgpu::Color::BLACK),
                    store: wgpu::StoreOp::Store,
                },
            })],
            ..wgpu::RenderPassDescriptor::default()
        });
        pass.set_pipeline(&self.pipeline);
        for (left, picture) in parts {
            let view = picture.create_view(&wgpu::TextureViewDescriptor::default());
            let group = context.device.create_bind_group(&wgpu::BindGroupDescriptor {
                label: Some(PART.name),
                layout: &self.layout,
                entries: &[wgpu::BindGroupEntry {
                    binding: 0,
                    resource: wgpu::BindingResource::TextureView(&view),
                }],
            });
            pass.set_bind_group(1, &group, &[]);
            pass.set_viewport(*left as f32, 0.0, picture.width() as f32, picture.height() as f32, 0.0, 1.0);
            pass.draw(0..3, 0..1);
        }
    }
}
