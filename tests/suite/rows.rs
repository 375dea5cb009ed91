//! Rows of the weights, and the report of the solve.

use cagework_tests::cages::{c_shape, cage, triangulated};
use cagework_tests::points;
use glam::{Mat3, Vec3};

use super::{BackEnd, assert_combined};

pub(crate) fn equal_positions_have_equal_rows(back_end: &BackEnd) {
    let cage = cage(&c_shape());
    let mut points = points::inside(&cage, 50, 60);
    points.push(-Vec3::ONE);
    let n = points.len();
    // Duplicate positions in another order, as at a texture seam.
    let twice: Vec<Vec3> = points.iter().chain(points.iter().rev()).copied().collect();
    let binding = back_end.bind(&twice, &cage);
    assert_eq!(binding.weights.n_rows(), 2 * n);
    for v in 0..n {
        assert_eq!(binding.weights.row(v), binding.weights.row(2 * n - 1 - v));
    }
    let outside: Vec<u32> = binding.outside.iter().map(|o| o.vertex).collect();
    assert_eq!(outside, [n as u32 - 1, n as u32], "both copies are outside");
    let once = back_end.bind(&points, &cage);
    for v in 0..n {
        assert_eq!(binding.weights.row(v), once.weights.row(v));
    }
}

pub(crate) fn limit_on_iterations_is_reported(back_end: &BackEnd) {
    let cage = cage(&c_shape());
    let points = points::inside(&cage, 50, 61);
    let stopped = back_end.bind_with(&points, &cage, |o| o.max_iterations = 1).report;
    assert_eq!((stopped.iterations, stopped.converged), (1, false));
    let ended = back_end.bind_with(&points, &cage, |o| o.tau = 1e-5).report;
    assert!(ended.converged && ended.iterations > 1);
    assert!(ended.iterations < back_end.options.max_iterations);
}

pub(crate) fn history_has_one_entry_per_iteration(back_end: &BackEnd) {
    let cage = cage(&c_shape());
    let points = points::inside(&cage, 50, 62);
    let report = back_end.bind_with(&points, &cage, |o| o.tau = 1e-5).report;
    assert_eq!(report.delta_history.len() as u32, report.iterations.div_ceil(report.delta_interval));
    assert!(report.delta_history.iter().all(|d| d.is_finite() && *d >= 0.0));
    let [first, last] = [report.delta_history.first(), report.delta_history.last()].map(|d| *d.unwrap());
    assert!(last < first, "delta falls from {first} to {last}");
    let times = report.timings_ms;
    assert!(times.voxelize + times.solve + times.sample <= times.total * 1.001 && times.total > 0.0);
    assert_eq!((report.vertices, report.cage_vertices), (50, cage.n_vertices() as u64));
}

/// A solve whose tau is below the precision of f32 ends at the rounding level, in few cycles. (Jacobi is not tested: it
/// ends only after 128 sweeps without progress.)
pub(crate) fn tau_below_round_off_ends(back_end: &BackEnd) {
    let cage = cage(&c_shape());
    let points = points::inside(&cage, 50, 65);
    let report = back_end.bind_with(&points, &cage, |o| o.tau = 1e-12).report;
    assert!(
        report.converged && report.at_round_off && report.iterations < 40,
        "{} cycles",
        report.iterations
    );
    assert!(report.delta_history.last().is_some_and(|d| *d < 1e-6));
}

/// Dropping small weights keeps each row's sum within 1e-5 of 1, and at most doubles the rest error. With the classic
/// method, the rest error may even decrease.
pub(crate) fn dropping_small_weights_keeps_sums_and_rest_pose(back_end: &BackEnd) {
    let cage = cage(&triangulated(&c_shape()));
    let points = points::inside(&cage, 1000, 63);
    let all = back_end.bind_with(&points, &cage, |o| o.grid = 24);
    let sparse = back_end.bind_with(&points, &cage, |o| (o.grid, o.sparsify) = (24, 1e-5));
    assert!(sparse.weights.data().len() < all.weights.data().len(), "weights were dropped");
    let (all, sparse) = (all.report, sparse.report);
    assert!(sparse.weights.nonzeros < all.weights.nonzeros);
    assert!(sparse.weights.max_sum_error <= 1e-5 && sparse.weights.min >= -1e-6);
    let [before, after] = [all.rest_error, sparse.rest_error];
    assert!(after.mean_rel <= 2.0 * before.mean_rel, "mean {} after {}", after.mean_rel, before.mean_rel);
    assert!(after.max_rel <= 2.0 * before.max_rel, "max {} after {}", after.max_rel, before.max_rel);
}

pub(crate) fn sparse_weights_follow_affine_motion(back_end: &BackEnd) {
    let cage = cage(&triangulated(&c_shape()));
    let points = points::inside(&cage, 1000, 64);
    // A threshold large enough to drop significant weights.
    let binding = back_end.bind_with(&points, &cage, |o| o.sparsify = 1e-3);
    let matrix = Mat3::from_cols_array(&[1.5, 0.3, -0.2, 0.4, -0.7, 0.1, 0.0, 0.6, 2.0]);
    let [posed, expected] =
        [cage.positions(), &points].map(|p| p.iter().map(|&p| matrix * p).collect::<Vec<_>>());
    assert_combined(&binding.weights, &posed, &expected, 3e-5 * f64::from(cage.diagonal()));
    let smallest = binding.weights.data().iter().fold(f32::INFINITY, |m, &w| m.min(w));
    assert!(smallest > 0.0, "a weight that was kept is not positive: {smallest}");
}
