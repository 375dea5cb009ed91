//! What a solver leaves, seen in rows before they are restored: operator and sampling reproduce linear functions exactly.

use cagework_core::PolygonMesh;
use cagework_tests::cages::{c_shape, cage, moved, sphere, triangulated};
use cagework_tests::{Random, points};

use super::BackEnd;

/// Largest distance from the vertex over the cage's diagonal that tau = 1e-5 may leave.
const LARGEST: f64 = 5e-5;

/// On a convex cage and on one that is not, at `grids`: `sum w c` misses the vertex by less than `mean` on average (over the
/// cage's diagonal, tau = 1e-5), and a tau a hundred times as large shows.
pub(crate) fn tau_bounds_what_the_solver_leaves(back_end: &BackEnd, grids: &[u32], mean: f64) {
    let turn = Random::new(30).rotation();
    let askew = |mesh: &PolygonMesh| moved(mesh, |p| turn * p);
    for mesh in [sphere(1), askew(&triangulated(&c_shape()))] {
        let cage = cage(&mesh);
        let points = points::inside(&cage, 1000, 30);
        for &grid in grids {
            let [fine, coarse] = [1e-5, 1e-3].map(|tau| {
                let binding = back_end.bind_with(&points, &cage, |o| (o.grid, o.tau) = (grid, tau));
                binding.report.raw_error.point_rel
            });
            assert!(fine.mean < mean && fine.max < LARGEST, "g = {grid}: {fine:?}");
            let ratio = coarse.mean / fine.mean;
            assert!(ratio >= 10.0, "g = {grid}: tau = 1e-3 leaves only {ratio} times as much");
        }
    }
}

/// f32 must not pull all columns to the same side: at g = 128 their sum was off by 2.7e-5 on average where cells were
/// multiplied by 1/6, which f32 rounds up, and is by 1.0e-6 where they are divided by 6.
pub(crate) fn rounding_does_not_add_up_over_columns(back_end: &BackEnd) {
    let cage = cage(&sphere(1));
    let points = points::inside(&cage, 1000, 30);
    let sum = back_end.bind_with(&points, &cage, |o| (o.grid, o.tau) = (128, 1e-5)).report.raw_error.sum;
    assert!(sum.mean < 5e-6, "{sum:?}");
}
