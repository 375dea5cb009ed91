//! A slice of the grid: a table of cells, filled by the CPU.

use super::colormap::MIN_WEIGHT_RANGE;
use super::layout::SliceView as Uniform;
use super::pipelines::Layouts;
use super::scene::{SliceView, Theme};
use super::theme::linear;
use crate::device::GpuContext;
use crate::table::{Entry, Table};

/// GPU data of a slice.
#[derive(Debug)]
pub(super) struct SlicePlane {
    bind_group: wgpu::BindGroup,
}

impl SlicePlane {
    pub(super) fn new(context: &GpuContext, layouts: &Layouts, view: &SliceView, theme: Theme) -> Self {
        let slice = &*view.slice;
        let values = view.column.and_then(|column| slice.values(column));
        let palette = theme.palette();
        let uniform = Uniform {
            corner: slice.corner.to_array(),
            high: values.as_ref().map_or(0.0, |v| v.iter().copied().fold(MIN_WEIGHT_RANGE, f32::max)),
            u: slice.u.to_array(),
            n_u: slice.dims[0],
            v: slice.v.to_array(),
            n_v: slice.dims[1],
            kinds: [palette.exterior, palette.boundary, palette.interior, palette.exterior].map(linear),
            line_color: linear(palette.cell_lines),
        };
        let value = |cell: usize| values.as_ref().map_or(0, |v| v[cell].to_bits());
        let cells: Vec<[u32; 2]> =
            slice.kinds.iter().enumerate().map(|(cell, &kind)| [kind as u32, value(cell)]).collect();
        let table = Table::unchecked(context, "cells of the slice", Entry::Pair, cells.len());
        table.write(context, bytemuck::cast_slice(&cells));
        let buffer = context.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("slice"),
            size: size_of::<Uniform>() as u64,
            usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        context.queue.write_buffer(&buffer, 0, bytemuck::bytes_of(&uniform));
        let bind_group = context.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("slice"),
            layout: &layouts.slice,
            entries: &[
                wgpu::BindGroupEntry { binding: 0, resource: buffer.as_entire_binding() },
                wgpu::BindGroupEntry { binding: 1, resource: table.resource() },
            ],
        });
        Self { bind_group }
    }

    pub(super) fn draw(&self, pass: &mut wgpu::RenderPass<'_>) {
        pass.set_bind_group(1, &self.bind_group, &[]);
        pass.draw(0..6, 0..1);
    }
}
