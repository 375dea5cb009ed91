// Area-weighted vertex normals. Each invocation adds the normals of one vertex's triangles in a fixed order, without
// atomics. The normal of a vertex without triangles is zero. CPU: cagework_core::stencil::vertex_normals.

@group(0) @binding(0) var<uniform> work: Work;
/// Index of each vertex's first entry in `others`. `[n_vertices + 1]`
@group(0) @binding(1) var<storage, read> starts: array<u32>;
/// For each vertex and each of its triangles, the triangle's other two vertices, counter-clockwise.
@group(0) @binding(2) var<storage, read> others: array<vec2u>;
@group(0) @binding(3) var<storage, read> positions: array<vec4f>;
@group(0) @binding(4) var<storage, read_write> normals: array<vec4f>;

@compute @workgroup_size(64)
fn vertex_normals(@builtin(global_invocation_id) id: vec3u) {
    let number = invocation(id, work.stride);
    if number >= work.count { return; }
    let vertex = work.first + number;
    let end = starts[vertex + 1u];
    let p = positions[vertex].xyz;
    var sum = vec3f(0.0);
    for (var i = starts[vertex]; i < end; i++) {
        let other = others[i];
        sum += cross(positions[other.x].xyz - p, positions[other.y].xyz - p);
    }
    let square = dot(sum, sum);
    if square > 0.0 { sum *= inverseSqrt(square); }
    normals[vertex] = vec4f(sum, 0.0);
}
