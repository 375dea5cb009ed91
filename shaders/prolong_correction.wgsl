// Prolongation to the black rows of one kind (two or eight coarse cells around): adds the interpolated correction, zero
// outside the cage, or, as full multigrid's first guess, replaces the value by the mean of the coarse cells there are.
// One invocation per table entry and quad. Twin: cagework_core::stencil::prolong_correction.

/// `mode`.
const PROLONG_REPLACE = 1u;
/// An entry: fine row, 1 over the number of coarse unknowns (bits of an f32), `n_sources` coarse rows.
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
