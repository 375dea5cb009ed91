// Inner sum of equation 2 in K. Smith's paper (docs/method.md, sources): for each cell, sums the squared changes of its
// weights between two fields over the columns of a batch, and adds the sum to `changes`. One invocation per row of the
// fields. CPU: cagework_core::stencil::change_norms.

/// Mode for the first batch: overwrite `changes` instead of adding to them.
const CHANGE_FIRST = 1u;
/// Smaller changes of a weight are counted as 0, because their squares would be denormal numbers.
const MIN_CHANGE = 1e-18f;

@group(0) @binding(0) var<uniform> work: Work;
@group(0) @binding(1) var<storage, read> u_old: array<vec4f>;
@group(0) @binding(2) var<storage, read> u_new: array<vec4f>;
@group(0) @binding(3) var<storage, read_write> changes: array<f32>;

@compute @workgroup_size(64)
fn change_norms(@builtin(global_invocation_id) id: vec3u) {
    let number = invocation(id, work.stride);
    if number >= work.count { return; }
    let row = work.first + number;
    var sum = 0.0;
    if work.mode != CHANGE_FIRST { sum = changes[row]; }
    for (var quad = 0u; quad < work.n_quads; quad++) {
        let i = row * work.n_quads + quad;
        var d = abs(u_new[i] - u_old[i]);
        d = select(vec4f(0.0), d, d > vec4f(MIN_CHANGE));
        d *= d;
        sum += (d.x + d.y) + (d.z + d.w);
    }
    changes[row] = sum;
}
