// Parameters common to all kernels. Mirrored by cagework_gpu::layout::Work.

/// Parameters of a dispatch. Each kernel defines its items (row and quad, vertex, ...); one invocation per item.
struct Work {
    /// First item.
    first: u32,
    /// Number of items.
    count: u32,
    /// Number of invocations per row of workgroups; further rows are along y.
    stride: u32,
    /// Quads per row of a field: columns of the batch / 4.
    n_quads: u32,
    /// First row of the field, or first slot of the result, from which items are counted.
    first_row: u32,
    /// First quad of the batch.
    first_quad: u32,
    /// Variant of the kernel; the kernel defines the values as constants.
    mode: u32,
    /// Number of coarse rows from which a fine row is interpolated.
    n_sources: u32,
    /// Over-relaxation factor; 1 is Gauss-Seidel. Dimensionless.
    omega: f32,
}

/// Value that stands for "no row" in tables.
const NONE = 0xffffffffu;

/// Index of an invocation in its dispatch. Invocations with an index from `work.count` on have no item.
fn invocation(id: vec3u, stride: u32) -> u32 {
    return id.x + id.y * stride;
}
