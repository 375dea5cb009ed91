// Camera parameters and colour conversions of all draw shaders. Mirrored by cagework_gpu::render::layout::Camera.

struct Camera {
    clip_from_world: mat4x4f,
    view_from_world: mat4x4f,
    /// Position of the eye, world space, object units.
    eye: vec3f,
    /// 1: perspective, 0: orthographic.
    perspective: f32,
    /// Width and height of the render target, pixels.
    viewport: vec2f,
    /// Pixels of the target per CSS pixel.
    scale: f32,
    /// 1 if shaders must convert colours to sRGB, because the render target stores values unchanged; otherwise 0.
    encode: u32,
    /// Colours of the background at the top and the bottom, linear.
    background_top: vec4f,
    background_bottom: vec4f,
    /// Colour of the floor grid, linear, straight alpha.
    floor_color: vec4f,
    /// Centre of the floor, world space.
    floor_center: vec3f,
    /// Distance from the centre at which the floor has faded out, object units.
    floor_radius: f32,
    /// Spacing of the grid lines, object units.
    floor_spacing: f32,
    /// Decrease of a position's clip z per relative decrease of its view depth, see `lifted` in overlay.wgsl.
    lift: f32,
    /// Width and height of a pixel of the render target, clip space.
    pixel: vec2f,
}

@group(0) @binding(0) var<uniform> camera: Camera;

/// A position outside the clip volume, for hidden primitives.
const HIDDEN_POSITION = vec4f(0.0, 0.0, 2.0, 1.0);

/// Converts a linear colour to sRGB (IEC 61966-2-1).
fn srgb_from_linear(linear: vec3f) -> vec3f {
    let low = 12.92 * linear;
    let high = 1.055 * pow(max(linear, vec3f(1e-5)), vec3f(1.0 / 2.4)) - 0.055;
    return select(high, low, linear <= vec3f(0.0031308));
}

/// Converts an sRGB colour to linear.
fn linear_from_srgb(srgb: vec3f) -> vec3f {
    let high = pow((srgb + 0.055) / 1.055, vec3f(2.4));
    return select(high, srgb / 12.92, srgb <= vec3f(0.04045));
}

/// Colour to write to the render target: multiplied by alpha, and converted to sRGB if the target does not do that.
fn to_target(linear: vec3f, alpha: f32) -> vec4f {
    var color = clamp(linear, vec3f(0.0), vec3f(1.0));
    if camera.encode == 1u { color = srgb_from_linear(color); }
    return vec4f(color * alpha, alpha);
}

/// Unit vector from a point to the eye, world space.
fn to_eye(point: vec3f) -> vec3f {
    let backward = vec3f(camera.view_from_world[0].z, camera.view_from_world[1].z, camera.view_from_world[2].z);
    return normalize(select(backward, camera.eye - point, camera.perspective == 1.0));
}
