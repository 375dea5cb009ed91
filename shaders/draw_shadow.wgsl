// Draws the mesh from above into the shadow map. Each texel stores how close the mesh is to the floor there. Where
// triangles overlap, blending keeps the value of the lowest one.

struct Varying {
    @builtin(position) clip: vec4f,
    @location(0) height: f32,
}

@vertex
fn vertex(@location(0) source: u32) -> Varying {
    let from_center = point_at(source) - camera.floor_center;
    let across = from_center.xz / (SHADOW_REACH * camera.floor_radius);
    return Varying(vec4f(across.x, -across.y, 0.5, 1.0), from_center.y / (SHADOW_HEIGHT * camera.floor_radius));
}

@fragment
fn fragment(in: Varying) -> @location(0) vec4f {
    return vec4f(exp(-max(0.0, in.height)));
}
