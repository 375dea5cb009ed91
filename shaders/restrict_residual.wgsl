// Restriction: the right-hand side of a coarse row is a weighted sum of the 13 red residuals of the fine level at the
// centre of the coarse cell and at its twelve edge neighbours. One invocation per coarse row and quad of columns. CPU:
// cagework_core::stencil::restrict_residual.

/// Number of fine rows per coarse row.
const N_FINE_ROWS = 13u;
/// Weights of the centre, 4/8, and of the twelve edge neighbours, 1/8 each.
const RESTRICT_CENTRE = 0.5f;
const RESTRICT_EDGE = 0.125f;

@group(0) @binding(0) var<uniform> work: Work;
@group(0) @binding(1) var<storage, read> around: array<u32>;
@group(0) @binding(2) var<storage, read> red_residual: array<vec4f>;
@group(0) @binding(3) var<storage, read_write> coarse_rhs: array<vec4f>;

@compute @workgroup_size(64)
fn restrict_residual(@builtin(global_invocation_id) id: vec3u) {
    let number = invocation(id, work.stride);
    if number >= work.count { return; }
    let item = work.first + number;
    let row = item / work.n_quads;
    let quad = item % work.n_quads;
    var edges = vec4f(0.0);
    for (var k = 1u; k < N_FINE_ROWS; k++) {
        edges += red_residual[around[N_FINE_ROWS * row + k] * work.n_quads + quad];
    }
    let centre = red_residual[around[N_FINE_ROWS * row] * work.n_quads + quad];
    coarse_rhs[item] = RESTRICT_CENTRE * centre + RESTRICT_EDGE * edges;
}
