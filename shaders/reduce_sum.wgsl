// Adds all partial sums and stores the total in `numbers[first_row]`, which the CPU reads back. Runs as one workgroup.
// CPU: cagework_core::stencil::reduce_sum.

@group(0) @binding(0) var<uniform> work: Work;
@group(0) @binding(1) var<storage, read> partials: array<f32>;
@group(0) @binding(2) var<storage, read_write> numbers: array<f32>;

@compute @workgroup_size(256)
fn reduce_sum(@builtin(local_invocation_index) lane: u32) {
    var sum = 0.0;
    for (var item = lane; item < work.count; item += REDUCE_LANES) {
        sum += partials[item];
    }
    let total = tree_sum(lane, sum);
    if lane == 0u { numbers[work.first_row] = total; }
}
