// Cells of a slice in a buffer. Twin: slice_textures.wgsl.

/// (kind, bits of the value) of each cell, u fastest.
@group(1) @binding(1) var<storage, read> cells: array<vec2u>;

fn cell_at(index: u32) -> vec2u { return cells[index]; }
