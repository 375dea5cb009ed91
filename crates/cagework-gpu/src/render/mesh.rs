//! GPU data of the model: corners, indices, materials, textures.

use std::ops::Range;

use super::layout::{Surface, surface_mode};
use super::model::{Alpha, CLAY, DrawGroup, DrawModel, DrawTexture, Wrap};
use super::pipelines::Layouts;
use super::scene::MeshStyle;
use super::texture;
use crate::buffers::Allocator;
use crate::device::GpuContext;
use crate::error::GpuError;
use crate::table::{Entry, Table};

/// GPU data of a model.
#[derive(Debug)]
pub(super) struct Mesh {
    corners: wgpu::Buffer,
    indices: wgpu::Buffer,
    groups: Vec<Group>,
    /// Positions at rest.
    pub(super) rest: Table,
    /// Normals at rest.
    pub(super) rest_normals: Table,
    /// Value of each vertex, depending on the [`MeshStyle`]: the weight of the shown control, the reproduction error,
    /// or the strength, 0 to 1, of the blend towards grey or paint.
    pub(super) values: Table,
    /// Bind group of the vertices' positions, normals and values.
    vertices: wgpu::BindGroup,
    /// The positions that are drawn, at rest or deformed.
    pub(super) positions: Table,
    pub(super) n_vertices: u32,
}

#[derive(Debug)]
struct Group {
    indices: Range<u32>,
    surface: Surface,
    uniform: wgpu::Buffer,
    bind_group: wgpu::BindGroup,
    blended: bool,
}

impl Mesh {
    pub(super) async fn new(
        context: &GpuContext,
        layouts: &Layouts,
        model: &DrawModel,
        normals: &[[f32; 4]],
    ) -> Result<Self, GpuError> {
        let white = DrawTexture { width: 1, height: 1, rgba: vec![255; 4], ..DrawTexture::default() };
        let white = texture::upload(context, &white).await?;
        let mut textures = Vec::new();
        for texture in &model.textures {
            textures.push(texture::upload(context, texture).await?);
        }
        let mut allocator = Allocator::new(context, "the model");
        let usage = wgpu::BufferUsages::VERTEX | wgpu::BufferUsages::COPY_DST;
        let corner_bytes: &[u8] = bytemuck::cast_slice(&model.vertices);
        let corners = allocator.zeros("corners", corner_bytes.len() as u64, usage)?;
        let usage = wgpu::BufferUsages::INDEX | wgpu::BufferUsages::COPY_DST;
        let index_bytes: &[u8] = bytemuck::cast_slice(&model.triangles);
        let indices = allocator.zeros("triangles", index_bytes.len() as u64, usage)?;
        for (buffer, bytes) in [(&corners, corner_bytes), (&indices, index_bytes)] {
            if !bytes.is_empty() {
                context.queue.write_buffer(buffer, 0, bytes);
            }
        }
        let rest_positions = model.with_copies(&model.positions);
        let padded: Vec<[f32; 4]> = rest_positions.iter().map(|p| p.extend(1.0).to_array()).collect();
        let n = padded.len();
        let rest = Table::new(context, &mut allocator, "rest positions", Entry::Point, n)?;
        rest.write(context, bytemuck::cast_slice(&padded));
        let rest_normals = Table::new(context, &mut allocator, "rest normals", Entry::Point, n)?;
        rest_normals.write(context, bytemuck::cast_slice(normals));
        let values = Table::new(context, &mut allocator, "values of vertices", Entry::Value, n)?;
        let mut groups = Vec::new();
        for group in model.whole_groups(CLAY) {
            let (view, wrap) = match group.texture {
                Some(t) => (&textures[t as usize], model.textures[t as usize].wrap),
                None => (&white, [Wrap::Repeat; 2]),
            };
            groups.push(Group::new(context, layouts, &mut allocator, &group, view, wrap)?);
        }
        let vertices = bind_vertices(context, layouts, &rest, &rest_normals, &values);
        let n_vertices = n as u32;
        let positions = rest.clone();
        allocator.settle().await?;
        Ok(Self { corners, indices, groups, rest, rest_normals, values, vertices, positions, n_vertices })
    }

    /// Sets the tables of positions and normals that are drawn.
    pub(super) fn set_vertices(
        &mut self,
        context: &GpuContext,
        layouts: &Layouts,
        positions: &Table,
        normals: &Table,
    ) {
        self.vertices = bind_vertices(context, layouts, positions, normals, &self.values);
        self.positions = positions.clone();
    }

    /// Makes subsequent frames draw the rest pose.
    pub(super) fn set_rest(&mut self, context: &GpuContext, layouts: &Layouts) {
        let (rest, normals) = (self.rest.clone(), self.rest_normals.clone());
        self.set_vertices(context, layouts, &rest, &normals);
    }

    /// Sets the style from which shaders compute the mesh's colours. `[low, high]`: values of the colour map's first
    /// and last colour. `overlay`: [`Surface::low`] and [`Surface::high`] for styles without a colour map.
    pub(super) fn set_style(
        &self,
        context: &GpuContext,
        style: MeshStyle,
        [low, high]: [f32; 2],
        overlay: [f32; 2],
    ) {
        let with_overlay = |surface| Surface { low: overlay[0], high: overlay[1], ..surface };
        for group in &self.groups {
            let surface = match style {
                MeshStyle::Hidden | MeshStyle::Solid => with_overlay(group.surface),
                MeshStyle::Clay => {
                    with_overlay(Surface { mode: surface_mode::CLAY, base_color: CLAY, ..Surface::default() })
                }
                MeshStyle::Weights { .. } => {
                    Surface { mode: surface_mode::WEIGHTS, low, high, ..Surface::default() }
                }
                MeshStyle::Errors => Surface { mode: surface_mode::ERRORS, low, high, ..Surface::default() },
            };
            context.queue.write_buffer(&group.uniform, 0, bytemuck::bytes_of(&surface));
        }
    }

    /// Binds the mesh's vertex tables, corners and indices.
    fn begin(&self, pass: &mut wgpu::RenderPass<'_>) {
        pass.set_bind_group(1, &self.vertices, &[]);
        pass.set_vertex_buffer(0, self.corners.slice(..));
        pass.set_index_buffer(self.indices.slice(..), wgpu::IndexFormat::Uint32);
    }

    /// Draws the triangles of all groups, except groups of `hidden` triangles. Does not bind materials.
    pub(super) fn draw_plain(&self, pass: &mut wgpu::RenderPass<'_>, hidden: &[Range<u32>]) {
        self.begin(pass);
        for group in self.groups.iter().filter(|group| !group.is_among(hidden)) {
            pass.draw_indexed(group.indices.clone(), 0, 0..1);
        }
    }

    /// Draws the blended groups or, with `blended` false, all other groups, except groups of `hidden` triangles. Colour
    /// maps are opaque, so with a colour map no group is blended.
    pub(super) fn draw(
        &self,
        pass: &mut wgpu::RenderPass<'_>,
        style: MeshStyle,
        blended: bool,
        hidden: &[Range<u32>],
    ) {
        self.begin(pass);
        for group in &self.groups {
            if (group.blended && style == MeshStyle::Solid) == blended && !group.is_among(hidden) {
                pass.set_bind_group(2, &group.bind_group, &[]);
                pass.draw_indexed(group.indices.clone(), 0, 0..1);
            }
        }
    }
}

fn bind_vertices(
    context: &GpuContext,
    layouts: &Layouts,
    positions: &Table,
    normals: &Table,
    values: &Table,
) -> wgpu::BindGroup {
    context.device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: Some("vertices"),
        layout: &layouts.vertices,
        entries: &[
            wgpu::BindGroupEntry { binding: 0, resource: positions.resource() },
            wgpu::BindGroupEntry { binding: 1, resource: normals.resource() },
            wgpu::BindGroupEntry { binding: 2, resource: values.resource() },
        ],
    })
}

impl Group {
    /// Whether the group's triangles are in one of the ranges `hidden`.
    fn is_among(&self, hidden: &[Range<u32>]) -> bool {
        hidden.iter().any(|range| range.contains(&(self.indices.start / 3)))
    }

    fn new(
        context: &GpuContext,
        layouts: &Layouts,
        allocator: &mut Allocator<'_>,
        group: &DrawGroup,
        view: &wgpu::TextureView,
        wrap: [Wrap; 2],
    ) -> Result<Self, GpuError> {
        let surface = Surface {
            base_color: group.base_color,
            mode: if group.alpha == Alpha::Blend {
                surface_mode::ALPHA_BLENDING
            } else {
                surface_mode::MATERIAL
            },
            alpha_cutoff: match group.alpha {
                Alpha::Mask { cutoff } => cutoff,
                Alpha::Opaque | Alpha::Blend => 0.0,
            },
            low: 0.0,
            high: 0.0,
        };
        let usage = wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST;
        let uniform = allocator.zeros("material", size_of::<Surface>() as u64, usage)?;
        context.queue.write_buffer(&uniform, 0, bytemuck::bytes_of(&surface));
        let [u, v] = wrap.map(|wrap| match wrap {
            Wrap::Repeat => wgpu::AddressMode::Repeat,
            Wrap::Mirror => wgpu::AddressMode::MirrorRepeat,
            Wrap::Clamp => wgpu::AddressMode::ClampToEdge,
        });
        let sampler = context.device.create_sampler(&wgpu::SamplerDescriptor {
            label: Some("base colour"),
            address_mode_u: u,
            address_mode_v: v,
            mag_filter: wgpu::FilterMode::Linear,
            min_filter: wgpu::FilterMode::Linear,
            mipmap_filter: wgpu::MipmapFilterMode::Linear,
            anisotropy_clamp: 4,
            ..wgpu::SamplerDescriptor::default()
        });
        let bind_group = context.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("material"),
            layout: &layouts.material,
            entries: &[
                wgpu::BindGroupEntry { binding: 0, resource: uniform.as_entire_binding() },
                wgpu::BindGroupEntry { binding: 1, resource: wgpu::BindingResource::TextureView(view) },
                wgpu::BindGroupEntry { binding: 2, resource: wgpu::BindingResource::Sampler(&sampler) },
            ],
        });
        Ok(Self {
            indices: 3 * group.triangles.start..3 * group.triangles.end,
            surface,
            uniform,
            bind_group,
            blended: group.alpha == Alpha::Blend,
        })
    }
}
