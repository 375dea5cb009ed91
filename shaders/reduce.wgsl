// Sums in a fixed order, so that results are reproducible. Each invocation adds every 256th of the workgroup's 4096
// values, then the workgroup adds the 256 sums pairwise. CPU: cagework_core::stencil::reduce.

const REDUCE_LANES = 256u;
const REDUCE_VALUES = 4096u;

var<workgroup> sums: array<f32, 256>;

/// Returns to every invocation the sum of `value` over the workgroup.
fn tree_sum(lane: u32, value: f32) -> f32 {
    sums[lane] = value;
    workgroupBarrier();
    for (var n = REDUCE_LANES / 2u; n > 0u; n /= 2u) {
        if lane < n { sums[lane] += sums[lane + n]; }
        workgroupBarrier();
    }
    return sums[0];
}
