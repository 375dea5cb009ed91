// Draws the mesh with its material, in plain clay, or coloured by weights or errors, in studio light. mesh_buffers.wgsl
// or mesh_textures.wgsl provides the vertices.

struct Surface {
    /// Factor of vertex colour and texture, linear RGBA. For CLAY, the colour itself.
    base_color: vec4f,
    /// Source of the colour: MATERIAL, WEIGHTS, ERRORS, CLAY or ALPHA_BLENDING.
    mode: u32,
    /// Fragments with an alpha below this are discarded.
    alpha_cutoff: f32,
    /// WEIGHTS: weight of the colour map's first colour. ERRORS: base-10 logarithm of the error of the first colour.
    /// Other modes: 1 to blend colours towards PAINT_COLOR, 0 to blend them towards grey.
    low: f32,
    /// WEIGHTS and ERRORS: like `low`, for the last colour. Other modes: 1 to blend by the values of the vertices, 0 to
    /// leave colours unchanged.
    high: f32,
}

const MATERIAL = 0u;
const WEIGHTS = 1u;
const ERRORS = 2u;
const CLAY = 3u;
const ALPHA_BLENDING = 4u;

/// At a vertex value of 1, blending towards grey replaces the share GREY_DESATURATION of a colour by a grey of
/// GREY_BRIGHTNESS times the colour's luminance.
const GREY_BRIGHTNESS = 0.7;
const GREY_DESATURATION = 0.8;

/// Colour that marks painted vertices, linear, and the fraction of the material's colour that it replaces at a vertex
/// value of 1.
const PAINT_COLOR = vec3f(0.04, 0.19, 0.86);
const PAINT_COVER = 0.72;

@group(2) @binding(0) var<uniform> surface: Surface;
@group(2) @binding(1) var base_texture: texture_2d<f32>;
@group(2) @binding(2) var base_sampler: sampler;

struct Varying {
    @builtin(position) clip: vec4f,
    // Without centroid interpolation, normals are extrapolated at outlines and may face away from the eye.
    @location(0) @interpolate(perspective, centroid) world: vec3f,
    @location(1) @interpolate(perspective, centroid) normal: vec3f,
    @location(2) uv: vec2f,
    @location(3) color: vec4f,
    @location(4) value: f32,
}

@vertex
fn vertex(@location(0) source: u32, @location(1) uv: vec2f, @location(2) color: vec4f) -> Varying {
    let world = point_at(source);
    let clip = camera.clip_from_world * vec4f(world, 1.0);
    return Varying(clip, world, normal_at(source), uv, color, value_at(source));
}

/// Colour of a weight or an error, linear.
fn value_color(value: f32) -> vec3f {
    if surface.mode == ERRORS {
        let digits = log(max(value, 1e-20)) / log(10.0);
        return cividis((digits - surface.low) / (surface.high - surface.low));
    }
    if value < NEGATIVE_THRESHOLD { return NEGATIVE_COLOR; }
    return cividis((value - surface.low) / (surface.high - surface.low));
}

@fragment
fn fragment(in: Varying, @builtin(front_facing) is_front: bool) -> @location(0) vec4f {
    // Compute derivatives before branches, because they need complete 2x2 quads.
    let texel = textureSample(base_texture, base_sampler, in.uv);
    let flat_normal = cross(dpdx(in.world), dpdy(in.world));
    var base = surface.base_color * in.color * texel;
    if base.a < surface.alpha_cutoff { discard; }
    let is_value = surface.mode == WEIGHTS || surface.mode == ERRORS;
    if is_value { base = vec4f(value_color(in.value), 1.0); }
    if surface.mode == CLAY { base = surface.base_color; }
    if surface.mode == MATERIAL { base.a = 1.0; }
    if !is_value {
        let grey = dot(base.rgb, vec3f(0.2126, 0.7152, 0.0722));
        let greyed = vec4f(vec3f(GREY_BRIGHTNESS * grey), GREY_DESATURATION);
        let over = select(greyed, vec4f(PAINT_COLOR, PAINT_COVER), surface.low == 1.0);
        let strength = over.a * surface.high * clamp(in.value, 0.0, 1.0);
        base = vec4f(mix(base.rgb, over.rgb, strength), base.a);
    }
    var normal = in.normal;
    // Light both sides of a triangle. The vertex normal is zero if all triangles of a vertex have no area: use the
    // normal of the drawn triangle instead.
    if !is_front { normal = -normal; }
    if dot(normal, normal) < 1e-6 { normal = faceForward(flat_normal, -to_eye(in.world), flat_normal); }
    if dot(normal, normal) < 1e-30 { normal = to_eye(in.world); }
    var lit = studio_light(base.rgb, in.world, normalize(normal));
    // Shade colours of weights and errors weakly, so that they match the legend.
    if is_value { lit = mix(lit, base.rgb, 0.35); }
    return to_target(lit, base.a);
}
