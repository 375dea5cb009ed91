// Weights of mesh vertices for the columns of a batch. A vertex's interpolation stencil combines values of the solved
// field and boundary values. One invocation per vertex and quad of columns. CPU:
// cagework_core::stencil::sample_weights.

@group(0) @binding(0) var<uniform> work: Work;
/// Index of each vertex's first entry in `nodes` and in `hats`. `[n_vertices + 1]`
@group(0) @binding(1) var<storage, read> starts: array<vec2u>;
/// Field entries of the stencils: (row of the field, weight as bits).
@group(0) @binding(2) var<storage, read> nodes: array<vec2u>;
/// Boundary entries of the stencils: (control vertex, weight as bits). The boundary value there is 1 in the column of
/// this control and 0 in all other columns.
@group(0) @binding(3) var<storage, read> hats: array<vec2u>;
@group(0) @binding(4) var<storage, read> field: array<vec4f>;
@group(0) @binding(5) var<storage, read_write> block: array<vec4f>;

@compute @workgroup_size(64)
fn sample_weights(@builtin(global_invocation_id) id: vec3u) {
    let number = invocation(id, work.stride);
    if number >= work.count { return; }
    let item = work.first + number;
    let vertex = work.first_row + item / work.n_quads;
    let quad = item % work.n_quads;
    let begin = starts[vertex];
    let end = starts[vertex + 1u];
    var sum = vec4f(0.0);
    for (var i = begin.x; i < end.x; i++) {
        let node = nodes[i];
        sum += bitcast<f32>(node.y) * field[node.x * work.n_quads + quad];
    }
    let first_column = 4u * (work.first_quad + quad);
    for (var i = begin.y; i < end.y; i++) {
        let hat = hats[i];
        let lane = vec4u(hat.x - first_column);
        sum += select(vec4f(0.0), vec4f(bitcast<f32>(hat.y)), lane == vec4u(0u, 1u, 2u, 3u));
    }
    block[item] = sum;
}
