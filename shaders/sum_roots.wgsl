// Outer sum of equation 2 in K. Smith's paper (docs/method.md, sources): adds the square roots of the cells' changes,
// one partial sum per workgroup. CPU: cagework_core::stencil::sum_roots.

@group(0) @binding(0) var<uniform> work: Work;
@group(0) @binding(1) var<storage, read> changes: array<f32>;
@group(0) @binding(2) var<storage, read_write> partials: array<f32>;

@compute @workgroup_size(256)
fn sum_roots(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) lane: u32) {
    var sum = 0.0;
    for (var i = lane; i < REDUCE_VALUES; i += REDUCE_LANES) {
        let item = group.x * REDUCE_VALUES + i;
        if item < work.count { sum += sqrt(changes[item]); }
    }
    let total = tree_sum(lane, sum);
    if lane == 0u { partials[group.x] = total; }
}
