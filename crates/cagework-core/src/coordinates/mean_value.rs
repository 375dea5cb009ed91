//! Mean value coordinates for closed triangle meshes, a closed form for comparison with harmonic coordinates.
//!
//! They need no grid and no solver. But they are negative in places if the cage is not convex, and they act across
//! gaps: a vertex in one leg follows the other leg. Harmonic coordinates avoid both.
//!
//! Source: Ju, Schaefer and Warren 2005, "Mean value coordinates for closed triangular meshes".
//!
//! Changes: weights are the components of the mean vector along the corners' directions (section 3.2), with angles by
//! arctangent. The robust form of section 3.3 takes the root of `1 - c^2`, which loses half of all digits near the
//! plane of a triangle. Polygons are triangulated as in [`Cage::triangles`].

use glam::DVec3;

use super::closed_form::ClosedForm;
use crate::cage::Cage;

/// Sine below which directions are coplanar or collinear, and distance, as a fraction of the cage's diagonal, below
/// which a point is on the surface: the square root of f64 rounding. At this sine, the rounding error of a triangle's
/// term and the error of omitting the term are both about 1e-8.
const SURFACE_TOLERANCE: f64 = 1e-8;

/// If the angles that a triangle's three sides span at a coplanar point sum to a full turn up to this tolerance, the
/// point lies on the triangle. Ten times [`SURFACE_TOLERANCE`], because near an edge a small height above the plane
/// changes the sum more.
const FULL_TURN_TOLERANCE: f64 = 1e-7;

/// Mean value coordinates, with one column for each cage vertex. They are defined inside and outside the cage.
pub(super) const FORM: ClosedForm = ClosedForm { row: coordinates, triangles: None };

/// Computes the mean value coordinates at a point. Returns whether they are defined. `row`: `[n_cage]`, zero on entry.
fn coordinates(point: DVec3, cage: &Cage, row: &mut [f64]) -> bool {
    let near = SURFACE_TOLERANCE * f64::from(cage.diagonal());
    for (t, triangle) in cage.triangles().iter().enumerate() {
        let arms = cage.triangle_corners(t as u32).map(|p| p - point);
        let lengths = arms.map(DVec3::length);
        if let Some(k) = lengths.iter().position(|&d| d <= near) {
            row.fill(0.0);
            row[triangle[k] as usize] = 1.0;
            return true;
        }
        let directions = [0, 1, 2].map(|k| arms[k] / lengths[k]);
        // Side k is opposite corner k. The length of its normal is the sine of the angle that the side spans at the
        // point.
        let normals = [0, 1, 2].map(|k| directions[(k + 1) % 3].cross(directions[(k + 2) % 3]));
        let sines = normals.map(DVec3::length);
        let angles = [0, 1, 2].map(|k| sines[k].atan2(directions[(k + 1) % 3].dot(directions[(k + 2) % 3])));
        let determinant = directions[0].dot(normals[0]);
        // Divided by the largest sine, the determinant is the sine of the point's elevation above the triangle's plane.
        // Without the division it would also be small for distant triangles.
        if determinant.abs() <= SURFACE_TOLERANCE * sines.into_iter().fold(0.0, f64::max) {
            if std::f64::consts::TAU - angles.iter().sum::<f64>() > FULL_TURN_TOLERANCE {
                continue; // in the plane but outside the triangle: solid angle zero
            }
            let on_face = [0, 1, 2].map(|k| sines[k] * lengths[(k + 1) % 3] * lengths[(k + 2) % 3]);
            let sum: f64 = on_face.iter().sum();
            row.fill(0.0);
            for (&i, w) in triangle.iter().zip(on_face) {
                row[i as usize] = w / sum;
            }
            return true;
        }
        let mean: DVec3 = (0..3).map(|k| 0.5 * angles[k] / sines[k] * normals[k]).sum();
        for k in 0..3 {
            row[triangle[k] as usize] += normals[k].dot(mean) / (lengths[k] * determinant);
        }
    }
    let sum: f64 = row.iter().sum();
    let cancelled = sum.abs() <= SURFACE_TOLERANCE * row.iter().map(|w| w.abs()).sum::<f64>();
    for w in row {
        *w /= sum;
    }
    !cancelled
}

#[cfg(test)]
mod tests {
    use glam::Vec3;
    use proptest::prelude::*;

    use super::*;
    use crate::cage::shapes;
    use crate::coordinates::{ClosedFormError, Coordinates};
    use crate::progress::NoProgress;

    /// Ten times the error of about 1e-8 that omitting a triangle's term causes at a sine of [`SURFACE_TOLERANCE`].
    const TOLERANCE: f64 = 1e-7;

    fn at(cage: &Cage, point: DVec3) -> Vec<f64> {
        let mut row = vec![0.0; cage.n_vertices()];
        assert!(coordinates(point, cage, &mut row));
        row
    }

    fn assert_reproduced(cage: &Cage, point: DVec3) {
        let row = at(cage, point);
        let sum: f64 = row.iter().sum();
        let combined: DVec3 = row.iter().zip(cage.positions()).map(|(&w, p)| w * p.as_dvec3()).sum();
        assert!((sum - 1.0).abs() <= TOLERANCE, "weights sum to {sum} at {point}");
        assert!(combined.distance(point) <= TOLERANCE, "{combined} is not {point}");
    }

    #[test]
    fn tetrahedron_gives_barycentric_coordinates() {
        let cage = Cage::new(&shapes::tetrahedron()).unwrap();
        let p = DVec3::new(0.2, 0.3, 0.1);
        for (w, barycentric) in at(&cage, p).into_iter().zip([0.4, 0.2, 0.3, 0.1]) {
            assert!((w - barycentric).abs() <= TOLERANCE);
        }
    }

    #[test]
    fn points_on_faces_edges_and_corners_are_reproduced() {
        for mesh in [shapes::tetrahedron(), shapes::octahedron(), shapes::l_shape(), shapes::c_shape()] {
            let cage = Cage::new(&mesh).unwrap();
            for t in 0..cage.triangles().len() as u32 {
                let [a, b, c] = cage.triangle_corners(t);
                let normal = (b - a).cross(c - a);
                for [u, v, w] in [[1.0, 0.0, 0.0], [0.5, 0.5, 0.0], [0.2, 0.3, 0.5], [0.9, 0.1, 0.0]] {
                    for height in [0.0, 1e-14, 1e-10, 1e-8, 1e-6, 1e-3] {
                        assert_reproduced(&cage, u * a + v * b + w * c - height * normal);
                    }
                }
            }
        }
    }

    #[test]
    fn vertex_has_weight_one_at_itself() {
        let cage = Cage::new(&shapes::c_shape()).unwrap();
        let weights = Coordinates::MeanValue.weights(cage.positions(), &cage, u64::MAX, &NoProgress).unwrap();
        for (v, (columns, row)) in weights.rows().enumerate() {
            assert_eq!(columns, (0..16).collect::<Vec<u32>>());
            assert!(row.iter().enumerate().all(|(i, &w)| w == if i == v { 1.0 } else { 0.0 }));
        }
    }

    #[test]
    fn weights_go_negative_across_the_gap_of_a_c() {
        // The point lies in the lower arm, next to the gap. It sees the far wall of the gap from outside the upper arm.
        let cage = Cage::new(&shapes::c_shape()).unwrap();
        let row = at(&cage, DVec3::new(2.5, 0.9, 0.5));
        assert!(row.iter().any(|&w| w < -1e-3), "{row:?}");
    }

    #[test]
    fn point_that_is_not_finite_is_an_error_with_its_index() {
        let cage = Cage::new(&shapes::cube()).unwrap();
        let points = [Vec3::ONE, Vec3::NAN];
        assert_eq!(
            Coordinates::MeanValue.weights(&points, &cage, u64::MAX, &NoProgress),
            Err(ClosedFormError::NotFinite { vertex: 1 })
        );
    }

    proptest! {
        #[test]
        fn weights_sum_to_1_and_reproduce_points_inside(
            x in 0.001..0.999f64, y in 0.001..2.999f64, z in 0.001..0.999f64,
        ) {
            // The points lie in the back of the C.
            assert_reproduced(&Cage::new(&shapes::c_shape()).unwrap(), DVec3::new(x, y, z));
        }
    }
}
