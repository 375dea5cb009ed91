// Cells of a slice in a buffer. See also slice_textures.wgsl.

/// Entries (cell type, value as bits), u fastest.
@group(1) @binding(1) var<storage, read> cells: array<vec2u>;

fn cell_at(index: u32) -> vec2u { return cells[index]; }
