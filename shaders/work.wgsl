// What every kernel is told. Mirror: cagework_gpu::layout::Work.

/// One dispatch. Items are numbered by the kernel (a row and a quad, a vertex, ...), one invocation each.
struct Work {
    /// First item.
    first: u32,
    /// Number of items.
    count: u32,
    /// Invocations in one row of workgroups; further ones lie along y.
    stride: u32,
    /// Quads in a row of a field: columns of the batch over four.
    n_quads: u32,
    /// First row of a field, or first slot of a result, that items count from.
    first_row: u32,
    /// First quad of the batch among all columns.
    first_quad: u32,
    /// A kernel's variants, its own constants.
    mode: u32,
    /// Coarse rows that a fine row is interpolated from.
    n_sources: u32,
    /// Over-relaxation: 1 goes to the Gauss-Seidel value. Dimensionless.
    omega: f32,
}

/// Marks "no row" in tables.
const NONE = 0xffffffffu;

/// Number of an invocation in its dispatch; items end at `work.count`.
fn invocation(id: vec3u, stride: u32) -> u32 {
    return id.x + id.y * stride;
}
