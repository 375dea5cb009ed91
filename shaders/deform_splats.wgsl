// Deforms splats by the cage's displacement field u: centres move by u, and covariances S become F S F^T, where F = I +
// du/dx. Both u and F are interpolated trilinearly between the nodes of the lattice. F at a node comes from differences
// of u, as in Field::node_gradients. One invocation per splat. CPU: cagework_core::splats::deform_splats.
//
// A splat has three rows: its centre and 0, or FLOATER for a floater; the entries xx, xy, xz, yy of its covariance; and
// the entries yz, zz. A posed splat also has a turn, a vector: its x and y follow zz, and its z is added to the fourth
// entry of the centre. MIRROR is added to its x if the splat is mirrored; the turn is then that of -F. The turn is 0 at
// rest, and without spherical harmonics, which need it.

@group(0) @binding(0) var<uniform> work: Work;
@group(0) @binding(2) var<storage, read> rest: array<vec4f>;
@group(0) @binding(3) var<storage, read_write> splats: array<vec4f>;

/// Value of `Work::mode`: also compute the turns.
const ROTATIONS = 1u;
/// Added to the first entry of the turn of a mirrored splat.
const MIRROR: f32 = 4.0;
/// Number of Newton steps. Five suffice if the singular values are within a factor of 10 of each other; the other five
/// are for stronger deformations.
const STEPS = 10u;

/// Finds the orthogonal matrix nearest to `f` by Newton's method on R = (R + R^-T) / 2 (Higham 1986, "Computing the
/// polar decomposition"). Returns the identity if the determinant of `f` is 0. CPU: cagework_core::splats::turn_of.
fn turn_of(f: mat3x3f) -> mat3x3f {
    let size = determinant(f);
    if size == 0.0 { return mat3x3f(1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0); }
    var r = pow(abs(size), -1.0 / 3.0) * f;
    for (var k = 0u; k < STEPS; k += 1u) {
        let cofactors = mat3x3f(cross(r[1], r[2]), cross(r[2], r[0]), cross(r[0], r[1]));
        r = 0.5 * (r + (1.0 / determinant(r)) * cofactors);
    }
    return r;
}

/// A rotation as a vector: its axis times tan(angle / 4), at most of length 1. The quaternion is the normalised longest
/// row of 4 q q^T, whose entries are sums of entries of `r`.
fn turn_vector(r: mat3x3f) -> vec3f {
    let trace = r[0].x + r[1].y + r[2].z;
    let by_w = vec3f(r[1].z - r[2].y, r[2].x - r[0].z, r[0].y - r[1].x);
    let squares = 1.0 + 2.0 * vec3f(r[0].x, r[1].y, r[2].z) - trace;
    let products = vec3f(r[1].z + r[2].y, r[2].x + r[0].z, r[0].y + r[1].x);
    var q = vec4f(by_w, 1.0 + trace);
    if trace < 0.0 {
        if squares.x >= max(squares.y, squares.z) {
            q = vec4f(squares.x, products.z, products.y, by_w.x);
        } else if squares.y >= squares.z {
            q = vec4f(products.z, squares.y, products.x, by_w.y);
        } else {
            q = vec4f(products.y, products.x, squares.z, by_w.z);
        }
    }
    q = normalize(select(q, -q, q.w < 0.0));
    return q.xyz / (1.0 + q.w);
}

/// Derivative of u at node `k` along an axis, by central differences. A neighbour beyond the end of the lattice is
/// replaced by the node itself; at a bound node, also a neighbour that is not bound. `at`: coordinate of the node along
/// the axis; `n`: number of nodes along it; `step`: index difference of neighbours.
fn slope(k: u32, at: u32, n: u32, step: u32, is_bound: bool) -> vec3f {
    var before = k;
    var after = k;
    if at > 0u && (!is_bound || field.values[k - step].w > 0.0) { before = k - step; }
    if at + 1u < n && (!is_bound || field.values[k + step].w > 0.0) { after = k + step; }
    let n_cells = f32(u32(before != k) + u32(after != k));
    return (field.values[after] - field.values[before]).xyz / (field.cell * max(n_cells, 1.0));
}

@compute @workgroup_size(64)
fn deform_splats(@builtin(global_invocation_id) id: vec3u) {
    let splat = invocation(id, work.stride);
    if splat >= work.count { return; }
    let center = rest[3u * splat];
    let low = rest[3u * splat + 1u];
    let high = rest[3u * splat + 2u];
    var by = vec3f(0.0);
    var f = mat3x3f(1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0);
    let at = (center.xyz - field.origin) / field.cell;
    // Splats outside the lattice do not move.
    if all(at >= vec3f(0.0)) && all(at <= vec3f(field.dims - 1u)) {
        let place = place_in_lattice(center.xyz);
        for (var c = 0u; c < 8u; c += 1u) {
            let side = vec3u(c & 1u, (c >> 1u) & 1u, c >> 2u);
            let node = place.corner + side;
            let share = select(1.0 - place.share, place.share, side == vec3u(1u));
            let weight = share.x * share.y * share.z;
            let k = index_of(node);
            let value = field.values[k];
            let is_bound = value.w > 0.0;
            by += weight * value.xyz;
            f += weight * mat3x3f(
                slope(k, node.x, field.dims.x, 1u, is_bound),
                slope(k, node.y, field.dims.y, field.dims.x, is_bound),
                slope(k, node.z, field.dims.z, field.dims.x * field.dims.y, is_bound),
            );
        }
    }
    let covariance = mat3x3f(low.x, low.y, low.z, low.y, low.w, high.x, low.z, high.x, high.y);
    let bent = f * covariance * transpose(f);
    var turn = vec3f(0.0);
    if work.mode == ROTATIONS {
        let by_mirror = determinant(f) < 0.0;
        turn = turn_vector(select(1.0, -1.0, by_mirror) * turn_of(f));
        if by_mirror { turn.x += MIRROR; }
    }
    splats[3u * splat] = vec4f(center.xyz + by, center.w + turn.z);
    splats[3u * splat + 1u] = vec4f(bent[0], bent[1].y);
    splats[3u * splat + 2u] = vec4f(bent[1].z, bent[2].z, turn.xy);
}
