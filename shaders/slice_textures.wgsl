// Cells of a slice in a texture. See also slice_buffers.wgsl.

/// Entries (cell type, value as bits), u fastest.
@group(1) @binding(1) var cells: texture_2d<u32>;

fn cell_at(index: u32) -> vec2u { return textureLoad(cells, place_of(index), 0).xy; }
