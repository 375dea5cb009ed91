// Draws the floor as one quad: the model's shadow, and a grid over it. Both fade out with the distance from the centre.
// Every tenth line of the grid is stronger, and the x and z axes are coloured.

/// Colours of the x and z axes, linear.
const X_COLOR = vec3f(0.55, 0.07, 0.09);
const Z_COLOR = vec3f(0.06, 0.20, 0.62);

/// Maximum fraction of the floor's light that the shadow removes.
const SHADOW_STRENGTH = 0.55;

@group(1) @binding(0) var shadow_map: texture_2d<f32>;
@group(1) @binding(1) var shadow_sampler: sampler;

struct Varying {
    @builtin(position) clip: vec4f,
    @location(0) world: vec3f,
}

@vertex
fn vertex(@builtin(vertex_index) index: u32) -> Varying {
    let corner = vec2f(
        select(-1.0, 1.0, index == 1u || index == 3u || index == 5u),
        select(-1.0, 1.0, index == 2u || index == 3u || index == 4u),
    ) * camera.floor_radius;
    let world = camera.floor_center + vec3f(corner.x, 0.0, corner.y);
    return Varying(camera.clip_from_world * vec4f(world, 1.0), world);
}

/// Coverage of a pixel, 0 to 1, by the lines at integer x and by those at integer y. `slope`: change of `at` per pixel;
/// `width`: width of the lines, pixels.
fn lines(at: vec2f, slope: vec2f, width: f32) -> vec2f {
    let distance = abs(fract(at - 0.5) - 0.5) / max(slope, vec2f(1e-6));
    let cover = clamp(vec2f(0.5 * width + 0.5) - distance, vec2f(0.0), vec2f(1.0));
    // Fade out lines that are only a few pixels apart.
    return cover * clamp(1.4 - 4.0 * slope, vec2f(0.0), vec2f(1.0));
}

/// Interpolates the shadow map at `at`, 0 to 1 across the map, by cubic B-splines from four linear samples.
fn shadow_at(at: vec2f) -> f32 {
    let size = vec2f(textureDimensions(shadow_map));
    let place = at * size - 0.5;
    let f = fract(place);
    let g = 1.0 - f;
    // Weights of the four pixels along each axis. A linear sample between the first two pixels, at `low`, gives the
    // weighted mean of these two; a linear sample between the last two, at `high`, gives the weighted mean of the last
    // two.
    let w0 = g * g * g / 6.0;
    let w1 = (4.0 - 6.0 * f * f + 3.0 * f * f * f) / 6.0;
    let w3 = f * f * f / 6.0;
    let first = w0 + w1;
    let last = 1.0 - first;
    let low = (floor(place) - 0.5 + w1 / first) / size;
    let high = (floor(place) + 1.5 + w3 / last) / size;
    let top = mix(sample_at(vec2f(high.x, low.y)), sample_at(low), first.x);
    let bottom = mix(sample_at(high), sample_at(vec2f(low.x, high.y)), first.x);
    return mix(bottom, top, first.y);
}

fn sample_at(at: vec2f) -> f32 {
    return textureSampleLevel(shadow_map, shadow_sampler, at, 0.0).x;
}

@fragment
fn fragment(in: Varying) -> @location(0) vec4f {
    let at = in.world.xz / camera.floor_spacing;
    let slope = fwidth(at);
    let width = camera.scale;
    let fine = lines(at, slope, width);
    let coarse = lines(0.1 * at, 0.1 * slope, width);
    var alpha = max(0.36 * max(fine.x, fine.y), max(coarse.x, coarse.y)) * camera.floor_color.a;
    var color = camera.floor_color.rgb;
    // The line x = 0 is the z axis, and the line z = 0 is the x axis.
    let axes = clamp(vec2f(width) - abs(at) / max(slope, vec2f(1e-6)), vec2f(0.0), vec2f(1.0));
    if axes.x > 0.0 { color = mix(color, Z_COLOR, axes.x); alpha = max(alpha, 0.75 * axes.x); }
    if axes.y > 0.0 { color = mix(color, X_COLOR, axes.y); alpha = max(alpha, 0.75 * axes.y); }
    let distance = length(in.world - camera.floor_center) / camera.floor_radius;
    let fade = 1.0 - smoothstep(0.15, 1.0, distance);
    let steep = clamp(6.0 * abs(dot(to_eye(in.world), vec3f(0.0, 1.0, 0.0))), 0.0, 1.0);
    alpha *= fade * steep;
    let across = (in.world - camera.floor_center).xz / (SHADOW_REACH * camera.floor_radius);
    let from_center = max(abs(across.x), abs(across.y));
    var shadow = 0.0;
    // From below, the floor is transparent.
    if from_center < 1.0 && to_eye(in.world).y > 0.0 {
        let border = 1.0 - smoothstep(0.8, 1.0, from_center);
        shadow = SHADOW_STRENGTH * border * shadow_at(0.5 + 0.5 * across);
    }
    if max(alpha, shadow) <= 0.002 { discard; }
    // Blend the grid over the shadow, which is black.
    return to_target(color, alpha) + vec4f(0.0, 0.0, 0.0, (1.0 - alpha) * shadow);
}
