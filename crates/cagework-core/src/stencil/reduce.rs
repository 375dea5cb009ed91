//! Reductions in the fixed order of the GPU's workgroups.

/// Number of invocations per reducing workgroup.
pub const REDUCE_LANES: usize = 256;
/// Number of values that a workgroup reduces to a partial sum.
pub const REDUCE_VALUES: usize = 4096;

/// Lane k sums the values k, k + 256, ...; then the lanes are summed as a tree.
fn tree_sum(values: impl Iterator<Item = f32>) -> f32 {
    let mut sums = [0.0f32; REDUCE_LANES];
    for (i, value) in values.enumerate() {
        sums[i % REDUCE_LANES] += value;
    }
    let mut n = REDUCE_LANES / 2;
    while n > 0 {
        for lane in 0..n {
            sums[lane] += sums[lane + n];
        }
        n /= 2;
    }
    sums[0]
}

/// Partial sums of squares of a field, one per 4096 quads of values. GPU kernel: `shaders/sum_squares.wgsl`.
#[must_use]
pub fn sum_squares(field: &[f32]) -> Vec<f32> {
    field
        .chunks(4 * REDUCE_VALUES)
        .map(|part| tree_sum(part.chunks(4).map(|q| q.iter().map(|x| x * x).sum())))
        .collect()
}

/// Partial sums of square roots, one per 4096 values. GPU kernel: `shaders/sum_roots.wgsl`.
#[must_use]
pub fn sum_roots(changes: &[f32]) -> Vec<f32> {
    changes.chunks(REDUCE_VALUES).map(|part| tree_sum(part.iter().map(|x| x.sqrt()))).collect()
}

/// Sum of partial sums. GPU kernel: `shaders/reduce_sum.wgsl`.
#[must_use]
pub fn reduce_sum(partials: &[f32]) -> f32 {
    tree_sum(partials.iter().copied())
}
