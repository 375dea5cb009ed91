//! Render pipelines, per target format.

use std::sync::{Arc, OnceLock};

use wgpu::{BlendState, CompareFunction, PrimitiveTopology};

use super::model::DrawVertex;
use super::shaders::{self, DrawBinding, DrawShader};
use crate::device::GpuContext;

/// Depth format: 32-bit floats, which separate even distant handles from the cage's faces.
pub(super) const DEPTH_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Depth32Float;

/// Format of the layer of splats. Its sRGB values are blended without conversion to linear values.
pub(super) const LAYER_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8Unorm;
/// Format of the shadow map.
pub(super) const SHADOW_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::R8Unorm;

/// Blending that keeps the larger of the old and the new value.
const MAXIMUM: wgpu::BlendComponent = wgpu::BlendComponent {
    src_factor: wgpu::BlendFactor::One,
    dst_factor: wgpu::BlendFactor::One,
    operation: wgpu::BlendOperation::Max,
};

/// Bind group layouts, which do not depend on the target's format.
#[derive(Debug)]
pub(super) struct Layouts {
    pub(super) camera: wgpu::BindGroupLayout,
    pub(super) vertices: wgpu::BindGroupLayout,
    pub(super) material: wgpu::BindGroupLayout,
    pub(super) overlay: wgpu::BindGroupLayout,
    pub(super) slice: wgpu::BindGroupLayout,
    pub(super) gizmo: wgpu::BindGroupLayout,
    pub(super) splats: wgpu::BindGroupLayout,
    pub(super) layer: wgpu::BindGroupLayout,
    pub(super) floor: wgpu::BindGroupLayout,
}

/// Kinds of primitives, each with its pipeline.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    Background,
    Mesh,
    MeshBlended,
    /// The mesh, drawn only into the depth buffer.
    MeshDepth,
    Splats,
    Layer,
    Lines,
    LinesBehind,
    Points,
    PointsBehind,
    Faces,
    Floor,
    Slice,
    Gizmo,
    Shadow,
}

impl Kind {
    /// Shader, depth test, and whether colours are blended with those behind them.
    fn recipe(self) -> (&'static DrawShader, Depth, bool) {
        match self {
            Self::Background => (&shaders::BACKGROUND, IGNORED_DEPTH, false),
            Self::Mesh | Self::MeshDepth => (&shaders::MESH, NEAREST_DEPTH, false),
            Self::Splats => (&shaders::SPLATS, IGNORED_DEPTH, true),
            Self::Layer => (&shaders::LAYER, IGNORED_DEPTH, true),
            Self::MeshBlended => (&shaders::MESH, VISIBLE_DEPTH, true),
            Self::Lines => (&shaders::LINES, VISIBLE_DEPTH, true),
            Self::LinesBehind => (&shaders::LINES, HIDDEN_DEPTH, true),
            Self::Points => (&shaders::POINTS, VISIBLE_DEPTH, true),
            Self::PointsBehind => (&shaders::POINTS, HIDDEN_DEPTH, true),
            Self::Faces => (&shaders::FACES, VISIBLE_DEPTH, true),
            Self::Floor => (&shaders::FLOOR, VISIBLE_DEPTH, true),
            Self::Slice => (&shaders::SLICE, NEAREST_DEPTH, true),
            Self::Gizmo => (&shaders::GIZMO, NEAREST_DEPTH, true),
            Self::Shadow => (&shaders::SHADOW, IGNORED_DEPTH, true),
        }
    }
}

/// Pipelines for one kind of target, created on first use, so that the first frame is not delayed.
#[derive(Debug)]
pub(super) struct Pipelines {
    context: GpuContext,
    layouts: Arc<Layouts>,
    pub(super) format: wgpu::TextureFormat,
    pub(super) samples: u32,
    made: [OnceLock<wgpu::RenderPipeline>; 15],
}

/// Bytes of a gizmo vertex: position, normal, colour.
pub(super) const GIZMO_STRIDE: u64 = 40;

const GIZMO_ATTRIBUTES: [wgpu::VertexAttribute; 3] =
    wgpu::vertex_attr_array![0 => Float32x3, 1 => Float32x3, 2 => Float32x4];

const MESH_ATTRIBUTES: [wgpu::VertexAttribute; 3] =
    wgpu::vertex_attr_array![0 => Uint32, 1 => Float32x2, 2 => Unorm16x4];

/// How a primitive is tested against depth, and whether it writes depth.
#[derive(Clone, Copy)]
struct Depth {
    compare: CompareFunction,
    write: bool,
}

/// Depth test of opaque surfaces.
const NEAREST_DEPTH: Depth = Depth { compare: CompareFunction::Less, write: true };
/// Depth test of overlays in front of surfaces.
const VISIBLE_DEPTH: Depth = Depth { compare: CompareFunction::LessEqual, write: false };
/// Depth test of overlays behind surfaces.
const HIDDEN_DEPTH: Depth = Depth { compare: CompareFunction::Greater, write: false };
/// Depth test that always passes: nothing is hidden.
const IGNORED_DEPTH: Depth = Depth { compare: CompareFunction::Always, write: false };

pub(super) fn layout_of(context: &GpuContext, name: &str, bindings: &[DrawBinding]) -> wgpu::BindGroupLayout {
    let entries: Vec<_> = (0u32..)
        .zip(bindings)
        .map(|(binding, kind)| wgpu::BindGroupLayoutEntry {
            binding,
            visibility: wgpu::ShaderStages::VERTEX_FRAGMENT,
            ty: match kind {
                DrawBinding::Uniform => wgpu::BindingType::Buffer {
                    ty: wgpu::BufferBindingType::Uniform,
                    has_dynamic_offset: false,
                    min_binding_size: None,
                },
                DrawBinding::Table(entry) => entry.binding(context),
                DrawBinding::Texture => wgpu::BindingType::Texture {
                    sample_type: wgpu::TextureSampleType::Float { filterable: true },
                    view_dimension: wgpu::TextureViewDimension::D2,
                    multisampled: false,
                },
                DrawBinding::Sampler => wgpu::BindingType::Sampler(wgpu::SamplerBindingType::Filtering),
            },
            count: None,
        })
        .collect();
    let descriptor = wgpu::BindGroupLayoutDescriptor { label: Some(name), entries: &entries };
    context.device.create_bind_group_layout(&descriptor)
}

impl Layouts {
    pub(super) fn new(context: &GpuContext) -> Self {
        Self {
            camera: layout_of(context, "camera", &[DrawBinding::Uniform]),
            vertices: layout_of(context, "vertices", shaders::MESH.groups[0]),
            material: layout_of(context, "material", shaders::MESH.groups[1]),
            overlay: layout_of(context, "overlay", shaders::LINES.groups[0]),
            slice: layout_of(context, "slice", shaders::SLICE.groups[0]),
            gizmo: layout_of(context, "gizmo", shaders::GIZMO.groups[0]),
            splats: layout_of(context, "splats", shaders::SPLATS.groups[0]),
            layer: layout_of(context, "layer", shaders::LAYER.groups[0]),
            floor: layout_of(context, "floor", shaders::FLOOR.groups[0]),
        }
    }

    /// Bind group layouts of a shader, except the layout of the camera.
    fn of(&self, shader: &DrawShader) -> Vec<&wgpu::BindGroupLayout> {
        match shader.name {
            "draw_mesh" => vec![&self.vertices, &self.material],
            "draw_shadow" => vec![&self.vertices],
            "draw_floor" => vec![&self.floor],
            "draw_slice" => vec![&self.slice],
            "draw_gizmo" => vec![&self.gizmo],
            "draw_splats" => vec![&self.splats],
            "draw_layer" => vec![&self.layer],
            "draw_lines" | "draw_points" | "draw_faces" => vec![&self.overlay],
            _ => Vec::new(),
        }
    }
}

impl Pipelines {
    pub(super) fn new(
        context: &GpuContext,
        layouts: &Arc<Layouts>,
        format: wgpu::TextureFormat,
        samples: u32,
    ) -> Self {
        Self {
            context: context.clone(),
            layouts: Arc::clone(layouts),
            format,
            samples,
            made: Default::default(),
        }
    }

    pub(super) fn get(&self, kind: Kind) -> &wgpu::RenderPipeline {
        self.made[kind as usize].get_or_init(|| self.make(kind))
    }

    fn make(&self, kind: Kind) -> wgpu::RenderPipeline {
        let (shader, depth, blend) = kind.recipe();
        let (is_layer, is_depth) = (kind == Kind::Splats, kind == Kind::MeshDepth);
        let device = &self.context.device;
        let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some(shader.name),
            source: wgpu::ShaderSource::Wgsl(shader.source(&self.context).into()),
        });
        let groups: Vec<_> =
            std::iter::once(&self.layouts.camera).chain(self.layouts.of(shader)).map(Some).collect();
        let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some(shader.name),
            bind_group_layouts: &groups,
            immediate_size: 0,
        });
        let vertices = |array_stride, attributes| {
            let step_mode = wgpu::VertexStepMode::Vertex;
            [Some(wgpu::VertexBufferLayout { array_stride, step_mode, attributes })]
        };
        let mesh_vertices = vertices(size_of::<DrawVertex>() as u64, &MESH_ATTRIBUTES);
        let gizmo_vertices = vertices(GIZMO_STRIDE, &GIZMO_ATTRIBUTES);
        let is_shadow = shader.name == "draw_shadow";
        let depth_stencil = wgpu::DepthStencilState {
            format: DEPTH_FORMAT,
            depth_write_enabled: Some(depth.write),
            depth_compare: Some(depth.compare),
            stencil: wgpu::StencilState::default(),
            bias: wgpu::DepthBiasState::default(),
        };
        device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: Some(shader.name),
            layout: Some(&layout),
            vertex: wgpu::VertexState {
                module: &module,
                entry_point: Some("vertex"),
                compilation_options: wgpu::PipelineCompilationOptions::default(),
                buffers: match shader.name {
                    "draw_mesh" | "draw_shadow" => &mesh_vertices,
                    "draw_gizmo" => &gizmo_vertices,
                    _ => &[],
                },
            },
            primitive: wgpu::PrimitiveState {
                topology: PrimitiveTopology::TriangleList,
                ..wgpu::PrimitiveState::default()
            },
            depth_stencil: (!is_layer && !is_shadow).then_some(depth_stencil),
            multisample: wgpu::MultisampleState {
                count: if is_layer || is_shadow { 1 } else { self.samples },
                ..wgpu::MultisampleState::default()
            },
            fragment: Some(wgpu::FragmentState {
                module: &module,
                entry_point: Some("fragment"),
                compilation_options: wgpu::PipelineCompilationOptions::default(),
                targets: &[Some(wgpu::ColorTargetState {
                    format: match shader.name {
                        "draw_shadow" => SHADOW_FORMAT,
                        _ if is_layer => LAYER_FORMAT,
                        _ => self.format,
                    },
                    blend: blend.then_some(if is_shadow {
                        BlendState { color: MAXIMUM, alpha: MAXIMUM }
                    } else {
                        BlendState::PREMULTIPLIED_ALPHA_BLENDING
                    }),
                    write_mask: if is_depth { wgpu::ColorWrites::empty() } else { wgpu::ColorWrites::ALL },
                })],
            }),
            multiview_mask: None,
            cache: None,
        })
    }
}
