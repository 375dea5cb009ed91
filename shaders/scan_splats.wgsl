// Second of three kernels that sort splats by one digit of their depth: replaces the count of each block and bin by the
// position of its first splat in the sorted order, which is the sum of all counts in earlier bins and of earlier blocks
// in the same bin. One workgroup; each invocation handles 32 bins. CPU: cagework_gpu::splats::sort_splats.

const LANES = 128u;

@group(0) @binding(0) var<uniform> work: Work;
@group(0) @binding(2) var<storage, read_write> counts: array<u32>;

var<workgroup> totals: array<u32, 128>;

@compute @workgroup_size(128)
fn scan_splats(@builtin(local_invocation_index) lane: u32) {
    let first = lane * (BINS / LANES);
    let end = first + BINS / LANES;
    var total = 0u;
    for (var block = 0u; block < depths.n_blocks; block += 1u) {
        for (var bin = first; bin < end; bin += 1u) { total += counts[BINS * block + bin]; }
    }
    totals[lane] = total;
    workgroupBarrier();
    var next = 0u;
    for (var other = 0u; other < lane; other += 1u) { next += totals[other]; }
    for (var bin = first; bin < end; bin += 1u) {
        for (var block = 0u; block < depths.n_blocks; block += 1u) {
            let k = BINS * block + bin;
            let count = counts[k];
            counts[k] = next;
            next += count;
        }
    }
}
