//! Lines, points and faces over the model. Items index positions and have a state.

use super::layout::{HIDDEN_STATE, STATE_SHIFT, Style};
use super::pipelines::Layouts;
use super::theme::state;
use crate::device::GpuContext;
use crate::table::{Entry, Table};

/// Opacity factor of overlays behind a surface.
pub(super) const BEHIND_OPACITY: f32 = 0.22;

/// An item as two u32: its state and first position index, then its second position index.
pub(super) type Item = [u32; 2];

/// Packs an item from its state and its two position indices.
pub(super) fn item(state: u32, a: u32, b: u32) -> Item {
    [state << STATE_SHIFT | a, b]
}

/// An item that is not drawn.
pub(super) const HIDDEN_ITEM: Item = [HIDDEN_STATE << STATE_SHIFT, 0];

/// Items of one kind with a table of positions.
#[derive(Debug)]
pub(super) struct Overlay {
    positions: Table,
    items: Table,
    count: u32,
    /// Style in front of surfaces, and style behind them.
    styles: [wgpu::Buffer; 2],
    bind_groups: [wgpu::BindGroup; 2],
}

fn style_buffer(context: &GpuContext) -> wgpu::Buffer {
    context.device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("style"),
        size: size_of::<Style>() as u64,
        usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
        mapped_at_creation: false,
    })
}

impl Overlay {
    pub(super) fn new(context: &GpuContext, layouts: &Layouts, positions: &Table, items: &[Item]) -> Self {
        let item_table = Table::unchecked(context, "items", Entry::Pair, items.len());
        let styles = [(); 2].map(|()| style_buffer(context));
        let bind_groups = bind(context, layouts, positions, &item_table, &styles);
        let overlay = Self {
            positions: positions.clone(),
            items: item_table,
            count: items.len() as u32,
            styles,
            bind_groups,
        };
        overlay.write(context, items);
        overlay
    }

    fn write(&self, context: &GpuContext, items: &[Item]) {
        self.items.write(context, bytemuck::cast_slice(items));
    }

    /// Replaces the items. Allocates a new table only if they do not fit into the current one.
    pub(super) fn set_items(&mut self, context: &GpuContext, layouts: &Layouts, items: &[Item]) {
        if size_of_val(items) as u64 > self.items.bytes() {
            self.items = Table::unchecked(context, "items", Entry::Pair, items.len());
            self.bind_groups = bind(context, layouts, &self.positions, &self.items, &self.styles);
        }
        self.count = items.len() as u32;
        self.write(context, items);
    }

    /// Replaces the table of positions.
    pub(super) fn set_positions(&mut self, context: &GpuContext, layouts: &Layouts, positions: &Table) {
        if self.positions != *positions {
            self.positions = positions.clone();
            self.bind_groups = bind(context, layouts, &self.positions, &self.items, &self.styles);
        }
    }

    /// Sets the style in front of surfaces, and a fainter version of it behind surfaces.
    pub(super) fn set_style(&self, context: &GpuContext, style: Style) {
        self.set_styles(context, with_behind(style));
    }

    /// Sets the styles in front of and behind surfaces.
    pub(super) fn set_styles(&self, context: &GpuContext, styles: [Style; 2]) {
        for (buffer, style) in self.styles.iter().zip(styles) {
            context.queue.write_buffer(buffer, 0, bytemuck::bytes_of(&style));
        }
    }

    /// Sets the same style in front of and behind surfaces, for overlays inside the model.
    pub(super) fn set_style_of_both(&self, context: &GpuContext, style: Style) {
        for buffer in &self.styles {
            context.queue.write_buffer(buffer, 0, bytemuck::bytes_of(&style));
        }
    }

    /// Draws all items as lines or points, with the current pipeline.
    pub(super) fn draw(&self, pass: &mut wgpu::RenderPass<'_>, behind: bool) {
        self.draw_vertices(pass, behind, 6 * self.count);
    }

    /// Draws all items as faces with the current pipeline. Two consecutive items make one face.
    pub(super) fn draw_faces(&self, pass: &mut wgpu::RenderPass<'_>) {
        self.draw_vertices(pass, false, 3 * (self.count / 2));
    }

    /// Draws one instance: SwiftShader draws each instance by itself, which takes about 45 µs even for six vertices.
    fn draw_vertices(&self, pass: &mut wgpu::RenderPass<'_>, behind: bool, n: u32) {
        if n > 0 {
            pass.set_bind_group(1, &self.bind_groups[usize::from(behind)], &[]);
            pass.draw(0..n, 0..1);
        }
    }
}

/// A style and its fainter version behind surfaces.
pub(super) fn with_behind(style: Style) -> [Style; 2] {
    let mut behind = Style { opacity: BEHIND_OPACITY * style.opacity, ..style };
    // Selected items keep their full opacity behind surfaces.
    for state in [state::SELECTED_STATE, state::BOTH_STATE] {
        behind.colors[state as usize][3] /= BEHIND_OPACITY;
    }
    [style, behind]
}

fn bind(
    context: &GpuContext,
    layouts: &Layouts,
    positions: &Table,
    items: &Table,
    styles: &[wgpu::Buffer; 2],
) -> [wgpu::BindGroup; 2] {
    styles.each_ref().map(|style| {
        context.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("overlay"),
            layout: &layouts.overlay,
            entries: &[
                wgpu::BindGroupEntry { binding: 0, resource: style.as_entire_binding() },
                wgpu::BindGroupEntry { binding: 1, resource: positions.resource() },
                wgpu::BindGroupEntry { binding: 2, resource: items.resource() },
            ],
        })
    })
}

/// Unique edges of polygons, smaller vertex first, in order of first occurrence.
pub(super) fn unique_edges<'a>(polygons: impl Iterator<Item = &'a [u32]>) -> Vec<[u32; 2]> {
    let mut edges: Vec<[u32; 3]> = Vec::new();
    for polygon in polygons {
        for (k, &a) in polygon.iter().enumerate() {
            let b = polygon[(k + 1) % polygon.len()];
            edges.push([a.min(b), a.max(b), edges.len() as u32]);
        }
    }
    edges.sort_unstable();
    edges.dedup_by_key(|&mut [a, b, _]| [a, b]);
    let mut edges: Vec<[u32; 3]> = edges.into_iter().map(|[a, b, place]| [place, a, b]).collect();
    edges.sort_unstable();
    edges.into_iter().map(|[_, a, b]| [a, b]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn box_has_twelve_edges() {
        let faces: [&[u32]; 6] =
            [&[0, 2, 3, 1], &[4, 5, 7, 6], &[0, 1, 5, 4], &[2, 6, 7, 3], &[0, 4, 6, 2], &[1, 3, 7, 5]];
        let edges = unique_edges(faces.into_iter());
        assert_eq!(edges.len(), 12);
        assert_eq!(&edges[..4], [[0, 2], [2, 3], [1, 3], [0, 1]]);
    }

    #[test]
    fn item_packs_state_and_indices() {
        assert_eq!(item(4, 0x0fff_ffff, 7), [0x4fff_ffff, 7]);
        assert_eq!(HIDDEN_ITEM[0] >> STATE_SHIFT, HIDDEN_STATE);
    }
}
