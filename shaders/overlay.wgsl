// Shared by the shaders that draw lines, points and faces over the model: their style, and functions that place them.
// overlay_buffers.wgsl or overlay_textures.wgsl declares positions and items.

struct Style {
    /// Colour of each state, linear, straight alpha.
    colors: array<vec4f, 8>,
    /// Line width or point diameter for each state, CSS pixels: states 0 to 3, then 4 to 7.
    widths: array<vec4f, 2>,
    /// Colour of the rim of points, linear, straight alpha.
    rim_color: vec4f,
    /// Width of the rim of points, CSS pixels.
    rim: f32,
    /// Offset towards the eye, as a fraction of the view depth, so that lines on a surface appear in front of it.
    lift: f32,
    /// Factor for the alpha of all colours.
    opacity: f32,
    /// Factor for all widths, the rim's included.
    size: f32,
}

/// The upper four bits of an item's first word are its state, the lower 28 bits the index of its first vertex.
const STATE_SHIFT = 28u;
const INDEX_MASK = 0x0fffffffu;
/// State of items that are not drawn.
const HIDDEN_STATE = 15u;

@group(1) @binding(0) var<uniform> style: Style;

/// Colour of items in a state, including the style's opacity.
fn state_color(state: u32) -> vec4f {
    let color = style.colors[state & 7u];
    return vec4f(color.rgb, color.a * style.opacity);
}

/// Width of items in a state, pixels of the render target.
fn state_width(state: u32) -> f32 {
    return style.widths[(state >> 2u) & 1u][state & 3u] * style.size * camera.scale;
}

/// Clip coordinates of a vertex.
fn clip_of(index: u32) -> vec4f {
    return camera.clip_from_world * vec4f(point_at(index), 1.0);
}

/// Moves a position towards the eye by the style's `lift`.
fn lifted(clip: vec4f) -> vec4f {
    return vec4f(clip.xy, max(0.0, clip.z - style.lift * camera.lift), clip.w);
}
