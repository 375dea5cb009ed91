// Depths by which splats are sorted from back to front: whole numbers of two digits. Each digit is a bin of a counting
// sort. The lower digit is sorted first. Mirrored by cagework_gpu::splats::Depths.

struct Depths {
    /// Direction to the eye, scaled by the number of depth values per object unit.
    axis: vec3f,
    /// Depth value of the origin of world space.
    offset: f32,
    /// Position of the eye, and 1. In a parallel projection: direction to the eye, and 0.
    viewer: vec4f,
    /// Number of splats.
    n_splats: u32,
    /// Number of splats per block. One invocation counts and places the splats of a block in sequence, so that the sort
    /// is stable and reproducible.
    per_block: u32,
    /// Number of blocks.
    n_blocks: u32,
    /// 1 if floaters (splats outside the cage, marked in the fourth component of their centre) are hidden, otherwise 0.
    hides: u32,
    /// Degree of the spherical harmonics that are drawn, 0 to 3.
    degree: u32,
    /// Factor by which the stored coefficients of harmonics, -1 to 1, are multiplied.
    unit: f32,
    unused: vec2u,
}

/// Number of bins, which is the number of values of a digit.
const BINS = 4096u;
/// Value of `Work::mode` with which a kernel sorts by the lower digit. Other values stand for the higher digit.
const LOWER_DIGIT = 0u;

@group(0) @binding(1) var<storage, read> depths: Depths;

/// A digit of the depth of a splat with this centre. Depth 0 is the farthest from the eye.
fn bin_of(center: vec3f, digit: u32) -> u32 {
    let depth = u32(clamp(dot(depths.axis, center) + depths.offset, 0.0, f32(BINS * BINS - 1u)));
    return select(depth / BINS, depth % BINS, digit == LOWER_DIGIT);
}
