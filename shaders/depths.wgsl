// Bins of depth by which splats are sorted from back to front. Mirrored by cagework_gpu::splats::Depths.

struct Depths {
    /// Direction to the eye, scaled to the number of bins per object unit.
    axis: vec3f,
    /// Bin of the origin, as a fraction.
    offset: f32,
    /// Number of splats.
    n_splats: u32,
    /// Number of splats per block. One invocation counts and places the splats of a block in sequence, so that the sort
    /// is stable and reproducible.
    per_block: u32,
    /// Number of blocks.
    n_blocks: u32,
    /// 1 if floaters (stray splats, marked in the fourth component of their centre) are hidden, otherwise 0.
    hides: u32,
}

const BINS = 4096u;

@group(0) @binding(1) var<storage, read> depths: Depths;

/// Bin of a splat with this centre. Bin 0 is the farthest from the eye.
fn bin_of(center: vec3f) -> u32 {
    return u32(clamp(dot(depths.axis, center) + depths.offset, 0.0, f32(BINS - 1u)));
}
