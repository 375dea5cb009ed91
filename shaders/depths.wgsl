// Bins of depth, by which splats are sorted from back to front. Mirrored by cagework_gpu::splats::Depths.

struct Depths {
    /// Bins per object unit, along the direction to the eye.
    axis: vec3f,
    /// Bin of the origin.
    offset: f32,
    n_splats: u32,
    /// Splats that one invocation counts and places in sequence, so that the order is stable and the same in each run.
    per_block: u32,
    n_blocks: u32,
    /// Whether floaters are hidden, 0 or 1.
    hides: u32,
}

const BINS = 4096u;

@group(0) @binding(1) var<storage, read> depths: Depths;

/// Bin of a centre; 0 is the farthest.
fn bin_of(center: vec3f) -> u32 {
    return u32(clamp(dot(depths.axis, center) + depths.offset, 0.0, f32(BINS - 1u)));
}
