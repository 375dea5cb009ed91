// Cells of a grid layer in a texture. See also slice_buffers.wgsl.

/// For each cell, its type and the bits of its weight. Cells along the layer's first axis are adjacent.
@group(1) @binding(1) var cells: texture_2d<u32>;

fn cell_at(index: u32) -> vec2u { return textureLoad(cells, place_of(index), 0).xy; }
