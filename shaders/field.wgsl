// The cage's displacement field u on a lattice, in the layout of cagework_gpu::skin::field_table. The field is in a
// storage buffer, because 16-bit textures are too coarse and not every device can filter 32-bit textures.

struct Field {
    /// Position of the first node, object units.
    origin: vec3f,
    /// Edge of a cell, object units.
    cell: f32,
    /// Number of nodes along each axis.
    dims: vec3u,
    /// Displacement of each node, object units; x varies fastest. The fourth component is 1 at nodes that have weights
    /// of the controls (bound nodes) and 0 at other nodes.
    values: array<vec4f>,
}

@group(0) @binding(1) var<storage, read> field: Field;

/// A cell of the lattice, and a point in it.
struct Place {
    /// First node of the cell.
    corner: vec3u,
    /// Coordinates of the point in the cell, 0 to 1.
    share: vec3f,
}

/// Finds the cell that contains a point, and the point's coordinates in it. A point outside the lattice is clamped to
/// it.
fn place_in_lattice(point: vec3f) -> Place {
    let at = (point - field.origin) / field.cell;
    let corner = clamp(floor(at), vec3f(0.0), vec3f(field.dims - 2u));
    return Place(vec3u(corner), clamp(at - corner, vec3f(0.0), vec3f(1.0)));
}

/// Index of a node in `field.values`.
fn index_of(node: vec3u) -> u32 {
    return node.x + field.dims.x * (node.y + field.dims.y * node.z);
}
