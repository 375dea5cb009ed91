// Parameters common to all kernels. Mirrored by cagework_gpu::layout::Work.

/// Parameters of a dispatch. Each kernel defines its items (row and quad, vertex, ...); one invocation per item.
struct Work {
    /// First item.
    first: u32,
    /// Number of items.
    count: u32,
    /// Invocations per row of workgroups; further rows are along y.
    stride: u32,
    /// Quads per row of a field: columns of the batch / 4.
    n_quads: u32,
    /// Offset of items: first row of a field, or first slot of a result.
    first_row: u32,
    /// First quad of the batch.
    first_quad: u32,
    /// Variant of the kernel; its constants.
    mode: u32,
    /// Number of coarse rows that a fine row is interpolated from.
    n_sources: u32,
    /// Over-relaxation factor; 1 is Gauss-Seidel. Dimensionless.
    omega: f32,
}

/// "No row" in tables.
const NONE = 0xffffffffu;

/// Index of an invocation in its dispatch; out of range from `work.count` on.
fn invocation(id: vec3u, stride: u32) -> u32 {
    return id.x + id.y * stride;
}
