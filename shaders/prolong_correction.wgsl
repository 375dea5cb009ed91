// Prolongation: adds to each black row the mean correction of its two or eight coarse neighbours. Neighbours outside
// the cage have the correction zero. With PROLONG_REPLACE, for the initial guess of full multigrid, replaces the row by
// the mean of those coarse neighbours that are unknowns. One invocation per table entry and quad of columns. CPU:
// cagework_core::stencil::prolong_correction.

/// Value of `mode` that replaces values instead of adding corrections.
const PROLONG_REPLACE = 1u;
/// Number of words in an entry before the rows of its `n_sources` coarse neighbours. These words are the fine row, and
/// the bits of 1 / (number of coarse neighbours that are unknowns).
const ENTRY_HEAD = 2u;

@group(0) @binding(0) var<uniform> work: Work;
@group(0) @binding(1) var<storage, read> entries: array<u32>;
@group(0) @binding(2) var<storage, read> coarse: array<vec4f>;
@group(0) @binding(3) var<storage, read_write> field: array<vec4f>;

@compute @workgroup_size(64)
fn prolong_correction(@builtin(global_invocation_id) id: vec3u) {
    let number = invocation(id, work.stride);
    if number >= work.count { return; }
    let item = work.first + number;
    let entry = item / work.n_quads * (ENTRY_HEAD + work.n_sources);
    let quad = item % work.n_quads;
    var sum = vec4f(0.0);
    for (var k = 0u; k < work.n_sources; k++) {
        sum += coarse[entries[entry + ENTRY_HEAD + k] * work.n_quads + quad];
    }
    let own = entries[entry] * work.n_quads + quad;
    if work.mode == PROLONG_REPLACE {
        field[own] = sum * bitcast<f32>(entries[entry + 1u]);
    } else {
        field[own] += sum * (1.0 / f32(work.n_sources));
    }
}
