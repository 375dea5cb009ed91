//! What a solver leaves, seen in rows before they are restored: operator and sampling reproduce linear functions exactly.

use cagework_core::PolygonMesh;
use cagework_tests::cages::{c_shape, cage, moved, sphere, triangulated};
use cagework_tests::{Random, points};

use super::BackEnd;

/// What tau = 1e-5 may leave over the cage's diagonal, and of a sum: on average, and at worst.
const MEAN: f64 = 2e-6;
const LARGEST: f64 = 5e-5;

/// On a convex cage and on one that is not, at `grids`. Tau bounds the error: a hundred times more of it must show.
pub(crate) fn tau_bounds_what_the_solver_leaves(back_end: &BackEnd, grids: &[u32]) {
    let turn = Random::new(30).rotation();
    let askew = |mesh: &PolygonMesh| moved(mesh, |p| turn * p);
    for mesh in [sphere(1), askew(&triangulated(&c_shape()))] {
        let cage = cage(&mesh);
        let points = points::inside(&cage, 1000, 30);
        for &grid in grids {
            let [fine, coarse] = [1e-5, 1e-3].map(|tau| {
                let bound = back_end.bind_with(&points, &cage, |o| (o.grid, o.tau) = (grid, tau));
                bound.report.raw_error
            });
            for (what, fine, coarse) in
                [("sum", fine.sum, coarse.sum), ("point", fine.point_rel, coarse.point_rel)]
            {
                assert!(fine.mean < MEAN && fine.max < LARGEST, "{what} at g = {grid}: {fine:?}");
                let ratio = coarse.mean / fine.mean;
                assert!(ratio >= 10.0, "{what} at g = {grid}: tau = 1e-3 leaves {ratio} times as much");
            }
        }
    }
}
