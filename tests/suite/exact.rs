//! Cages whose harmonic coordinates are known in closed form.

use cagework_tests::cages::{cage, cuboid, moved, tetrahedron};
use cagework_tests::{RandomGenerator, assert_close, dense, points};
use glam::{DMat3, DVec3, Vec3};

use super::{BackEnd, WEIGHT_TOLERANCE};

/// Corners of a tetrahedron without symmetry.
const CORNERS: [Vec3; 4] = [
    Vec3::new(0.1, -0.2, 0.0),
    Vec3::new(1.3, 0.1, 0.2),
    Vec3::new(0.2, 1.1, -0.1),
    Vec3::new(0.4, 0.3, 1.2),
];

/// Computes the barycentric coordinates of a point in the tetrahedron with the corners [`CORNERS`].
fn barycentric(p: Vec3) -> [f32; 4] {
    let [a, b, c, d] = CORNERS.map(Vec3::as_dvec3);
    let w = DMat3::from_cols(b - a, c - a, d - a).inverse() * (p.as_dvec3() - a);
    [1.0 - w.element_sum(), w.x, w.y, w.z].map(|w| w as f32)
}

/// Computes trilinear coordinates in the box from 0 to `size`, in the vertex order of [`cuboid`].
fn trilinear(p: DVec3, size: DVec3) -> [f32; 8] {
    let t = p / size;
    std::array::from_fn(|v| {
        (0..3).map(|a| if v >> a & 1 == 0 { 1.0 - t[a] } else { t[a] }).product::<f64>() as f32
    })
}

pub(crate) fn tetrahedron_is_barycentric(back_end: &BackEnd) {
    let cage = cage(&tetrahedron(CORNERS));
    let points = points::inside(&cage, 300, 1);
    let expected: Vec<f32> = points.iter().flat_map(|&p| barycentric(p)).collect();
    for grid in [8, 16, 25] {
        let binding = back_end.bind_with(&points, &cage, |o| o.grid = grid);
        assert_close(&dense(&binding.weights), &expected, WEIGHT_TOLERANCE);
    }
}

/// The classic method takes boundary values at the point of the cage closest to a cell's centre, and a vertex takes the
/// weights of its cell. Each of these two approximations moves a point by at most half a cell's diagonal. The exact
/// coordinates are linear, so their slope times a cell's diagonal bounds the error.
pub(crate) fn tetrahedron_is_barycentric_within_a_cell(back_end: &BackEnd) {
    let cage = cage(&tetrahedron(CORNERS));
    let points = points::inside(&cage, 300, 1);
    let expected: Vec<f32> = points.iter().flat_map(|&p| barycentric(p)).collect();
    let binding = back_end.bind_with(&points, &cage, |o| o.grid = 32);
    // Steepest slope of a coordinate. Each coordinate decreases from 1 at its corner to 0 on the opposite face.
    let steepest = (0..4)
        .map(|k| {
            let [a, b, c] = [1, 2, 3].map(|j| CORNERS[(k + j) % 4]);
            let normal = (b - a).cross(c - a).normalize();
            1.0 / (CORNERS[k] - a).dot(normal).abs()
        })
        .fold(0.0, f32::max);
    let diagonal = Vec3::from_array(binding.report.cell_size).length();
    assert_close(&dense(&binding.weights), &expected, steepest * diagonal);
}

pub(crate) fn box_is_trilinear(back_end: &BackEnd) {
    for size in [Vec3::ONE, Vec3::new(1.0, 2.0, 3.0)] {
        let cage = cage(&cuboid(Vec3::ZERO, size));
        let points = points::inside(&cage, 500, 2);
        let expected: Vec<f32> =
            points.iter().flat_map(|p| trilinear(p.as_dvec3(), size.as_dvec3())).collect();
        assert_close(&dense(&back_end.bind(&points, &cage).weights), &expected, WEIGHT_TOLERANCE);
    }
}

/// A box rotated against the grid: the exact coordinates are trilinear in the box's axes.
pub(crate) fn error_is_second_order(back_end: &BackEnd) {
    let size = Vec3::new(1.0, 1.4, 0.8);
    let turn = RandomGenerator::new(3).rotation();
    let cage = cage(&moved(&cuboid(Vec3::ZERO, size), |p| turn * p));
    let points = points::inside(&cage, 1000, 3);
    let into_box = turn.as_dquat().inverse();
    let expected: Vec<f32> =
        points.iter().flat_map(|p| trilinear(into_box * p.as_dvec3(), size.as_dvec3())).collect();
    let errors = [10, 20, 40].map(|grid| {
        // On a finer grid Jacobi converges more slowly, so the same tau leaves a larger error. With 1e-8 the error of
        // discretization dominates on all three grids.
        let binding = back_end.bind_with(&points, &cage, |o| (o.grid, o.tau) = (grid, 1e-8));
        let got = dense(&binding.weights);
        got.iter().zip(&expected).map(|(a, b)| f64::from((a - b).abs())).sum::<f64>() / got.len() as f64
    });
    for pair in errors.windows(2) {
        // Second order reduces the error to about a quarter. The factor varies, because cells intersect the cage
        // differently on each grid.
        let ratio = pair[0] / pair[1];
        assert!(
            (3.0..5.5).contains(&ratio),
            "errors {errors:?} decrease by a factor of {ratio}; second order is 4"
        );
    }
}
