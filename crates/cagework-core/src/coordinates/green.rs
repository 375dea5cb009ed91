//! Green coordinates, a closed form that preserves details, for comparison with harmonic and mean value coordinates.
//!
//! A point is a combination of the cage's vertices and of its faces' normals. The columns of the weights are therefore
//! the cage's vertices, then its triangles. The control of a triangle is its normal scaled by the stretch of the posed
//! triangle, so that poses are applied by the same product as for other coordinates. Deformed points may leave the
//! cage.
//!
//! Source: Lipman, Levin and Cohen-Or 2008, "Green coordinates"; integrals over triangles as in its appendix, angles by
//! arctangent.

use std::f64::consts::PI;

use glam::DVec3;

use super::closed_form::ClosedForm;
use crate::cage::Cage;

/// Sine below which directions count as coplanar, and distance, as a fraction of the cage's diagonal, below which a
/// point counts as in a triangle's plane: the square root of f64 rounding.
const PLANE_TOLERANCE: f64 = 1e-8;

/// Smallest sum of a point's vertex weights inside the cage. The sum is 1 inside, 0 outside, and the enclosed share of
/// a small ball on the surface.
const MIN_SUM: f64 = 0.99;

/// Green coordinates, with one column for each cage vertex, then one for each triangle. The controls of the triangles
/// are the scaled normals `s n` (Lipman et al., section 3.1). The coordinates are defined inside the cage.
pub(super) const FORM: ClosedForm = ClosedForm {
    row: coordinates,
    triangles: Some(|cage, positions| {
        stretched_normals(cage, |i| positions[i as usize].as_dvec3()).map(DVec3::as_vec3).collect()
    }),
};

/// Computes the scaled normals `s n` of the triangles with the cage's vertices at `at`. `[n_triangles]`
fn stretched_normals(cage: &Cage, at: impl Fn(u32) -> DVec3) -> impl Iterator<Item = DVec3> {
    let sides = |[a, b, c]: [DVec3; 3]| [b - a, c - a];
    cage.triangles().iter().enumerate().map(move |(t, triangle)| {
        let [u, v] = sides(cage.triangle_corners(t as u32));
        let [x, y] = sides(triangle.map(&at));
        let squares = x.length_squared() * v.length_squared() - 2.0 * x.dot(y) * u.dot(v)
            + y.length_squared() * u.length_squared();
        // Denominator: sqrt(8) times the area, which is half of |u x v|.
        let stretch = squares.max(0.0).sqrt() / (2.0_f64.sqrt() * u.cross(v).length());
        stretch * x.cross(y).normalize_or_zero()
    })
}

/// Computes the coordinates at a point. Returns whether it is inside. `row`: `[n_cage + n_triangles]`, zero on entry.
fn coordinates(point: DVec3, cage: &Cage, row: &mut [f64]) -> bool {
    let near = PLANE_TOLERANCE * f64::from(cage.diagonal());
    let (of_vertices, of_triangles) = row.split_at_mut(cage.n_vertices());
    for (t, triangle) in cage.triangles().iter().enumerate() {
        let v = cage.triangle_corners(t as u32).map(|p| p - point);
        let normal = (v[1] - v[0]).cross(v[2] - v[0]).normalize_or_zero();
        let foot = v[0].dot(normal) * normal;
        let next = |k: usize| (k + 1) % 3;
        let signed = |k: usize| {
            let side = (v[k] - foot).cross(v[next(k)] - foot).dot(normal);
            if side == 0.0 { 0.0 } else { side.signum() * over_triangle(foot, v[k], v[next(k)]) }
        };
        let potential = -(0..3).map(signed).sum::<f64>().abs();
        of_triangles[t] = -potential;
        // The point lies in the triangle's plane, so the solid angle of the triangle is zero.
        if foot.length() <= near {
            continue;
        }
        let planes = [0, 1, 2].map(|k| v[next(k)].cross(v[k]).normalize_or_zero());
        let edges = (0..3).map(|k| over_triangle(DVec3::ZERO, v[next(k)], v[k]) * planes[k]);
        let mean = potential * normal + edges.sum::<DVec3>();
        for k in 0..3 {
            let plane = planes[next(k)];
            of_vertices[triangle[k] as usize] += plane.dot(mean) / plane.dot(v[k]);
        }
    }
    of_vertices.iter().sum::<f64>() >= MIN_SUM
}

/// Computes the integral over the triangle (`foot`, `a`, `b`) of the Green's function `-1 / (4 pi r)`, where r is the
/// distance from the origin. `foot` must be the projection of the origin to the triangle's plane. The integral is at
/// most 0.
fn over_triangle(foot: DVec3, a: DVec3, b: DVec3) -> f64 {
    let (edge, to_a, to_b) = (b - a, foot - a, foot - b);
    let product = edge.cross(to_a).length();
    if product <= PLANE_TOLERANCE * edge.length() * to_a.length().max(to_b.length()) {
        return 0.0;
    }
    let at_a = product.atan2(edge.dot(to_a));
    let at_foot = to_a.cross(to_b).length().atan2(to_a.dot(to_b));
    // Squared distances of the foot from the edge and from the origin.
    let (lambda, c) = (product * product / edge.length_squared(), foot.length_squared());
    let (root_lambda, root_c) = (lambda.sqrt(), c.sqrt());
    let antiderivative = |angle: f64| {
        let (sine, cosine) = angle.sin_cos();
        let inner = (lambda * lambda + lambda * c * sine * sine).sqrt();
        let share = 1.0 - 2.0 * c * cosine / (c * (1.0 + cosine) + lambda + inner);
        let turned = (root_c * cosine / (lambda + sine * sine * c).sqrt()).atan();
        let logarithm = (2.0 * root_lambda * (1.0 + cosine) / (1.0 - cosine) * share).ln();
        -0.5 * (2.0 * root_c * turned + root_lambda * logarithm)
    };
    let integral = antiderivative(PI - at_a) - antiderivative(PI - at_a - at_foot) - root_c * at_foot;
    -integral.abs() / (4.0 * PI)
}

#[cfg(test)]
mod tests {
    use glam::{DQuat, Vec3};
    use proptest::prelude::*;

    use super::*;
    use crate::cage::shapes;
    use crate::coordinates::{ClosedFormError, Coordinates};
    use crate::progress::NoProgress;

    /// Largest error of the midpoint rule below for points a tenth of the cage's size from its faces.
    const MIDPOINT_ERROR: f64 = 2e-5;

    fn at(cage: &Cage, point: DVec3) -> Vec<f64> {
        let mut row = vec![0.0; cage.n_vertices() + cage.triangles().len()];
        assert!(coordinates(point, cage, &mut row), "{point}");
        row
    }

    fn assert_reproduced(cage: &Cage, point: DVec3, within: f64) {
        let row = at(cage, point);
        let sum: f64 = row[..cage.n_vertices()].iter().sum();
        let controls = Coordinates::Green.columns(cage, cage.positions());
        let combined: DVec3 = row.iter().zip(controls.iter()).map(|(&w, p)| w * p.as_dvec3()).sum();
        assert!((sum - 1.0).abs() <= within, "weights sum to {sum} at {point}");
        assert!(combined.distance(point) <= within, "{combined} is not {point}");
    }

    /// The defining integrals (Lipman et al., equations 4 and 5) by the midpoint rule over many small triangles.
    fn integrated(cage: &Cage, point: DVec3) -> Vec<f64> {
        const STEPS: usize = 200;
        let mut row = vec![0.0; cage.n_vertices() + cage.triangles().len()];
        for (t, triangle) in cage.triangles().iter().enumerate() {
            let [a, b, c] = cage.triangle_corners(t as u32);
            let area = 0.5 * (b - a).cross(c - a);
            let small = area.length() / (STEPS * STEPS) as f64;
            for (i, j) in (0..STEPS).flat_map(|i| (0..STEPS - i).map(move |j| (i, j))) {
                // Centroids of the small triangles: an upright one and, except in the last row, an inverted one.
                for third in [1.0 / 3.0, 2.0 / 3.0].into_iter().take(if i + j + 1 < STEPS { 2 } else { 1 }) {
                    let (v, w) = ((i as f64 + third) / STEPS as f64, (j as f64 + third) / STEPS as f64);
                    let to = (1.0 - v - w) * a + v * b + w * c - point;
                    let flux = to.dot(area.normalize()) / (4.0 * PI * to.length().powi(3));
                    for (&corner, hat) in triangle.iter().zip([1.0 - v - w, v, w]) {
                        row[corner as usize] += small * hat * flux;
                    }
                    row[cage.n_vertices() + t] += small / (4.0 * PI * to.length());
                }
            }
        }
        row
    }

    /// A similarity of the cage acts as the same similarity on the interior (Lipman et al., section 3). The test
    /// computes in f64, because f32 storage alone would cause errors of 4e-6.
    #[test]
    fn a_similarity_of_the_cage_is_one_of_its_interior() {
        let cage = Cage::new(&shapes::c_shape()).unwrap();
        let turn = DQuat::from_axis_angle(DVec3::new(1.0, -2.0, 0.5).normalize(), 2.2);
        let similar = |p: DVec3| 1.7 * (turn * p) + DVec3::new(3.0, -1.0, 2.0);
        let posed = |i: u32| similar(cage.positions()[i as usize].as_dvec3());
        for point in [DVec3::new(0.5, 1.5, 0.5), DVec3::new(2.5, 0.5, 0.3), DVec3::new(0.1, 2.8, 0.9)] {
            let controls = (0..cage.n_vertices() as u32).map(posed).chain(stretched_normals(&cage, posed));
            let moved: DVec3 = at(&cage, point).iter().zip(controls).map(|(&w, p)| w * p).sum();
            assert!(moved.distance(similar(point)) <= 1e-6, "{moved} instead of {}", similar(point));
        }
    }

    #[test]
    fn point_outside_or_not_finite_is_an_error_with_its_index() {
        let cage = Cage::new(&shapes::cube()).unwrap();
        let inside = cage.bounds().center();
        let outside =
            Coordinates::Green.weights(&[inside, inside + 9.0], &cage, u64::MAX, &NoProgress).unwrap_err();
        assert_eq!(
            outside.to_string(),
            "Green coordinates are not defined at mesh vertex 1, which is outside the cage: enlarge the cage"
        );
        let memory =
            Coordinates::Green.weights(&[inside; 100], &cage, 100 * 20 * 8 - 1, &NoProgress).unwrap_err();
        // 100 points have a weight of 8 bytes for each of 20 columns: the cube's 8 vertices and 12 triangles.
        assert_eq!(memory, ClosedFormError::Memory { needed: 16_000, limit: 15_999 });
        let cancel = |_: crate::progress::ProgressEvent| std::ops::ControlFlow::Break(());
        let cancelled = Coordinates::Green.weights(&[inside], &cage, u64::MAX, &cancel).unwrap_err();
        assert!(matches!(cancelled, ClosedFormError::Cancelled(_)));
        let not_finite = Coordinates::Green.weights(&[Vec3::NAN], &cage, u64::MAX, &NoProgress).unwrap_err();
        assert_eq!(not_finite, ClosedFormError::NotFinite { vertex: 0 });
    }

    #[test]
    fn points_in_the_planes_of_faces_and_on_lines_through_edges_are_reproduced() {
        // The planes of the two faces at the inner edge of the L pass through its interior.
        let cage = Cage::new(&shapes::l_shape()).unwrap();
        let positions: Vec<DVec3> = cage.positions().iter().map(|p| p.as_dvec3()).collect();
        let centre = cage.bounds().center().as_dvec3();
        let mut n = 0;
        for a in &positions {
            for b in &positions {
                let middle = a.midpoint(*b).lerp(centre, 1e-12);
                let mut row = vec![0.0; cage.n_vertices() + cage.triangles().len()];
                if coordinates(middle, &cage, &mut row) {
                    assert_reproduced(&cage, middle, 1e-6);
                    n += 1;
                }
            }
        }
        assert!(n > 4, "{n}");
    }

    proptest! {
        #[test]
        fn points_inside_are_reproduced(
            x in 0.001..0.999f64, y in 0.001..2.999f64, z in 0.001..0.999f64,
        ) {
            // The points lie in the back of the C.
            assert_reproduced(&Cage::new(&shapes::c_shape()).unwrap(), DVec3::new(x, y, z), 1e-6);
        }
    }
    proptest! {
        #![proptest_config(ProptestConfig::with_cases(8))]

        #[test]
        fn coordinates_are_the_integrals_that_define_them(x in -0.3..0.3f64, y in -0.3..0.3f64, z in -0.3..0.3f64) {
            let cage = Cage::new(&shapes::octahedron()).unwrap();
            let point = cage.bounds().center().as_dvec3() + DVec3::new(x, y, z);
            for (found, expected) in at(&cage, point).iter().zip(&integrated(&cage, point)) {
                prop_assert!((found - expected).abs() <= MIDPOINT_ERROR, "{found} instead of {expected}");
            }
        }
    }
}
