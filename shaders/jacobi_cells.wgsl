// Jacobi sweep (Algorithm 3 in K. Smith's paper, see docs/method.md): each row of u_out is the average of its
// neighbours in u_in and its boundary values. One invocation per row and quad of columns. The caller swaps u_in and
// u_out after each sweep. CPU: cagework_core::stencil::jacobi_cells.

@group(0) @binding(0) var<uniform> work: Work;
@group(0) @binding(1) var<storage, read> neighbours: array<u32>;
@group(0) @binding(2) var<storage, read> diagonal: array<f32>;
@group(0) @binding(3) var<storage, read> rhs_of_row: array<u32>;
@group(0) @binding(4) var<storage, read> rhs: array<vec4f>;
@group(0) @binding(5) var<storage, read> u_in: array<vec4f>;
@group(0) @binding(6) var<storage, read_write> u_out: array<vec4f>;

@compute @workgroup_size(64)
fn jacobi_cells(@builtin(global_invocation_id) id: vec3u) {
    let number = invocation(id, work.stride);
    if number >= work.count { return; }
    let item = work.first + number;
    let row = work.first_row + item / work.n_quads;
    let quad = item % work.n_quads;
    var sum = vec4f(0.0);
    let f = rhs_of_row[row];
    if f != NONE { sum = rhs[f * work.n_quads + quad]; }
    sum += u_in[neighbours[6u * row] * work.n_quads + quad];
    sum += u_in[neighbours[6u * row + 1u] * work.n_quads + quad];
    sum += u_in[neighbours[6u * row + 2u] * work.n_quads + quad];
    sum += u_in[neighbours[6u * row + 3u] * work.n_quads + quad];
    sum += u_in[neighbours[6u * row + 4u] * work.n_quads + quad];
    sum += u_in[neighbours[6u * row + 5u] * work.n_quads + quad];
    u_out[row * work.n_quads + quad] = sum / diagonal[row];
}
