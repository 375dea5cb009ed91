//! Comparison of two back ends.

use cagework_tests::cages::{c_shape, cage, moved, triangulated};
use cagework_tests::{RandomGenerator, assert_close, dense, points};

use super::{BackEnd, WEIGHT_TOLERANCE};

/// The weights of two solvers of the same equations differ by less than the solvers' error bound.
pub(crate) fn solvers_agree(a: &BackEnd, b: &BackEnd) {
    let turn = RandomGenerator::new(20).rotation();
    for mesh in [c_shape(), moved(&triangulated(&c_shape()), |p| turn * p)] {
        let cage = cage(&mesh);
        let points = points::inside(&cage, 800, 20);
        let [x, y] = [a, b].map(|s| s.bind_with(&points, &cage, |o| o.grid = 24));
        assert!(x.report.converged && y.report.converged);
        assert_close(&dense(&x.weights), &dense(&y.weights), WEIGHT_TOLERANCE);
        assert_eq!(x.report.cells, y.report.cells);
    }
}

/// Each thread owns whole columns, so only the number of iterations could depend on the number of threads.
pub(crate) fn threads_agree(one: &BackEnd, many: &BackEnd) {
    let cage = cage(&triangulated(&c_shape()));
    let points = points::inside(&cage, 1500, 21);
    let [x, y] = [one, many].map(|s| s.bind_with(&points, &cage, |o| o.tau = 1e-5));
    assert_close(&dense(&x.weights), &dense(&y.weights), WEIGHT_TOLERANCE);
    assert_eq!(x.report.iterations, y.report.iterations);
    assert_eq!((x.report.threads, x.report.cells), (1, y.report.cells));
}
