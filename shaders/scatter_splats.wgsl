// Last of three kernels that sort splats by one digit of their depth: writes the splats of each block to their
// positions in the sorted order. One invocation per block. CPU: cagework_gpu::splats::sort_splats.

@group(0) @binding(0) var<uniform> work: Work;
@group(0) @binding(2) var<storage, read> splats: array<vec4f>;
/// Red, green and blue in sRGB, and opacity of each splat, 8 bits each.
@group(0) @binding(3) var<storage, read> colors: array<u32>;
/// Index and colour of each splat, sorted by the lower digit. Not read while sorting by the lower digit.
@group(0) @binding(4) var<storage, read> source: array<vec2u>;
/// Index in `order` of the next splat of each block and bin. `[n_blocks, BINS]`
@group(0) @binding(5) var<storage, read_write> counts: array<u32>;
/// Index and colour of each splat, sorted by the digits up to the one that `work.mode` selects. The colour 0 hides a
/// splat.
@group(0) @binding(7) var<storage, read_write> order: array<vec2u>;
/// Coefficients of red, green and blue, 16 bits each, band 0 first, padded to an even number per splat. Not read for
/// degree 0.
@group(0) @binding(6) var<storage, read> harmonics: array<u32>;

/// Fourth entry of a floater's centre; turns add a number between -1 and 1, see deform_splats.wgsl.
const FLOATER: f32 = 4.0;
/// Added to the first entry of the turn of a mirrored splat, see deform_splats.wgsl.
const MIRROR: f32 = 4.0;

/// Coefficient `k` of the splat whose coefficients start at word `first`.
fn coefficient(first: u32, k: u32) -> f32 {
    return unpack2x16snorm(harmonics[first + k / 2u])[k % 2u];
}

fn is_floater(splat: u32) -> bool { return splats[3u * splat].w > 0.5 * FLOATER; }

/// Colour and opacity of a splat, seen from the eye. The harmonics do not rotate with the splat. Instead, the direction
/// of view is rotated by the inverse of the splat's rotation.
fn color_of(splat: u32) -> u32 {
    if depths.degree == 0u { return colors[splat]; }
    let center = splats[3u * splat];
    let direction = normalize(depths.viewer.w * center.xyz - depths.viewer.xyz);
    let turn_z = center.w - select(0.0, FLOATER, is_floater(splat));
    let turn_xy = splats[3u * splat + 2u].zw;
    let is_mirrored = turn_xy.x > 0.5 * MIRROR;
    let turn = vec3f(turn_xy.x - select(0.0, MIRROR, is_mirrored), turn_xy.y, turn_z);
    // The inverse of the rotation whose axis times tan(angle / 4) is `turn`.
    let size = dot(turn, turn);
    let across = cross(turn, direction);
    let back = (8.0 * cross(turn, across) - 4.0 * (1.0 - size) * across) / ((1.0 + size) * (1.0 + size));
    var basis = harmonic_basis(select(1.0, -1.0, is_mirrored) * (direction + back));
    let n = (depths.degree + 1u) * (depths.degree + 1u);
    let first = splat * ((3u * n + 1u) / 2u);
    var color = vec3f(0.0);
    for (var k = 0u; k < n; k += 1u) {
        let at = 3u * k;
        color += basis[k]
            * vec3f(coefficient(first, at), coefficient(first, at + 1u), coefficient(first, at + 2u));
    }
    let rgb = pack4x8unorm(vec4f(clamp(depths.unit * color, vec3f(0.0), vec3f(1.0)), 0.0));
    return (colors[splat] & 0xff000000u) | rgb;
}

@compute @workgroup_size(64)
fn scatter_splats(@builtin(global_invocation_id) id: vec3u) {
    let block = invocation(id, work.stride);
    if block >= work.count { return; }
    let end = min((block + 1u) * depths.per_block, depths.n_splats);
    for (var at = block * depths.per_block; at < end; at += 1u) {
        var entry = vec2u(at, 0u);
        if work.mode == LOWER_DIGIT {
            let is_hidden = depths.hides == 1u && is_floater(at);
            if !is_hidden { entry.y = color_of(at); }
        } else {
            entry = source[at];
        }
        let k = BINS * block + bin_of(splats[3u * entry.x].xyz, work.mode);
        order[counts[k]] = entry;
        counts[k] += 1u;
    }
}
