// Last of three kernels that sort splats by depth: writes the splats of each block to their positions in the sorted
// order. One invocation per block. CPU: cagework_gpu::splats::sort_splats.

@group(0) @binding(0) var<uniform> work: Work;
@group(0) @binding(2) var<storage, read> splats: array<vec4f>;
/// Red, green and blue in sRGB, and opacity of each splat, 8 bits each.
@group(0) @binding(3) var<storage, read> colors: array<u32>;
/// Position of the next splat of each block and bin. `[n_blocks, BINS]`
@group(0) @binding(4) var<storage, read_write> counts: array<u32>;
/// Index and colour of each splat, farthest first. The colour 0 hides a splat.
@group(0) @binding(5) var<storage, read_write> order: array<vec2u>;

@compute @workgroup_size(64)
fn scatter_splats(@builtin(global_invocation_id) id: vec3u) {
    let block = invocation(id, work.stride);
    if block >= work.count { return; }
    let end = min((block + 1u) * depths.per_block, depths.n_splats);
    for (var splat = block * depths.per_block; splat < end; splat += 1u) {
        let center = splats[3u * splat];
        let k = BINS * block + bin_of(center.xyz);
        let is_hidden = depths.hides == 1u && center.w > 0.0;
        order[counts[k]] = vec2u(splat, select(colors[splat], 0u, is_hidden));
        counts[k] += 1u;
    }
}
