// Parameters that all kernels share. Mirrored by cagework_gpu::layout::Work.

/// Parameters of a dispatch. Each invocation handles one item. The kernel defines what an item is, such as a vertex or
/// a row and quad. A quad is four columns of a batch, one vec4f.
struct Work {
    /// Index of the first item.
    first: u32,
    /// Number of items.
    count: u32,
    /// Number of invocations along x of the two-dimensional dispatch. See `invocation`.
    stride: u32,
    /// Number of quads per row of a field: the number of the batch's columns / 4.
    n_quads: u32,
    /// Row of the field, or slot of the result, that belongs to item 0.
    first_row: u32,
    /// Number of quads in all batches before the current one.
    first_quad: u32,
    /// Variant of the kernel. Kernels with variants define the values as constants.
    mode: u32,
    /// Number of coarse rows from which prolongation interpolates a fine row.
    n_sources: u32,
    /// Over-relaxation factor; 1 is Gauss-Seidel. Dimensionless.
    omega: f32,
}

/// Value that stands for "no row" in tables.
const NONE = 0xffffffffu;

/// Index of an invocation in its dispatch. Invocations whose index is `work.count` or more have no item.
fn invocation(id: vec3u, stride: u32) -> u32 {
    return id.x + id.y * stride;
}
