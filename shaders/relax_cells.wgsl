// Gauss-Seidel or over-relaxation sweep over the rows of one colour, in place: u += omega ((f + sum of neighbours) /
// diagonal - u). One invocation per row and quad of columns. Neighbours have the other colour, so no invocation reads
// what another invocation writes. CPU: cagework_core::stencil::relax_cells.

@group(0) @binding(0) var<uniform> work: Work;
@group(0) @binding(1) var<storage, read> neighbours: array<u32>;
@group(0) @binding(2) var<storage, read> diagonal: array<f32>;
@group(0) @binding(3) var<storage, read> rhs_of_row: array<u32>;
@group(0) @binding(4) var<storage, read> rhs: array<vec4f>;
@group(0) @binding(5) var<storage, read_write> field: array<vec4f>;

@compute @workgroup_size(64)
fn relax_cells(@builtin(global_invocation_id) id: vec3u) {
    let number = invocation(id, work.stride);
    if number >= work.count { return; }
    let item = work.first + number;
    let row = work.first_row + item / work.n_quads;
    let quad = item % work.n_quads;
    var sum = vec4f(0.0);
    let f = rhs_of_row[row];
    if f != NONE { sum = rhs[f * work.n_quads + quad]; }
    sum += field[neighbours[6u * row] * work.n_quads + quad];
    sum += field[neighbours[6u * row + 1u] * work.n_quads + quad];
    sum += field[neighbours[6u * row + 2u] * work.n_quads + quad];
    sum += field[neighbours[6u * row + 3u] * work.n_quads + quad];
    sum += field[neighbours[6u * row + 4u] * work.n_quads + quad];
    sum += field[neighbours[6u * row + 5u] * work.n_quads + quad];
    let own = row * work.n_quads + quad;
    // Divide instead of multiplying by 1/6. f32 rounds 1/6 up, so the sums of weights over columns would drift from 1.
    let mean = sum / diagonal[row];
    if work.omega == 1.0 {
        field[own] = mean;
    } else {
        field[own] += work.omega * (mean - field[own]);
    }
}
