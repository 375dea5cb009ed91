// Deformation: v' = sum of w_i(v) c_i' (Joshi et al. 2007, Eq. 1), written to the vertex buffer that is drawn. One
// invocation per bundle of 4 vertices, so that c_i' is read once for all four. Bundles are stored in slices of 8: first
// entry of each bundle, second entry of each bundle, and so on, so that adjacent invocations read adjacent entries.
// CPU: cagework_core::stencil::deform_vertices.

/// Number of vertices per bundle, which is the number of components of a vec4f.
const BUNDLE = 4u;
/// Number of bundles per slice.
const SLICE = 8u;

@group(0) @binding(0) var<uniform> work: Work;
/// First entry of each slice in `columns` and `weights`, divided by 8.
@group(0) @binding(1) var<storage, read> slices: array<u32>;
/// Index into `cage` of each entry. Entries that pad a bundle to the length of its slice have the weight 0.
@group(0) @binding(2) var<storage, read> columns: array<u32>;
/// Weights of the bundle's four vertices, one vec4f per entry.
@group(0) @binding(3) var<storage, read> weights: array<vec4f>;
@group(0) @binding(4) var<storage, read> cage: array<vec4f>;
@group(0) @binding(5) var<storage, read_write> positions: array<vec4f>;

@compute @workgroup_size(64)
fn deform_vertices(@builtin(global_invocation_id) id: vec3u) {
    let number = invocation(id, work.stride);
    if number >= work.count { return; }
    let slice = number / SLICE;
    let lane = number % SLICE;
    var x = vec4f(0.0);
    var y = vec4f(0.0);
    var z = vec4f(0.0);
    let end = slices[slice + 1u] * SLICE;
    for (var k = slices[slice] * SLICE + lane; k < end; k += SLICE) {
        let weight = weights[k];
        let c = cage[columns[k]].xyz;
        x += weight * c.x;
        y += weight * c.y;
        z += weight * c.z;
    }
    let first = work.first_row + number * BUNDLE;
    let last = min(first + BUNDLE, arrayLength(&positions));
    for (var v = first; v < last; v++) {
        let j = v - first;
        positions[v] = vec4f(x[j], y[j], z[j], 1.0);
    }
}
