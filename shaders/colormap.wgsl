// Cividis (Nuñez et al. 2018) at ten equidistant values. Same values as cagework_gpu::render::colormap.

const STOPS = array<vec3f, 10>(
    vec3f(0.0, 34.0, 78.0), vec3f(18.0, 53.0, 112.0), vec3f(59.0, 73.0, 108.0), vec3f(87.0, 93.0, 109.0),
    vec3f(112.0, 113.0, 115.0), vec3f(138.0, 134.0, 120.0), vec3f(165.0, 156.0, 116.0),
    vec3f(195.0, 179.0, 105.0), vec3f(225.0, 204.0, 85.0), vec3f(254.0, 232.0, 56.0),
);

/// Colour of negative weights: magenta, which is not in cividis. Linear.
const NEGATIVE_COLOR = vec3f(0.68, 0.02, 0.28);
/// Weights below this value are drawn as negative; smaller deviations are rounding.
const NEGATIVE_THRESHOLD = -1e-5f;

/// Colour of a value in [0, 1], linear.
fn cividis(value: f32) -> vec3f {
    var stops = STOPS;
    let at = clamp(value, 0.0, 1.0) * 9.0;
    let below = min(u32(at), 8u);
    return linear_from_srgb(mix(stops[below], stops[below + 1u], at - f32(below)) / 255.0);
}
