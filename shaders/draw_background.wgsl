// Vertical background gradient. Noise of half an 8-bit colour step prevents visible bands. Draws one triangle.

struct Varying {
    @builtin(position) clip: vec4f,
    @location(0) height: f32,
}

@vertex
fn vertex(@builtin(vertex_index) index: u32) -> Varying {
    let corner = vec2f(f32(index & 1u), f32(index >> 1u)) * 4.0 - 1.0;
    return Varying(vec4f(corner, 1.0, 1.0), 0.5 + 0.5 * corner.y);
}

@fragment
fn fragment(in: Varying) -> @location(0) vec4f {
    let noise = fract(sin(dot(floor(in.clip.xy), vec2f(12.9898, 78.233))) * 43758.547) - 0.5;
    let t = clamp(in.height, 0.0, 1.0);
    let srgb = mix(
        srgb_from_linear(camera.background_bottom.rgb),
        srgb_from_linear(camera.background_top.rgb),
        t * t * (3.0 - 2.0 * t),
    );
    return to_target(linear_from_srgb(srgb + noise / 255.0), 1.0);
}
