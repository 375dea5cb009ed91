// Adds the cage's displacement field to skinned positions: x += u(x). u is given at the nodes of a lattice and
// interpolated trilinearly. Runs in place after skin_vertices, one invocation per vertex. The field is in a storage
// buffer, because 16-bit textures are too coarse and not every device can filter 32-bit textures. CPU:
// cagework_core::field::bend_vertices.

struct Field {
    /// Position of the first node, object units.
    origin: vec3f,
    /// Edge of a cell, object units.
    cell: f32,
    /// Number of nodes along each axis.
    dims: vec3u,
    /// Displacement at each node, object units; x varies fastest.
    values: array<vec4f>,
}

@group(0) @binding(0) var<uniform> work: Work;
@group(0) @binding(1) var<storage, read> field: Field;
@group(0) @binding(2) var<storage, read_write> positions: array<vec4f>;

fn along_x(corner: vec3u, share: f32) -> vec3f {
    let k = corner.x + field.dims.x * (corner.y + field.dims.y * corner.z);
    return mix(field.values[k].xyz, field.values[k + 1u].xyz, share);
}

fn along_y(corner: vec3u, share: vec3f) -> vec3f {
    return mix(along_x(corner, share.x), along_x(corner + vec3u(0u, 1u, 0u), share.x), share.y);
}

@compute @workgroup_size(64)
fn bend_vertices(@builtin(global_invocation_id) id: vec3u) {
    let v = invocation(id, work.stride);
    if v >= work.count { return; }
    let at = (positions[v].xyz - field.origin) / field.cell;
    let first = clamp(floor(at), vec3f(0.0), vec3f(field.dims - 2u));
    // A vertex outside the lattice gets the displacement of the lattice's boundary, which is zero.
    let share = clamp(at - first, vec3f(0.0), vec3f(1.0));
    let corner = vec3u(first);
    let by = mix(along_y(corner, share), along_y(corner + vec3u(0u, 0u, 1u), share), share.z);
    positions[v] += vec4f(by, 0.0);
}
