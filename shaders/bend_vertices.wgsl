// Adds the cage's displacement field to skinned positions: x += u(x). u is given at the nodes of a lattice and
// interpolated trilinearly. Runs in place after skin_vertices, one invocation per vertex. CPU:
// cagework_core::field::bend_vertices.

@group(0) @binding(0) var<uniform> work: Work;
@group(0) @binding(2) var<storage, read_write> positions: array<vec4f>;

fn along_x(corner: vec3u, share: f32) -> vec3f {
    let k = index_of(corner);
    return mix(field.values[k].xyz, field.values[k + 1u].xyz, share);
}

fn along_y(corner: vec3u, share: vec3f) -> vec3f {
    return mix(along_x(corner, share.x), along_x(corner + vec3u(0u, 1u, 0u), share.x), share.y);
}

@compute @workgroup_size(64)
fn bend_vertices(@builtin(global_invocation_id) id: vec3u) {
    let v = invocation(id, work.stride);
    if v >= work.count { return; }
    // A vertex outside the lattice gets the displacement of the lattice's boundary, which is zero.
    let place = place_in_lattice(positions[v].xyz);
    let by = mix(along_y(place.corner, place.share), along_y(place.corner + vec3u(0u, 0u, 1u), place.share), place.share.z);
    positions[v] += vec4f(by, 0.0);
}
