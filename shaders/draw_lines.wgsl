// Draws anti-aliased segments with round ends and a constant width in pixels. Six vertices per segment.

struct Varying {
    @builtin(position) clip: vec4f,
    /// Offset from the segment's first point along and across the segment, pixels.
    @location(0) place: vec2f,
    @location(1) @interpolate(flat) length: f32,
    @location(2) @interpolate(flat) half_width: f32,
    @location(3) @interpolate(flat) color: vec4f,
}

@vertex
fn vertex(@builtin(vertex_index) index: u32) -> Varying {
    let item = item_at(index / 6u);
    let k = index % 6u;
    let state = item.x >> STATE_SHIFT;
    var a = clip_of(item.x & INDEX_MASK);
    var b = clip_of(item.y & INDEX_MASK);
    if state == HIDDEN_STATE || (a.z < 0.0 && b.z < 0.0) {
        return Varying(HIDDEN_POSITION, vec2f(0.0), 0.0, 0.0, vec4f(0.0));
    }
    // Clip the segment at the near plane.
    if a.z < 0.0 { a = mix(a, b, a.z / (a.z - b.z)); }
    if b.z < 0.0 { b = mix(b, a, b.z / (b.z - a.z)); }
    let pixels = 0.5 * camera.viewport;
    let from_a = (b.xy / b.w - a.xy / a.w) * pixels;
    let length = length(from_a);
    let along = select(vec2f(1.0, 0.0), from_a / max(length, 1e-6), length > 1e-6);
    let across = vec2f(-along.y, along.x);
    let half_width = 0.5 * state_width(state);
    // Extend the quad by half a pixel on each side for the anti-aliased edge.
    let reach = half_width + 0.5;
    let is_b = k == 1u || k == 3u || k == 5u;
    let up = select(-reach, reach, k == 2u || k == 3u || k == 4u);
    let beyond = select(-reach, reach, is_b);
    let own = select(a, b, is_b);
    let offset = (along * beyond + across * up) * camera.pixel;
    // Divide by w here, so that `place` is interpolated linearly on the screen. `@interpolate(linear)` would do the
    // same, but WebGL2 lacks it.
    let clip = vec4f(own.xy / own.w + offset, lifted(own).z / own.w, 1.0);
    return Varying(clip, vec2f(select(0.0, length, is_b) + beyond, up), length, half_width, state_color(state));
}

@fragment
fn fragment(in: Varying) -> @location(0) vec4f {
    let nearest = clamp(in.place.x, 0.0, in.length);
    let distance = length(vec2f(in.place.x - nearest, in.place.y));
    let cover = clamp(in.half_width + 0.5 - distance, 0.0, 1.0);
    if cover <= 0.0 { discard; }
    // The antialiased edge adds half a pixel on each side, so that a line thinner than a pixel has no gaps. Multiply its
    // alpha by its width, so that it still looks thin.
    return to_target(in.color.rgb, in.color.a * cover * min(1.0, 2.0 * in.half_width));
}
