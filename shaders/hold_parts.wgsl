// Replaces deformed positions of fixed vertices and rigid pieces: a fixed vertex moves back towards its rest position,
// and a vertex of a rigid piece moves by the rigid motion of the piece. Runs in place after deform_vertices, one
// invocation per vertex. CPU: cagework_pose::parts::hold_parts.

@group(0) @binding(0) var<uniform> work: Work;
/// Rest position of each vertex, and the fraction of its displacement that is suppressed, 0 to 1.
@group(0) @binding(1) var<storage, read> rest: array<vec4f>;
/// Piece of each vertex, counted from 1; 0 for none.
@group(0) @binding(2) var<storage, read> piece_of: array<u32>;
/// Three rows of a matrix for each piece. A vertex of the piece with rest position x is displaced by rows * (x, 1).
@group(0) @binding(3) var<storage, read> motions: array<vec4f>;
@group(0) @binding(4) var<storage, read_write> positions: array<vec4f>;

@compute @workgroup_size(64)
fn hold_parts(@builtin(global_invocation_id) id: vec3u) {
    let v = invocation(id, work.stride);
    if v >= work.count { return; }
    let piece = piece_of[v];
    let stays = rest[v].w;
    if piece == 0u && stays == 0.0 { return; }
    let at = rest[v].xyz;
    var by = positions[v].xyz - at;
    if piece > 0u {
        let x = vec4f(at, 1.0);
        let row = 3u * (piece - 1u);
        by = vec3f(dot(motions[row], x), dot(motions[row + 1u], x), dot(motions[row + 2u], x));
    }
    positions[v] = vec4f(at + (1.0 - stays) * by, 1.0);
}
