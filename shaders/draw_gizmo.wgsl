// Draws the transform gizmo. Faces seen at a grazing angle are darker.

struct GizmoView {
    /// Transformation from gizmo space, in which the axes have length 1, to world space.
    world_from_gizmo: mat4x4f,
}

@group(1) @binding(0) var<uniform> gizmo: GizmoView;

struct Varying {
    @builtin(position) clip: vec4f,
    @location(0) normal: vec3f,
    @location(1) color: vec4f,
}

@vertex
fn vertex(@location(0) position: vec3f, @location(1) normal: vec3f, @location(2) color: vec4f) -> Varying {
    let world = gizmo.world_from_gizmo * vec4f(position, 1.0);
    let clip = camera.clip_from_world * world;
    let turned = camera.view_from_world * gizmo.world_from_gizmo * vec4f(normal, 0.0);
    return Varying(clip, turned.xyz, color);
}

@fragment
fn fragment(in: Varying) -> @location(0) vec4f {
    let square = dot(in.normal, in.normal);
    var light = 1.0;
    if square > 0.0 { light = 0.78 + 0.22 * abs(in.normal.z) * inverseSqrt(square); }
    return to_target(in.color.rgb * light, in.color.a);
}
