// First of three kernels that sort splats by depth: counts the splats of each block of splats in each bin of depth. One
// invocation per block, so that no atomics are needed. CPU: cagework_gpu::splats::sort_splats.

@group(0) @binding(0) var<uniform> work: Work;
@group(0) @binding(2) var<storage, read> splats: array<vec4f>;
/// Number of splats in each block and bin. `[n_blocks, BINS]`
@group(0) @binding(3) var<storage, read_write> counts: array<u32>;

@compute @workgroup_size(64)
fn count_splats(@builtin(global_invocation_id) id: vec3u) {
    let block = invocation(id, work.stride);
    if block >= work.count { return; }
    let first = BINS * block;
    for (var bin = 0u; bin < BINS; bin += 1u) { counts[first + bin] = 0u; }
    let end = min((block + 1u) * depths.per_block, depths.n_splats);
    for (var splat = block * depths.per_block; splat < end; splat += 1u) {
        counts[first + bin_of(splats[3u * splat].xyz)] += 1u;
    }
}
