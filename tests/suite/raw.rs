//! Solver errors, measured in rows of weights before they are corrected to reproduce the rest positions. Stencils and
//! sampling reproduce linear functions exactly, so all errors of these rows come from the solver.

use cagework_core::PolygonMesh;
use cagework_tests::cages::{c_shape, cage, moved, sphere, triangulated};
use cagework_tests::{RandomGenerator, points};

use super::BackEnd;

/// Largest allowed distance of a vertex at tau = 1e-5 from `sum w c` (weights w, cage vertices c), as a fraction of the
/// cage's diagonal.
const MAX_POINT_ERROR: f64 = 5e-5;

/// On a convex and a non-convex cage: the mean distance between `sum w c` and the vertex, relative to the cage's
/// diagonal, is below `mean` at tau = 1e-5, and at least ten times larger at tau = 1e-3.
pub(crate) fn tau_bounds_the_solver_error(back_end: &BackEnd, grids: &[u32], mean: f64) {
    let turn = RandomGenerator::new(30).rotation();
    let rotated = |mesh: &PolygonMesh| moved(mesh, |p| turn * p);
    for mesh in [sphere(1), rotated(&triangulated(&c_shape()))] {
        let cage = cage(&mesh);
        let points = points::inside(&cage, 1000, 30);
        for &grid in grids {
            let [fine, coarse] = [1e-5, 1e-3].map(|tau| {
                let binding = back_end.bind_with(&points, &cage, |o| (o.grid, o.tau) = (grid, tau));
                binding.report.raw_error.unwrap().point_rel
            });
            assert!(fine.mean < mean && fine.max < MAX_POINT_ERROR, "g = {grid}: {fine:?}");
            let ratio = coarse.mean / fine.mean;
            assert!(ratio >= 10.0, "g = {grid}: the error at tau = 1e-3 is only {ratio} times that at 1e-5");
        }
    }
}

/// Rounding must not be biased: multiplying by 1/6, which f32 rounds up, shifts the sum of all columns by 2.7e-5 on
/// average at g = 128; dividing by 6 shifts it by 1.0e-6.
pub(crate) fn rounding_does_not_add_up_over_columns(back_end: &BackEnd) {
    let cage = cage(&sphere(1));
    let points = points::inside(&cage, 1000, 30);
    let sum =
        back_end.bind_with(&points, &cage, |o| (o.grid, o.tau) = (128, 1e-5)).report.raw_error.unwrap().sum;
    assert!(sum.mean < 5e-6, "{sum:?}");
}
