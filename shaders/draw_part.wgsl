// Draws a texture into the viewport as one triangle. Composes pictures on WebGL2 canvases, to which textures cannot
// be copied.

@group(1) @binding(0) var picture: texture_2d<f32>;

struct Varying {
    @builtin(position) clip: vec4f,
    /// Texture coordinates from the upper left corner, 0 to 1.
    @location(0) place: vec2f,
}

@vertex
fn vertex(@builtin(vertex_index) index: u32) -> Varying {
    let corner = vec2f(f32(index & 1u), f32(index >> 1u)) * 2.0;
    return Varying(vec4f(2.0 * corner.x - 1.0, 1.0 - 2.0 * corner.y, 0.0, 1.0), corner);
}

@fragment
fn fragment(in: Varying) -> @location(0) vec4f {
    let size = textureDimensions(picture);
    let pixel = min(vec2u(in.place * vec2f(size)), size - 1u);
    return textureLoad(picture, pixel, 0);
}
