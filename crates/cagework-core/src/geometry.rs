//! Geometry in f64: closest point on a triangle, triangle-box overlap, winding number.

use std::f64::consts::TAU;

use glam::DVec3;

/// Relative enlargement of the box in [`triangle_box_overlaps`]: above f64 rounding, far below a cell.
const BOX_WIDENING: f64 = 1e-9;

/// Height of a triangle divided by its length below which it is treated as a segment: f64 rounding hides its plane.
const MIN_RELATIVE_HEIGHT: f64 = 1e-12;

/// Closest point on a triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrianglePoint {
    /// The point, object units.
    pub point: DVec3,
    /// Barycentric coordinates, non-negative, sum 1.
    pub barycentric: [f64; 3],
}

/// Finds the closest point of `triangle` to `point`. Degenerate triangles are treated as a segment or point.
///
/// Source: Ericson 2005, "Real-time collision detection", sections 3.4 and 5.1.2. The faster method of section 5.1.5
/// may choose the wrong edge of a degenerate triangle.
#[must_use]
pub fn closest_point_on_triangle(point: DVec3, triangle: [DVec3; 3]) -> TrianglePoint {
    let [a, b, c] = triangle;
    let barycentric = projection_inside(point, triangle).unwrap_or_else(|| {
        let [on_ab, on_bc, on_ca] = [(a, b), (b, c), (c, a)].map(|(p, q)| share_of_segment(point, p, q));
        let candidates = [[1.0 - on_ab, on_ab, 0.0], [0.0, 1.0 - on_bc, on_bc], [on_ca, 0.0, 1.0 - on_ca]];
        let distance = |[u, v, w]: [f64; 3]| (u * a + v * b + w * c).distance_squared(point);
        // If candidates are equally close, the first one is taken.
        let mut best = candidates[0];
        for candidate in &candidates[1..] {
            if distance(*candidate) < distance(best) {
                best = *candidate;
            }
        }
        best
    });
    let [u, v, w] = barycentric;
    TrianglePoint { point: u * a + v * b + w * c, barycentric }
}

/// Computes the distance from `from` along a unit vector to a triangle of either orientation, object units; `None` if
/// the ray misses.
///
/// Source: Moeller and Trumbore 1997, "Fast, minimum storage ray-triangle intersection".
#[must_use]
pub fn distance_along(from: DVec3, way: DVec3, [a, b, c]: [DVec3; 3]) -> Option<f64> {
    let (ab, ac, to) = (b - a, c - a, from - a);
    let (p, q) = (way.cross(ac), to.cross(ab));
    let determinant = ab.dot(p);
    let [u, v, s] = [to.dot(p), way.dot(q), ac.dot(q)].map(|x| x / determinant);
    (u >= 0.0 && v >= 0.0 && u + v <= 1.0 && s >= 0.0).then_some(s)
}

/// Returns the barycentric coordinates of the projection of `point`, if it lies in the triangle and the triangle has an
/// area.
fn projection_inside(point: DVec3, [a, b, c]: [DVec3; 3]) -> Option<[f64; 3]> {
    let (ab, ac, ap) = (b - a, c - a, point - a);
    let normal = ab.cross(ac);
    let area_squared = normal.length_squared();
    let longest_squared = ab.length_squared().max(ac.length_squared());
    if area_squared <= (MIN_RELATIVE_HEIGHT * longest_squared).powi(2) {
        return None;
    }
    let v = ap.cross(ac).dot(normal) / area_squared;
    let w = ab.cross(ap).dot(normal) / area_squared;
    let u = 1.0 - v - w;
    (u >= 0.0 && v >= 0.0 && w >= 0.0).then_some([u, v, w])
}

/// Returns the parameter, 0 at `p` to 1 at `q`, of the point of the segment that is closest to `point`.
fn share_of_segment(point: DVec3, p: DVec3, q: DVec3) -> f64 {
    let way = q - p;
    let length_squared = way.length_squared();
    if length_squared > 0.0 { ((point - p).dot(way) / length_squared).clamp(0.0, 1.0) } else { 0.0 }
}

/// Whether a triangle and an axis-aligned box (centre, half edge lengths) overlap. Conservative: a triangle that misses
/// the box by a relative distance of less than 1e-9 may count as overlapping, so that no surface slips between two
/// boxes.
///
/// Source: Akenine-Moeller 2001, "Fast 3D triangle-box overlap testing" (separating axes).
#[must_use]
pub fn triangle_box_overlaps(center: DVec3, half: DVec3, triangle: [DVec3; 3]) -> bool {
    let [a, b, c] = triangle.map(|p| p - center);
    let size = half.max_element().max(a.abs().max_element());
    let half = half + DVec3::splat(BOX_WIDENING * size);
    if a.min(b).min(c).cmpgt(half).any() || a.max(b).max(c).cmplt(-half).any() {
        return false;
    }
    let edges = [b - a, c - b, a - c];
    let separates = |axis: DVec3| {
        let (p, q, r) = (axis.dot(a), axis.dot(b), axis.dot(c));
        let reach = half.dot(axis.abs());
        p.min(q).min(r) > reach || p.max(q).max(r) < -reach
    };
    if separates(edges[0].cross(edges[1])) {
        return false;
    }
    !edges.iter().any(|e| {
        separates(DVec3::new(0.0, -e.z, e.y))
            || separates(DVec3::new(e.z, 0.0, -e.x))
            || separates(DVec3::new(-e.y, e.x, 0.0))
    })
}

/// Computes the winding number of a closed set of triangles, counter-clockwise seen from outside, around `point`: 1
/// inside (also of a solid with cavities), 0 outside, in between on the surface. For an open set: the solid angle that it
/// covers, divided by that of a sphere.
///
/// Source: van Oosterom and Strackee 1983, "The solid angle of a plane triangle". Each half solid angle is the argument
/// of a complex number. The product of these numbers has the sum of the angles as its argument, apart from full turns,
/// which are counted separately: a single arc tangent suffices.
#[must_use]
pub fn winding_number(point: DVec3, triangles: impl IntoIterator<Item = [DVec3; 3]>) -> f64 {
    /// Magnitude of the product below which it is scaled up, far above underflow.
    const MIN_SIZE: f64 = 1e-100;
    let (mut re, mut im) = (1.0_f64, 0.0_f64);
    let mut turns = 0_i32;
    for triangle in triangles {
        let [a, b, c] = triangle.map(|p| p - point);
        let [la, lb, lc] = [a, b, c].map(DVec3::length);
        let x = la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb;
        let y = a.dot(b.cross(c));
        let per_size = (x.abs() + y.abs()).recip();
        if !per_size.is_finite() {
            continue;
        }
        let (x, y) = (x * per_size, y * per_size);
        let was_upper = im >= 0.0;
        (re, im) = (re * x - im * y, re * y + im * x);
        // The sum of two angles of equal sign may exceed half a turn, which changes the sign of `im`.
        if was_upper && y >= 0.0 && im < 0.0 {
            turns += 1;
        } else if !was_upper && y < 0.0 && im >= 0.0 {
            turns -= 1;
        }
        let size = re.abs() + im.abs();
        if size < MIN_SIZE {
            (re, im) = (re / size, im / size);
        }
    }
    im.atan2(re) / TAU + f64::from(turns)
}

#[cfg(test)]
mod tests;
