// First of three kernels that sort splats by one digit of their depth: counts the splats of each block of splats in
// each bin. One invocation per block, so that no atomics are needed. CPU: cagework_gpu::splats::sort_splats.

@group(0) @binding(0) var<uniform> work: Work;
@group(0) @binding(2) var<storage, read> splats: array<vec4f>;
/// Index and colour of each splat, sorted by the lower digit. Not read while sorting by the lower digit.
@group(0) @binding(3) var<storage, read> source: array<vec2u>;
/// Number of splats in each block and bin. `[n_blocks, BINS]`
@group(0) @binding(4) var<storage, read_write> counts: array<u32>;

@compute @workgroup_size(64)
fn count_splats(@builtin(global_invocation_id) id: vec3u) {
    let block = invocation(id, work.stride);
    if block >= work.count { return; }
    let first = BINS * block;
    for (var bin = 0u; bin < BINS; bin += 1u) { counts[first + bin] = 0u; }
    let end = min((block + 1u) * depths.per_block, depths.n_splats);
    for (var k = block * depths.per_block; k < end; k += 1u) {
        var splat = k;
        if work.mode != LOWER_DIGIT { splat = source[k].x; }
        counts[first + bin_of(splats[3u * splat].xyz, work.mode)] += 1u;
    }
}
