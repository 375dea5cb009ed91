// Adds the squares of a field's values, one partial sum per workgroup. CPU: cagework_core::stencil::sum_squares.

@group(0) @binding(0) var<uniform> work: Work;
@group(0) @binding(1) var<storage, read> field: array<vec4f>;
@group(0) @binding(2) var<storage, read_write> partials: array<f32>;

@compute @workgroup_size(256)
fn sum_squares(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) lane: u32) {
    var sum = 0.0;
    for (var i = lane; i < REDUCE_VALUES; i += REDUCE_LANES) {
        let item = group.x * REDUCE_VALUES + i;
        if item < work.count { sum += dot(field[item], field[item]); }
    }
    let total = tree_sum(lane, sum);
    if lane == 0u { partials[group.x] = total; }
}
