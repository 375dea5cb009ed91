// The colour map cividis (Nuñez et al. 2018) at ten equidistant values, sRGB, 0 to 255. The same values are in
// cagework_gpu::render::colormap.

const STOPS = array<vec3f, 10>(
    vec3f(0.0, 34.0, 78.0), vec3f(18.0, 53.0, 112.0), vec3f(59.0, 73.0, 108.0), vec3f(87.0, 93.0, 109.0),
    vec3f(112.0, 113.0, 115.0), vec3f(138.0, 134.0, 120.0), vec3f(165.0, 156.0, 116.0),
    vec3f(195.0, 179.0, 105.0), vec3f(225.0, 204.0, 85.0), vec3f(254.0, 232.0, 56.0),
);

/// Colour of negative weights, linear: magenta, which does not occur in cividis.
const NEGATIVE_COLOR = vec3f(0.68, 0.02, 0.28);
/// Weights below this value are drawn in NEGATIVE_COLOR. Negative weights closer to zero are rounding errors.
const NEGATIVE_THRESHOLD = -1e-5f;

/// Linear colour of a value; values outside 0 to 1 are clamped.
fn cividis(value: f32) -> vec3f {
    var stops = STOPS;
    let at = clamp(value, 0.0, 1.0) * 9.0;
    let below = min(u32(at), 8u);
    return linear_from_srgb(mix(stops[below], stops[below + 1u], at - f32(below)) / 255.0);
}
