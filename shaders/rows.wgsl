// Tables stored row by row in textures of 2048 columns, for devices without storage buffers. Mirrored by
// cagework_gpu::table.

const ROW_SHIFT = 11u;

/// Coordinates of the texel that stores an entry of a table.
fn place_of(index: u32) -> vec2u {
    return vec2u(index & ((1u << ROW_SHIFT) - 1u), index >> ROW_SHIFT);
}
