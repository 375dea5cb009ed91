// Skinning: v' = sum of w_j M_j (p + sum of t_k d_k) (glTF 2.0, sections 3.7.2.2 and 3.7.3.3), written to the vertex
// buffer that is drawn. One invocation per vertex. CPU: cagework_core::skin::skin_vertices.

struct Influence { joint: u32, weight: f32 }
struct Delta { target_index: u32, x: f32, y: f32, z: f32 }

@group(0) @binding(0) var<uniform> work: Work;
/// Rest positions in mesh space, without morph targets.
@group(0) @binding(1) var<storage, read> rest: array<vec4f>;
/// Index of each vertex's first entry in `influences` and in `deltas`. `[n_vertices + 1]`
@group(0) @binding(2) var<storage, read> starts: array<vec2u>;
@group(0) @binding(3) var<storage, read> influences: array<Influence>;
@group(0) @binding(4) var<storage, read> deltas: array<Delta>;
/// For each joint, the matrix from mesh space to world space.
@group(0) @binding(5) var<storage, read> palette: array<mat4x4f>;
/// Current weights t_k of the morph targets. `[n_targets]`
@group(0) @binding(6) var<storage, read> targets: array<f32>;
@group(0) @binding(7) var<storage, read_write> positions: array<vec4f>;

@compute @workgroup_size(64)
fn skin_vertices(@builtin(global_invocation_id) id: vec3u) {
    let v = invocation(id, work.stride);
    if v >= work.count { return; }
    let begin = starts[v];
    let end = starts[v + 1u];
    var p = rest[v].xyz;
    for (var k = begin.y; k < end.y; k++) {
        let delta = deltas[k];
        p += targets[delta.target_index] * vec3f(delta.x, delta.y, delta.z);
    }
    var sum = vec3f(0.0);
    for (var k = begin.x; k < end.x; k++) {
        let influence = influences[k];
        sum += influence.weight * (palette[influence.joint] * vec4f(p, 1.0)).xyz;
    }
    positions[v] = vec4f(sum, 1.0);
}
