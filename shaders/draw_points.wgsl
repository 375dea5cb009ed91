// Draws round points of constant size in pixels, with a rim. Six vertices per point.

struct Varying {
    @builtin(position) clip: vec4f,
    /// Offset from the centre, pixels. Interpolated linearly on the screen, because all corners have the same w.
    @location(0) place: vec2f,
    @location(1) @interpolate(flat) radius: f32,
    @location(2) @interpolate(flat) color: vec4f,
}

@vertex
fn vertex(@builtin(vertex_index) index: u32) -> Varying {
    let item = item_at(index / 6u);
    let k = index % 6u;
    let state = item.x >> STATE_SHIFT;
    let clip = clip_of(item.x & INDEX_MASK);
    if state == HIDDEN_STATE || clip.z < 0.0 {
        return Varying(HIDDEN_POSITION, vec2f(0.0), 0.0, vec4f(0.0));
    }
    let radius = 0.5 * state_width(state);
    let corner = vec2f(
        select(-1.0, 1.0, k == 1u || k == 3u || k == 5u),
        select(-1.0, 1.0, k == 2u || k == 3u || k == 4u),
    );
    let place = corner * (radius + 0.5);
    let moved = vec4f(clip.xy + place * camera.pixel * clip.w, clip.zw);
    return Varying(lifted(moved), place, radius, state_color(state));
}

@fragment
fn fragment(in: Varying) -> @location(0) vec4f {
    let distance = length(in.place);
    let cover = clamp(in.radius + 0.5 - distance, 0.0, 1.0);
    if cover <= 0.0 { discard; }
    let inner = in.radius - style.rim * style.size * camera.scale;
    let in_rim = clamp(distance - inner + 0.5, 0.0, 1.0);
    let color = mix(in.color, vec4f(style.rim_color.rgb, style.rim_color.a * style.opacity), in_rim);
    return to_target(color.rgb, color.a * cover);
}
