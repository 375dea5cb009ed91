//! Intersection of triangles of one surface, apart from shared vertices and edges.
//!
//! Triangles without common vertices meet if they are at most the distance `gap` apart (separating axes). Triangles
//! with one common vertex meet if they also touch elsewhere, and triangles with a common edge if they are folded onto
//! each other.

use std::ops::ControlFlow;

use glam::DVec3;

/// Sine of the angle between a direction and a plane below which the direction lies in the plane: far above f64
/// rounding, far below the resolution of f32 coordinates.
const PLANE_TOLERANCE: f64 = 1e-7;

/// Distance below which triangles touch, as a fraction of their size: f64 rounding with a margin.
const TOUCH_TOLERANCE: f64 = 1e-10;

/// Cosine of the angle between two faces with a common edge, above which they are folded (2 degrees).
const MAX_FOLD_COSINE: f64 = 0.9994;

/// Limit on the pairs that [`meeting`] lists, against memory exhaustion.
const MAX_PAIRS: usize = 100_000;

/// Limit on comparisons of boxes in a search, 540 million, which take some seconds. A search reaches it if 40,000
/// triangles all meet, which have 800 million pairs.
const MAX_COMPARISONS: u64 = 1 << 29;

/// Cost of an intersection test of triangles, in comparisons of boxes.
const COMPARISONS_PER_TRIANGLE_TEST: u64 = 40;

/// A triangle with the vertex indices of its corners.
#[derive(Clone, Copy, Debug)]
pub struct Corners {
    /// Vertex indices, distinct.
    pub index: [u32; 3],
    /// Positions of the corners.
    pub at: [DVec3; 3],
}

impl Corners {
    /// Corner of the bounding box with the smallest coordinates.
    pub fn min(&self) -> DVec3 {
        self.at[0].min(self.at[1]).min(self.at[2])
    }

    /// Corner of the bounding box with the largest coordinates.
    pub fn max(&self) -> DVec3 {
        self.at[0].max(self.at[1]).max(self.at[2])
    }

    /// Normal, not normalised: its length is twice the area.
    pub fn normal(&self) -> DVec3 {
        (self.at[1] - self.at[0]).cross(self.at[2] - self.at[0])
    }

    /// Cosine between the normals of this triangle and another one, if they share an edge.
    pub fn fold_cosine(&self, other: &Self) -> Option<f64> {
        let shared = self.index.iter().filter(|i| other.index.contains(i)).count();
        (shared == 2).then(|| self.normal().normalize_or_zero().dot(other.normal().normalize_or_zero()))
    }

    /// Returns the triangle with a vertex moved to `at`.
    pub fn with_corner(&self, vertex: u32, at: DVec3) -> Self {
        let mut moved = *self;
        for (i, p) in moved.index.iter().zip(&mut moved.at) {
            if *i == vertex {
                *p = at;
            }
        }
        moved
    }

    /// Returns the corners in cyclic order from corner `k`.
    fn turned_to(&self, k: usize) -> [DVec3; 3] {
        [self.at[k], self.at[(k + 1) % 3], self.at[(k + 2) % 3]]
    }
}

/// Whether two triangles of a surface meet outside their common vertices and edges. Triangles without common vertices
/// also meet if they are at most `gap` apart.
pub fn meet(a: &Corners, b: &Corners, gap: f64) -> bool {
    debug_assert!([a, b].iter().all(|Corners { index: [i, j, k], .. }| i != j && j != k && k != i));
    let mut shared = [(0, 0); 3];
    let mut n = 0;
    for (i, va) in a.index.iter().enumerate() {
        if let Some(j) = b.index.iter().position(|vb| vb == va) {
            shared[n] = (i, j);
            n += 1;
        }
    }
    match n {
        0 => !are_apart(&a.at, &b.at, gap),
        1 => cones_meet(a.turned_to(shared[0].0), b.turned_to(shared[0].1)),
        2 => {
            let tip = |c: &Corners, i: usize, j: usize| c.at[3 - i - j];
            let (edge_a, edge_b) = (a.at[shared[0].0], a.at[shared[1].0]);
            let tips = [tip(a, shared[0].0, shared[1].0), tip(b, shared[0].1, shared[1].1)];
            is_folded(edge_a, edge_b, tips)
        }
        _ => true,
    }
}

/// Returns a sort key by `x` (`f64::total_cmp`), then by `number`. It is a `[u32; 3]`, which the crate also sorts
/// elsewhere: the sort of another type would be compiled separately and add 2 kB to the wasm module.
fn ascending(x: f64, number: u32) -> [u32; 3] {
    let bits = x.to_bits();
    let key = if bits >> 63 == 1 { !bits } else { bits | 1 << 63 };
    [(key >> 32) as u32, key as u32, number]
}

/// Lists the pairs of triangles of one surface that [`meet`], each once, in order; at most 100,000.
pub fn meeting(triangles: &[Corners]) -> Vec<[u32; 2]> {
    let mut pairs = Vec::new();
    each_meeting(triangles, |pair| {
        pairs.push(pair);
        if pairs.len() < MAX_PAIRS { ControlFlow::Continue(()) } else { ControlFlow::Break(()) }
    });
    pairs.sort_unstable();
    pairs
}

/// Calls `each` with every pair of triangles of one surface that [`meet`], smaller index first. Returns whether the
/// search was complete: it stops if `each` breaks, or after 2^29 comparisons.
///
/// Sorts the triangles by x and compares each with those whose ranges of x overlap: `O(n log n + n a)`, where `a` is
/// their mean number, about `sqrt(n)` on an evenly tessellated surface.
pub fn each_meeting(triangles: &[Corners], mut each: impl FnMut([u32; 2]) -> ControlFlow<()>) -> bool {
    let mut order: Vec<[u32; 3]> = (0u32..).zip(triangles).map(|(t, c)| ascending(c.min().x, t)).collect();
    order.sort_unstable();
    let mut active: Vec<u32> = Vec::new();
    let mut comparisons = 0;
    for [.., t] in order {
        let from = triangles[t as usize].min().x;
        comparisons += 2 * active.len() as u64;
        active.retain(|&other| triangles[other as usize].max().x >= from);
        let corners = &triangles[t as usize];
        let (min, max) = (corners.min(), corners.max());
        for &other in &active {
            let rival = &triangles[other as usize];
            if rival.min().cmpgt(max).any() || rival.max().cmplt(min).any() {
                continue;
            }
            comparisons += COMPARISONS_PER_TRIANGLE_TEST;
            if meet(corners, rival, 0.0) && each([t.min(other), t.max(other)]).is_break() {
                return false;
            }
        }
        if comparisons > MAX_COMPARISONS {
            return false;
        }
        active.push(t);
    }
    true
}

/// Whether a separating axis puts two triangles more than `gap` apart. Exact for a gap of 0 (touching counts as
/// meeting). With a gap, the test may return false for triangles that are farther apart, if their closest points are
/// both corners.
fn are_apart(a: &[DVec3; 3], b: &[DVec3; 3], gap: f64) -> bool {
    // Relative coordinates keep precision if the triangles are far from the origin.
    let origin = a[0];
    let (a, b) = (&a.map(|p| p - origin), &b.map(|p| p - origin));
    let size = a.iter().chain(b).fold(0.0, |m: f64, p| m.max(p.abs().max_element()));
    let gap = gap + TOUCH_TOLERANCE * size;
    let separates = |axis: DVec3| {
        let margin = gap * axis.length();
        let (p, q) = (a.map(|x| axis.dot(x)), b.map(|x| axis.dot(x)));
        let (p_min, p_max) = (p[0].min(p[1]).min(p[2]), p[0].max(p[1]).max(p[2]));
        let (q_min, q_max) = (q[0].min(q[1]).min(q[2]), q[0].max(q[1]).max(q[2]));
        p_min - q_max > margin || q_min - p_max > margin
    };
    let edges = |t: &[DVec3; 3]| [t[1] - t[0], t[2] - t[1], t[0] - t[2]];
    let (ea, eb) = (edges(a), edges(b));
    let (na, nb) = (ea[0].cross(ea[1]), eb[0].cross(eb[1]));
    separates(na)
        || separates(nb)
        || ea.iter().any(|&u| eb.iter().any(|&w| separates(u.cross(w))))
        || ea.iter().any(|&u| separates(na.cross(u)))
        || eb.iter().any(|&w| separates(nb.cross(w)))
}

/// Whether two triangles with the same first corner also meet elsewhere: whether the cones spanned by their edges from
/// this corner share a direction.
fn cones_meet(a: [DVec3; 3], b: [DVec3; 3]) -> bool {
    let (a, b) = ([a[1] - a[0], a[2] - a[0]], [b[1] - b[0], b[2] - b[0]]);
    let (na, nb) = (a[0].cross(a[1]), b[0].cross(b[1]));
    enters(a, b, nb) || enters(b, a, na)
}

/// Whether a direction in the cone of `a` and in the plane of `b` (normal `nb`) lies in the cone of `b`.
fn enters(a: [DVec3; 2], b: [DVec3; 2], nb: DVec3) -> bool {
    let limit = |d: DVec3| PLANE_TOLERANCE * d.length() * nb.length();
    let height = a.map(|d| nb.dot(d));
    let flat = [0, 1].map(|k| height[k].abs() <= limit(a[k]));
    if (0..2).any(|k| flat[k] && is_in_cone(a[k], b, nb)) {
        return true;
    }
    if flat[0] || flat[1] || (height[0] > 0.0) == (height[1] > 0.0) {
        return false;
    }
    let crossing = a[0] + (a[1] - a[0]) * (height[0] / (height[0] - height[1]));
    is_in_cone(crossing, b, nb)
}

/// Whether a direction in the plane of a cone lies in the cone or on its boundary.
fn is_in_cone(d: DVec3, b: [DVec3; 2], nb: DVec3) -> bool {
    let limit = -PLANE_TOLERANCE * d.length() * nb.length();
    nb.dot(b[0].cross(d)) >= limit * b[0].length() && nb.dot(d.cross(b[1])) >= limit * b[1].length()
}

/// Whether two faces with the common edge `p`-`q` are folded onto each other.
fn is_folded(p: DVec3, q: DVec3, tips: [DVec3; 2]) -> bool {
    let along = (q - p).normalize_or_zero();
    let [u, w] = tips.map(|tip| {
        let d = tip - p;
        (d - along * along.dot(d)).normalize_or_zero()
    });
    u.dot(w) > MAX_FOLD_COSINE
}

#[cfg(test)]
mod tests {
    use super::*;

    fn v(x: f64, y: f64, z: f64) -> DVec3 {
        DVec3::new(x, y, z)
    }

    fn t(index: [u32; 3], at: [DVec3; 3]) -> Corners {
        Corners { index, at }
    }

    #[test]
    fn sort_keys_order_like_numbers() {
        let numbers =
            [f64::NEG_INFINITY, -2.5, -2.0, -1e-300, -0.0, 0.0, 1e-300, 0.1, 7.0, 7.5, f64::INFINITY];
        let keys = numbers.iter().flat_map(|&x| [ascending(x, 3), ascending(x, 4)]);
        assert!(numbers.is_sorted_by(|a, b| a.total_cmp(b).is_lt()) && keys.is_sorted_by(|a, b| a < b));
    }

    const FLOOR: [DVec3; 3] = [DVec3::ZERO, DVec3::new(4.0, 0.0, 0.0), DVec3::new(0.0, 4.0, 0.0)];

    #[test]
    fn triangles_without_common_vertices_meet_within_the_gap() {
        let floor = t([0, 1, 2], FLOOR);
        let above = |z: f64| t([3, 4, 5], [v(1.0, 1.0, z), v(2.0, 1.0, z), v(1.0, 2.0, z + 1.0)]);
        assert!(meet(&floor, &above(-0.5), 0.0), "crosses");
        assert!(meet(&floor, &above(0.0), 0.0), "touches");
        assert!(!meet(&floor, &above(0.1), 0.0));
        assert!(meet(&floor, &above(0.1), 0.2), "nearer than the gap");
        let beside = t([3, 4, 5], [v(3.0, 3.0, 0.0), v(5.0, 3.0, 0.0), v(3.0, 5.0, 0.0)]);
        assert!(!meet(&floor, &beside, 0.0), "coplanar, side by side");
        let inside = t([3, 4, 5], [v(1.0, 1.0, 0.0), v(1.5, 1.0, 0.0), v(1.0, 1.5, 0.0)]);
        assert!(meet(&floor, &inside, 0.0), "coplanar, overlapping");
    }

    #[test]
    fn triangles_with_a_common_vertex_meet_if_their_cones_do() {
        let floor = t([0, 1, 2], FLOOR);
        let fan = |p: DVec3, q: DVec3| t([0, 3, 4], [DVec3::ZERO, p, q]);
        assert!(!meet(&floor, &fan(v(-1.0, 0.0, 0.0), v(0.0, -1.0, 0.0)), 1.0), "opposite, coplanar");
        assert!(meet(&floor, &fan(v(1.0, 1.0, 0.0), v(1.0, 2.0, 0.0)), 0.0), "overlapping, coplanar");
        assert!(meet(&floor, &fan(v(1.0, 1.0, 1.0), v(1.0, 1.0, -1.0)), 0.0), "crossing");
        assert!(
            !meet(&floor, &fan(v(-1.0, -1.0, 1.0), v(-1.0, -1.0, -1.0)), 0.0),
            "crossing its plane outside the triangle"
        );
        assert!(!meet(&floor, &fan(v(1.0, 1.0, 1.0), v(1.0, 2.0, 1.0)), 0.0), "above");
    }

    #[test]
    fn faces_with_a_common_edge_meet_when_folded() {
        let floor = t([0, 1, 2], FLOOR);
        let wing = |tip: DVec3| t([1, 0, 3], [FLOOR[1], FLOOR[0], tip]);
        assert!(!meet(&floor, &wing(v(1.0, -2.0, 0.0)), 1.0), "flat");
        assert!(!meet(&floor, &wing(v(1.0, 1.0, 1.0)), 1.0), "45 degrees");
        assert!(meet(&floor, &wing(v(3.0, 1.0, 0.001)), 1.0), "folded");
    }
}
