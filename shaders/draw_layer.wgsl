// Blends the layer of splats, which draw_splats.wgsl has drawn, over the picture. The layer's colours are in sRGB and
// multiplied by alpha in sRGB. Draws one triangle.

@group(1) @binding(0) var layer: texture_2d<f32>;

@vertex
fn vertex(@builtin(vertex_index) index: u32) -> @builtin(position) vec4f {
    let corner = vec2f(f32(index & 1u), f32(index >> 1u));
    return vec4f(4.0 * corner - 1.0, 0.0, 1.0);
}

@fragment
fn fragment(@builtin(position) at: vec4f) -> @location(0) vec4f {
    let pixel = textureLoad(layer, vec2u(at.xy), 0);
    if pixel.a <= 0.0 { discard; }
    return to_target(linear_from_srgb(pixel.rgb / pixel.a), pixel.a);
}
