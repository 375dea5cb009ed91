// A vertex outside the cage keeps its rigid offset from the closest point on the cage, in that triangle's frame.
// One invocation per outside vertex. Twin: cagework_core::stencil::offset_outside.

@group(0) @binding(0) var<uniform> work: Work;
/// (mesh vertex, three cage vertices)
@group(0) @binding(1) var<storage, read> corners: array<vec4u>;
/// Offset in the frame (edge, in-plane normal to it, triangle normal), object units.
@group(0) @binding(2) var<storage, read> offsets: array<vec4f>;
@group(0) @binding(3) var<storage, read> cage: array<vec4f>;
@group(0) @binding(4) var<storage, read_write> positions: array<vec4f>;

@compute @workgroup_size(64)
fn offset_outside(@builtin(global_invocation_id) id: vec3u) {
    let number = invocation(id, work.stride);
    if number >= work.count { return; }
    let item = work.first + number;
    let corner = corners[item];
    let a = cage[corner.y].xyz;
    let ab = cage[corner.z].xyz - a;
    let n = cross(ab, cage[corner.w].xyz - a);
    var offset = offsets[item].xyz;
    // A triangle without area, which a pose may make, has no frame: the offset stays as it is.
    if dot(ab, ab) > 0.0 && dot(n, n) > 0.0 {
        let edge = normalize(ab);
        let normal = normalize(n);
        offset = edge * offset.x + cross(normal, edge) * offset.y + normal * offset.z;
    }
    positions[corner.x] += vec4f(offset, 0.0);
}
