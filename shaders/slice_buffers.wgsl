// Cells of a grid layer in a storage buffer. See also slice_textures.wgsl.

/// For each cell, its type and the bits of its weight. Cells along the layer's first axis are adjacent.
@group(1) @binding(1) var<storage, read> cells: array<vec2u>;

fn cell_at(index: u32) -> vec2u { return cells[index]; }
