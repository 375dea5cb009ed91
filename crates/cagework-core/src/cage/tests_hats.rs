//! Tests that hats are barycentric coordinates on every kind of face.

use glam::{DVec2, Vec3};
use proptest::prelude::*;

use super::shapes::*;
use super::*;
use crate::bind::bind;
use crate::options::BindOptions;
use crate::progress::NoProgress;

/// Tolerance for f64 rounding of coordinates of size 1 after a few dozen operations.
const ROUNDING: f64 = 1e-12;

fn hats(cage: &Cage, triangle: u32, barycentric: [f64; 3]) -> Vec<f64> {
    let mut values = vec![0.0; cage.n_vertices()];
    cage.hats_at(triangle, barycentric, &mut |i, value| values[i as usize] += value);
    values
}

/// Barycentric coordinates of corners, edges and inner points, and of points next to corners and edges.
fn barycentrics() -> Vec<[f64; 3]> {
    let mut points = Vec::new();
    for u in [0.0, 1e-16, 1e-9, 0.2, 0.5, 0.9, 1.0] {
        for v in [0.0, 1e-16, 1e-9, 0.3, 0.5, 1.0] {
            points.push([u, (1.0 - u) * v, (1.0 - u) * (1.0 - v)]);
        }
    }
    points
}

fn assert_linear_reproduction(cage: &Cage, tolerance: f64) {
    for t in 0..cage.facets().len() as u32 {
        for b in barycentrics() {
            let values = hats(cage, t, b);
            let [p, q, r] = cage.facet_corners(t);
            let point = b[0] * p + b[1] * q + b[2] * r;
            let sum: f64 = values.iter().sum();
            let combined: DVec3 = values.iter().zip(cage.positions()).map(|(&w, p)| w * p.as_dvec3()).sum();
            assert!((sum - 1.0).abs() <= tolerance, "sum {sum} in triangle {t} at {b:?}");
            assert!(combined.distance(point) <= tolerance, "{combined} is not {point}, triangle {t}, {b:?}");
        }
    }
}

#[test]
fn hats_reproduce_points_on_every_kind_of_face() {
    let straight = [[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [2.0, 1.0], [0.0, 1.0]];
    for mesh in [tetrahedron(), cube(), l_shape(), c_shape(), prism(&straight, 1.0)] {
        assert_linear_reproduction(&Cage::new(&mesh).unwrap(), ROUNDING);
    }
}

#[test]
fn hats_reproduce_points_on_bent_faces() {
    for (by, tolerance) in [(0.5, ROUNDING), (0.01, ROUNDING), (1e-4, 2e-6)] {
        let mut mesh = cube();
        mesh.positions[7] += Vec3::splat(by);
        assert_linear_reproduction(&Cage::new(&mesh).unwrap(), tolerance);
    }
    let pentagon: Vec<[f32; 2]> =
        (0..5).map(|k| (k as f32 * std::f32::consts::TAU / 5.0).sin_cos()).map(|(y, x)| [x, y]).collect();
    let mut mesh = prism(&pentagon, 1.0);
    mesh.positions[7].z += 0.1;
    let cage = Cage::new(&mesh).unwrap();
    assert!(cage.facets().len() > cage.triangles().len());
    assert_linear_reproduction(&cage, ROUNDING);
    let mut mesh = prism(&[[0.0, 0.0], [2.0, 0.0], [0.5, 0.5], [0.0, 2.0]], 1.0);
    mesh.positions[7].z += 0.1;
    assert_linear_reproduction(&Cage::new(&mesh).unwrap(), ROUNDING);
}

/// As a corner leaves the plane of its faces, hats change gradually from the coordinates of the outline to linear ones.
#[test]
fn hats_are_continuous_in_the_bend() {
    let of = |bend: f32| {
        let mut mesh = cube();
        mesh.positions[7] += Vec3::splat(bend);
        let cage = Cage::new(&mesh).unwrap();
        // A flat face has other facets: compare at points, by the weights of a bind right behind the face.
        let points = [Vec3::new(0.3, 0.61, 1.0 - 1e-6), Vec3::new(0.72, 0.55, 1.0 - 1e-6)];
        let options = BindOptions { grid: 8, ..BindOptions::default() };
        let weights = bind(&points, &cage, &options, &NoProgress).unwrap().weights;
        (0..8).flat_map(|c| weights.column(c).collect::<Vec<_>>()).collect::<Vec<f32>>()
    };
    // The plane's tolerance is passed at a bend of about 1.4e-5, the end of the blend at 7e-4.
    for bend in [1e-5, 2e-5, 1e-4, 6.9e-4] {
        let [before, after] = [bend, bend + 5e-6].map(of);
        let change = before.iter().zip(&after).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
        assert!(change < 5e-4, "{change} at a bend of {bend}");
    }
}

/// A cube with one corner pulled out: three quads are not planar.
fn bent_cube() -> PolygonMesh {
    let mut mesh = cube();
    mesh.positions[7] = Vec3::splat(1.5);
    mesh
}

#[test]
fn hats_are_1_at_their_vertex_and_linear_on_edges() {
    for mesh in [cube(), l_shape(), c_shape(), bent_cube()] {
        let cage = Cage::new(&mesh).unwrap();
        for (t, triangle) in cage.facets().iter().enumerate() {
            for k in 0..3 {
                if triangle[k] as usize >= cage.n_vertices() {
                    continue; // inside a bent face
                }
                let mut b = [0.0; 3];
                b[k] = 1.0;
                let at_corner = hats(&cage, t as u32, b);
                assert!((at_corner[triangle[k] as usize] - 1.0).abs() <= ROUNDING);
                let (i, j) = (triangle[k], triangle[(k + 1) % 3]);
                let face = &cage.faces()[cage.face_of_facet()[t] as usize];
                let n = face.len();
                if !(0..n).any(|c| face[c] == i && face[(c + 1) % n] == j) {
                    continue; // a diagonal of the face, not an edge
                }
                b[k] = 0.25;
                b[(k + 1) % 3] = 0.75;
                let on_edge = hats(&cage, t as u32, b);
                assert!((on_edge[i as usize] - 0.25).abs() <= ROUNDING);
                assert!((on_edge[j as usize] - 0.75).abs() <= ROUNDING);
            }
        }
    }
}

#[test]
fn hats_are_bilinear_on_a_box() {
    let size = Vec3::new(1.0, 2.5, 0.75);
    let cage = Cage::new(&cuboid(Vec3::ZERO, size)).unwrap();
    for t in 0..cage.facets().len() as u32 {
        for b in barycentrics() {
            let [p, q, r] = cage.facet_corners(t);
            let x = (b[0] * p + b[1] * q + b[2] * r) / size.as_dvec3();
            for (i, value) in hats(&cage, t, b).into_iter().enumerate() {
                let factor = |axis: usize| if i >> axis & 1 == 1 { x[axis] } else { 1.0 - x[axis] };
                let trilinear = factor(0) * factor(1) * factor(2);
                assert!((value - trilinear).abs() <= ROUNDING, "{value} is not {trilinear}");
            }
        }
    }
}

#[test]
fn bent_quad_is_split_along_its_shorter_diagonal() {
    // Corner 7, pulled out, lengthens the diagonals that end in it.
    let cage = Cage::new(&bent_cube()).unwrap();
    for face in [1, 3, 5] {
        let [first, second]: [[u32; 3]; 2] = (0..cage.triangles().len())
            .filter(|&t| cage.face_of_triangle()[t] == face)
            .map(|t| cage.triangles()[t])
            .collect::<Vec<_>>()
            .try_into()
            .unwrap();
        assert_eq!([first, second].iter().filter(|t| t.contains(&7)).count(), 1);
    }
}

#[test]
fn rotated_faces_count_as_planar() {
    let turn = glam::Quat::from_euler(glam::EulerRot::XYZ, 0.3, 1.1, -0.7);
    let mut mesh = l_shape();
    for p in &mut mesh.positions {
        *p = turn * *p * 0.37 + Vec3::new(5.0, -3.0, 2.0);
    }
    let cage = Cage::new(&mesh).unwrap();
    assert!(cage.polygons.iter().all(|p| p.inner.is_empty()), "a planar face was treated as bent");
    // f32 rounding moves corners out of their planes; hats reproduce only the projection to the plane.
    assert_linear_reproduction(&cage, 2.0 * polygon::PLANE_TOLERANCE * f64::from(cage.diagonal()));
}

/// On the caps of the C, the hats of the vertices at the end of one arm are below 1e-3 in the other arm, where harmonic
/// coordinates are up to 2e-4. The hats are small because chords past the re-entrant corner end on the back of the C.
/// At the end of the other arm they are 0, and no hat is negative.
#[test]
fn hats_of_a_concave_face_are_positive_and_small_across_the_gap() {
    let cage = Cage::new(&c_shape()).unwrap();
    for t in 0..cage.facets().len() as u32 {
        for b in barycentrics() {
            let [p, q, r] = cage.facet_corners(t);
            let DVec3 { x, y, .. } = b[0] * p + b[1] * q + b[2] * r;
            for (i, value) in hats(&cage, t, b).into_iter().enumerate() {
                let corner = cage.positions()[i];
                assert!(value >= 0.0, "hat {i} is {value} in triangle {t} at {b:?}");
                let other_arm = x >= 1.0 && if corner.y <= 1.0 { y >= 2.0 } else { y <= 1.0 };
                let most = if x > 2.0 { ROUNDING } else { 1e-3 };
                assert!(corner.x < 3.0 || !other_arm || value <= most, "hat {i} is {value} at {x} {y}");
            }
        }
    }
}

/// A pentagon and a quad whose corner 1 is straight at `d = 0`, and a star whose re-entrant corner 1 moves by `d`.
fn nearly_straight(d: f64) -> [Vec<DVec2>; 3] {
    let star = (0..10).map(|k| DVec2::from_angle(k as f64 * 0.2 * std::f64::consts::PI));
    let star = star
        .enumerate()
        .map(|(k, p)| {
            if k % 2 == 0 {
                p
            } else if k == 1 {
                (0.4 - d) * p
            } else {
                0.4 * p
            }
        })
        .collect();
    let corners = |list: &[[f64; 2]]| list.iter().map(|&p| p.into()).collect();
    let (pentagon, quad) = (
        [[0.0, 0.0], [0.5, -d], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]],
        [[0.0, 0.0], [0.5, -d], [1.0, 0.0], [0.4, 1.0]],
    );
    [corners(&pentagon), corners(&quad), star]
}

/// Hats of a planar face at `points`. `[n_points][n]`
fn face_values(outline: &[DVec2], points: &[DVec2]) -> Vec<Vec<f64>> {
    let corners: Vec<DVec3> = outline.iter().map(|p| p.extend(0.0)).collect();
    let polygon = Polygon::new(&corners, outline[0].length() + 1.0).unwrap();
    let [from, to] = [outline, &polygon.outline].map(|p| p[1] - p[0]);
    let turn = DVec2::new(from.dot(to), from.perp_dot(to)).normalize();
    let of = |&point: &DVec2| {
        let mut values = vec![0.0; outline.len()];
        polygon.values(turn.rotate(point - outline[0]) + polygon.outline[0], &mut values);
        values
    };
    points.iter().map(of).collect()
}

fn largest_difference(a: &[Vec<f64>], b: &[Vec<f64>]) -> f64 {
    a.iter().flatten().zip(b.iter().flatten()).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

/// Points at four fractions of the way from the centre to each corner.
fn points_inside(outline: &[DVec2]) -> Vec<DVec2> {
    let middle = outline.iter().sum::<DVec2>() / outline.len() as f64;
    outline.iter().flat_map(|&corner| [0.1, 0.5, 0.9, 0.98].map(|t| middle + t * (corner - middle))).collect()
}

/// Moving a corner by `e` changes hats by at most `20 e / size`. This includes the transitions at which the corner
/// turns from convex to concave and at which its exterior angle is 1e-3 (`d = 2.5e-4`).
#[test]
fn hats_are_continuous_in_the_corners() {
    for (e, d) in [(1e-5, 0.2), (1e-3, 3e-2), (2e-5, 2.6e-4), (2e-5, 1e-5), (2e-5, -2.4e-4), (1e-5, -0.1)] {
        for (before, after) in nearly_straight(d).iter().zip(nearly_straight(d - e)) {
            let points = points_inside(before);
            let change = largest_difference(&face_values(before, &points), &face_values(&after, &points));
            let size = before.iter().map(|p| p.distance(before[0])).fold(0.0, f64::max);
            assert!(change <= 20.0 * e / size, "{change} for {e} at {d}, {} corners", before.len());
        }
    }
}

#[test]
fn hats_are_invariant_under_renumbering_scaling_and_reflection() {
    for outline in nearly_straight(-1e-3) {
        let points = points_inside(&outline);
        let expected = face_values(&outline, &points);
        let n = outline.len();
        for first in 0..n {
            let at = |k: usize| (k + first) % n;
            let turned: Vec<DVec2> = (0..n).map(|k| 7.3 * outline[at(k)]).collect();
            let mirrored: Vec<DVec2> =
                (0..n).map(|k| outline[at(n - 1 - k)] * DVec2::new(-1.0, 1.0)).collect();
            let [large, flipped] = [7.3 * DVec2::ONE, DVec2::new(-1.0, 1.0)]
                .map(|by| points.iter().map(|&p| p * by).collect::<Vec<_>>());
            let (turned, mirrored) = (face_values(&turned, &large), face_values(&mirrored, &flipped));
            for (p, expected) in expected.iter().enumerate() {
                for k in 0..n {
                    let off = [turned[p][k] - expected[at(k)], mirrored[p][k] - expected[at(n - 1 - k)]];
                    assert!(off.iter().all(|off| off.abs() < 1e-9), "corner {k} of {n}: {off:?}");
                }
            }
        }
    }
}

/// The outline of a cap touches itself: its corners 4 and 0 coincide.
#[test]
fn face_with_a_slit_has_hats() {
    let mut mesh = l_shape();
    mesh.positions[10] = mesh.positions[6];
    let cage = Cage::new(&mesh).unwrap();
    for t in 0..cage.facets().len() as u32 {
        for b in barycentrics() {
            let sum: f64 = hats(&cage, t, b).iter().sum();
            assert!((sum - 1.0).abs() <= ROUNDING, "{sum} in triangle {t} at {b:?}");
        }
    }
}

#[test]
fn face_with_many_corners_has_hats() {
    let outline: Vec<[f32; 2]> =
        (0..100).map(|k| (k as f32 * std::f32::consts::TAU / 100.0).sin_cos()).map(|(y, x)| [x, y]).collect();
    assert_linear_reproduction(&Cage::new(&prism(&outline, 1.0)).unwrap(), ROUNDING);
}

/// Star-shaped outlines: distances from the origin at ascending angles.
fn outlines(distance: std::ops::Range<f64>) -> impl Strategy<Value = Vec<DVec2>> {
    prop::collection::vec((0.2..1.0, distance), 4..12).prop_map(|corners| {
        let total: f64 = corners.iter().map(|c| c.0).sum();
        let mut angle = 0.0;
        corners
            .iter()
            .map(|&(step, distance)| {
                angle += step * std::f64::consts::TAU / total;
                distance * DVec2::from_angle(angle)
            })
            .collect()
    })
}

fn assert_coordinates(outline: &[DVec2], point: DVec2, values: &[f64]) {
    let sum: f64 = values.iter().sum();
    let combined: DVec2 = values.iter().zip(outline).map(|(&w, &q)| w * q).sum();
    assert!((sum - 1.0).abs() <= ROUNDING, "sum {sum}");
    assert!(combined.distance(point) <= ROUNDING, "{combined} is not {point}: {values:?}");
}

proptest! {
    #[test]
    fn wachspress_is_positive_and_linear_on_convex_polygons(
        outline in outlines(1.0..1.0001), r in 0.0..0.9f64, angle in 0.0..6.3f64,
    ) {
        // Neighbouring corners are at least 0.09 radians apart, and such an arc of the unit circle rises 1e-3 above its
        // chord. Distances from the origin differ by only 1e-4, so all corners are convex. The origin may be outside:
        // start from the mean of the corners.
        let center = outline.iter().sum::<DVec2>() / outline.len() as f64;
        let toward = outline[(angle * 100.0) as usize % outline.len()];
        let point = center + r * (toward - center);
        let mut values = vec![0.0; outline.len()];
        hats::wachspress(&outline, point, &mut values, &mut vec![0.0; outline.len()]);
        assert_coordinates(&outline, point, &values);
        prop_assert!(values.iter().all(|&w| w >= 0.0));
    }

    #[test]
    fn pseudo_harmonic_is_linear_on_any_polygon(
        outline in outlines(0.3..1.0), u in 0.0..1.0f64, v in 0.0..1.0f64, k in 0..4usize,
    ) {
        let n = outline.len();
        // The outline winds around the origin and is star-shaped with respect to it.
        prop_assume!((0..n).all(|k| outline[k].perp_dot(outline[(k + 1) % n]) > 1e-3));
        let (a, b) = (outline[k], outline[(k + 1) % n]);
        let point = u * (v * a + (1.0 - v) * b);
        let mut values = vec![0.0; outline.len()];
        hats::pseudo_harmonic(&outline, point, &mut values);
        assert_coordinates(&outline, point, &values);
    }

    #[test]
    fn ears_cover_the_polygon(outline in outlines(0.3..1.0)) {
        let n = outline.len();
        let twice_area: f64 = (0..n).map(|k| outline[k].perp_dot(outline[(k + 1) % n])).sum();
        let triangles = triangulate::ear_clip(&outline).unwrap();
        prop_assert_eq!(triangles.len(), n - 2);
        // Triangles of positive orientation with the polygon's total area neither overlap nor leave it.
        let areas: Vec<f64> = triangles
            .iter()
            .map(|t| t.map(|k| outline[k as usize]))
            .map(|[a, b, c]| triangulate::cross(a, b, c))
            .collect();
        prop_assert!(areas.iter().all(|&a| a > 0.0));
        prop_assert!((areas.iter().sum::<f64>() - twice_area).abs() <= ROUNDING);
    }
}

/// In projection along the normal, the first two corners of this face coincide. Found by fuzzing.
#[test]
fn hats_are_finite_on_a_quad_with_a_side_along_its_normal() {
    let corners = [[0.5, 0.5, 1.0], [1.0, 1.0, 0.5], [1.0, 0.0, 1.0], [0.5, 1.0, 0.0]].map(DVec3::from);
    let polygon = Polygon::new(&corners, 1.7).unwrap();
    assert!(polygon.outline.is_empty(), "hats are linear on each triangle: {polygon:?}");
    assert_eq!(polygon.triangles.len(), 2);
}
