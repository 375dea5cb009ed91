//! Comparison of geometric functions with independent computations.

use glam::Vec3;
use proptest::prelude::*;

use super::*;
use crate::cage::{Cage, shapes, subdivided_box};
use crate::mesh::Bounds;

/// Tolerance for f64 rounding of coordinates of size 1 to 4.
const ROUNDING: f64 = 1e-13;

fn point() -> impl Strategy<Value = DVec3> {
    [-2.0..2.0f64, -2.0..2.0, -2.0..2.0].prop_map(DVec3::from)
}

/// Points on a coarse lattice, so that coincident corners, collinear triangles and exact touching are frequent.
fn lattice_point() -> impl Strategy<Value = DVec3> {
    [-2..=2i32, -2..=2, -2..=2].prop_map(|p| glam::IVec3::from(p).as_dvec3() * 0.5)
}

/// Intersection of triangle and box, by clipping with each of the six planes (Sutherland and Hodgman 1974).
fn clipped(half: DVec3, triangle: [DVec3; 3]) -> Vec<DVec3> {
    let mut polygon = triangle.to_vec();
    for axis in 0..3 {
        for sign in [1.0, -1.0] {
            let depth = |p: DVec3| half[axis] - sign * p[axis];
            let mut left = Vec::new();
            for (k, &p) in polygon.iter().enumerate() {
                let q = polygon[(k + 1) % polygon.len()];
                if depth(p) >= 0.0 {
                    left.push(p);
                }
                if depth(p) * depth(q) < 0.0 {
                    left.push(p.lerp(q, depth(p) / (depth(p) - depth(q))));
                }
            }
            polygon = left;
        }
    }
    polygon
}

fn assert_closest(p: DVec3, triangle: [DVec3; 3]) {
    let closest = closest_point_on_triangle(p, triangle);
    let [u, v, w] = closest.barycentric;
    assert!(u >= 0.0 && v >= 0.0 && w >= 0.0 && (u + v + w - 1.0).abs() <= ROUNDING);
    // In a convex set, a point is closest to `p` if no corner lies further in the direction of `p`.
    let way = p - closest.point;
    for corner in triangle {
        assert!((corner - closest.point).dot(way) <= 10.0 * ROUNDING, "{corner} is closer than {closest:?}");
    }
}

proptest! {
    #[test]
    fn closest_point_is_optimal(p in point(), triangle in [point(), point(), point()]) {
        assert_closest(p, triangle);
    }

    #[test]
    fn closest_point_of_degenerate_triangles_is_optimal(
        p in point(), a in lattice_point(), b in lattice_point(), t in 0..=4i32,
    ) {
        let c = a.lerp(b, f64::from(t) / 4.0);
        for triangle in [[a, b, c], [c, a, b], [b, c, a], [a, a, b], [a, b, b], [a, a, a]] {
            let closest = closest_point_on_triangle(p, triangle);
            // Closest point of the segment to which the triangle degenerates.
            let [q, r] = if triangle.contains(&b) { [a, b] } else { [a, a] };
            let along = if q == r { 0.0 } else { ((p - q).dot(r - q) / (r - q).length_squared()).clamp(0.0, 1.0) };
            let distance = p.distance(q.lerp(r, along));
            prop_assert!((p.distance(closest.point) - distance).abs() <= ROUNDING);
        }
    }

    #[test]
    fn overlap_agrees_with_clipping(triangle in [point(), point(), point()], half in point()) {
        let half = half.abs();
        let overlaps = triangle_box_overlaps(DVec3::ONE, half, triangle.map(|p| p + DVec3::ONE));
        prop_assert_eq!(overlaps, !clipped(half, triangle).is_empty());
    }

    #[test]
    fn touching_counts_as_overlap(triangle in [lattice_point(), lattice_point(), lattice_point()]) {
        let half = DVec3::splat(0.5);
        if !clipped(half, triangle).is_empty() {
            prop_assert!(triangle_box_overlaps(DVec3::ZERO, half, triangle));
        }
    }
}

#[test]
fn winding_number_separates_inside_from_outside() {
    let cage = Cage::new(&shapes::l_shape()).unwrap();
    let at = |p: [f64; 3]| {
        let triangles = (0..cage.triangles().len() as u32).map(|t| cage.triangle_corners(t));
        winding_number(p.into(), triangles)
    };
    for (p, winding) in [
        ([0.5, 0.5, 0.5], 1.0),
        ([1.9, 0.9, 0.1], 1.0),
        ([1.5, 1.5, 0.5], 0.0),
        ([3.0, 0.5, 0.5], 0.0),
        // Share of directions that lead inside: half on a face, a quarter on a convex edge, an eighth at a corner.
        ([0.5, 0.5, 0.0], 0.5),
        ([0.0, 0.5, 0.0], 0.25),
        ([0.0, 0.0, 0.0], 0.125),
    ] {
        assert!((at(p).abs() - winding).abs() < ROUNDING, "{} is not {winding} at {p:?}", at(p));
    }
}

/// The expected numbers are sums of one arc tangent per triangle.
#[test]
fn product_of_angles_is_the_sum_of_angles() {
    /// Tolerance for f64 rounding of sums of thousands of angles.
    const ROUNDING: f64 = 1e-10;
    let half_angle = |point: DVec3, triangle: [DVec3; 3]| {
        let [a, b, c] = triangle.map(|p| p - point);
        let (la, lb, lc) = (a.length(), b.length(), c.length());
        let x = la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb;
        a.dot(b.cross(c)).atan2(x)
    };
    let bounds = Bounds { min: Vec3::splat(-1.0), max: Vec3::ONE };
    let cage = Cage::new(&subdivided_box(bounds, 0.0, [3, 3, 3])).unwrap();
    let closed: Vec<_> = (0..cage.triangles().len() as u32).map(|t| cage.triangle_corners(t)).collect();
    // An open part of the surface, whose winding number is not an integer, and many nested surfaces.
    let scaled = |size: f64| closed.iter().map(move |t| t.map(|p| size * p));
    let nested = (0..60).flat_map(|k| scaled(1.0 + 0.01 * f64::from(k))).collect();
    for triangles in [closed[..20].to_vec(), closed.clone(), nested] {
        let steps = || (-7..=7).map(|k| 0.19 * f64::from(k) + 0.013);
        for p in steps().flat_map(|x| steps().map(move |y| DVec3::new(x, y, 0.3 - y))) {
            let expected = triangles.iter().map(|&t| half_angle(p, t)).sum::<f64>() / TAU;
            let actual = winding_number(p, triangles.iter().copied());
            assert!((actual - expected).abs() < ROUNDING, "{p}: {actual} instead of {expected}");
        }
    }
}
