// Draws one layer of the grid's cells, coloured by cell type or by a control's weights, with lines between cells. Draws
// one quad. slice_buffers.wgsl or slice_textures.wgsl provides the cells.

struct SliceView {
    /// Corner of the layer at its first cell, world space.
    corner: vec3f,
    /// Weight that the last colour of the colour map stands for; 0 to colour by cell type.
    high: f32,
    /// Edge vector of a cell along the layer's first axis, object units.
    u: vec3f,
    /// Number of cells along the first axis.
    n_u: u32,
    /// Edge vector of a cell along the layer's second axis, object units.
    v: vec3f,
    /// Number of cells along the second axis.
    n_v: u32,
    /// Colour of each cell type (untyped, boundary, interior, exterior), linear, straight alpha.
    kinds: array<vec4f, 4>,
    /// Colour of the lines between cells, linear, straight alpha.
    line_color: vec4f,
}

const EXTERIOR = 3u;

@group(1) @binding(0) var<uniform> slice: SliceView;

struct Varying {
    @builtin(position) clip: vec4f,
    @location(0) place: vec2f,
}

@vertex
fn vertex(@builtin(vertex_index) index: u32) -> Varying {
    let corner = vec2f(
        select(0.0, 1.0, index == 1u || index == 3u || index == 5u),
        select(0.0, 1.0, index == 2u || index == 3u || index == 4u),
    );
    let place = corner * vec2f(f32(slice.n_u), f32(slice.n_v));
    let world = slice.corner + place.x * slice.u + place.y * slice.v;
    return Varying(camera.clip_from_world * vec4f(world, 1.0), place);
}

@fragment
fn fragment(in: Varying) -> @location(0) vec4f {
    let slope = fwidth(in.place);
    let limit = vec2u(slice.n_u, slice.n_v) - 1u;
    let cell = min(vec2u(max(in.place, vec2f(0.0))), limit);
    let content = cell_at(cell.y * slice.n_u + cell.x);
    var color = slice.kinds[content.x & 3u];
    if slice.high > 0.0 && content.x != EXTERIOR {
        let value = bitcast<f32>(content.y);
        color = vec4f(cividis(value / slice.high), 1.0);
        if value < NEGATIVE_THRESHOLD { color = vec4f(NEGATIVE_COLOR, 1.0); }
    }
    let distance = abs(fract(in.place - 0.5) - 0.5) / max(slope, vec2f(1e-6));
    let covers = clamp(vec2f(0.5 * camera.scale + 0.5) - distance, vec2f(0.0), vec2f(1.0));
    // Fade out the lines if cells are only a few pixels wide.
    let visible = clamp(1.5 - 6.0 * max(slope.x, slope.y), 0.0, 1.0);
    let line = max(covers.x, covers.y) * visible * slice.line_color.a;
    // Discard exterior cells, so that the model and the cage behind them are visible.
    if content.x == EXTERIOR { discard; }
    return to_target(mix(color.rgb, slice.line_color.rgb, line), color.a);
}
