// Tables where shaders have no buffers to read: textures, row after row. Mirror: cagework_gpu::table.

const ROW_SHIFT = 11u;

/// Where the entry with a number is.
fn place_of(index: u32) -> vec2u {
    return vec2u(index & ((1u << ROW_SHIFT) - 1u), index >> ROW_SHIFT);
}
