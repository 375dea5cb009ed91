// Draws the selected faces of the cage as translucent triangles. A triangle has two items: (state and first corner,
// second corner) and (third corner, unused). Three vertices per triangle.

struct Varying {
    @builtin(position) clip: vec4f,
    @location(0) @interpolate(flat) color: vec4f,
}

@vertex
fn vertex(@builtin(vertex_index) index: u32) -> Varying {
    let face = index / 3u;
    let k = index % 3u;
    let first = item_at(2u * face);
    let state = first.x >> STATE_SHIFT;
    if state == HIDDEN_STATE { return Varying(HIDDEN_POSITION, vec4f(0.0)); }
    var corner = first.x;
    if k == 1u { corner = first.y; }
    if k == 2u { corner = item_at(2u * face + 1u).x; }
    return Varying(lifted(clip_of(corner & INDEX_MASK)), state_color(state));
}

@fragment
fn fragment(in: Varying) -> @location(0) vec4f {
    return to_target(in.color.rgb, in.color.a);
}
