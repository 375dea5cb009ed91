// Tables in textures, row by row, for devices without storage buffers. Mirrored by cagework_gpu::table.

const ROW_SHIFT = 11u;

/// Texel at which an entry of a table is stored.
fn place_of(index: u32) -> vec2u {
    return vec2u(index & ((1u << ROW_SHIFT) - 1u), index >> ROW_SHIFT);
}
