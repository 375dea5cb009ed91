// Deformation: v' = sum of w_i(v) c_i' (Joshi et al. 2007, Eq. 1), straight into the vertex buffer that is drawn.
// One invocation per vertex, from `first_row` on. Rows come in slices of 8 vertices, a slice's entries column by column,
// so that neighbouring invocations read neighbouring entries. Twin: cagework_core::stencil::deform_vertices.

/// Vertices in a slice.
const SLICE = 8u;

@group(0) @binding(0) var<uniform> work: Work;
/// Where each slice starts in `entries`, over 8.
@group(0) @binding(1) var<storage, read> slices: array<u32>;
/// (control vertex, bits of its weight); short rows end in weights of 0.
@group(0) @binding(2) var<storage, read> entries: array<vec2u>;
@group(0) @binding(3) var<storage, read> cage: array<vec4f>;
@group(0) @binding(4) var<storage, read_write> positions: array<vec4f>;

@compute @workgroup_size(64)
fn deform_vertices(@builtin(global_invocation_id) id: vec3u) {
    let number = invocation(id, work.stride);
    if number >= work.count { return; }
    let slice = number / SLICE;
    let lane = number % SLICE;
    var sum = vec3f(0.0);
    let end = slices[slice + 1u];
    for (var k = slices[slice]; k < end; k++) {
        let entry = entries[k * SLICE + lane];
        sum += bitcast<f32>(entry.y) * cage[entry.x].xyz;
    }
    positions[work.first_row + number] = vec4f(sum, 1.0);
}
