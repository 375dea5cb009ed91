// The deformation as a field, in the layout of cagework_gpu::skin::field_table. It is in a storage buffer, because
// 16-bit textures are too coarse and not every device can filter 32-bit textures.

struct Field {
    /// Position of the first node, object units.
    origin: vec3f,
    /// Edge of a cell, object units.
    cell: f32,
    /// Nodes along each axis, x fastest.
    dims: vec3u,
    /// Displacements, object units. The fourth component is 1 at bound nodes, otherwise 0.
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

/// Place of a point, clamped to the lattice.
fn place_in_lattice(point: vec3f) -> Place {
    let at = (point - field.origin) / field.cell;
    let corner = clamp(floor(at), vec3f(0.0), vec3f(field.dims - 2u));
    return Place(vec3u(corner), clamp(at - corner, vec3f(0.0), vec3f(1.0)));
}

fn index_of(node: vec3u) -> u32 {
    return node.x + field.dims.x * (node.y + field.dims.y * node.z);
}
