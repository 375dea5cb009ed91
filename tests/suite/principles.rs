//! Defining properties of harmonic coordinates (Joshi et al. 2007): non-negativity, partition of unity, linear
//! precision, locality.

use cagework_core::{Cage, PolygonMesh};
use cagework_tests::cages::{
    blocks, c_prism, c_shape, cage, l_shape, moved, octahedron, sphere, tetrahedron, triangulated,
};
use cagework_tests::{RandomGenerator, assert_close, dense, points};
use glam::{Mat3, Vec3};

use super::{BackEnd, WEIGHT_TOLERANCE, assert_combined};

/// Smallest weight that counts as non-negative, because of rounding.
const MIN_WEIGHT: f32 = -1e-6;

/// Largest allowed deviation of a sum of weights from 1. It is due to rounding, and to the solver's error at
/// [`super::TAU`].
const SUM_TOLERANCE: f64 = 1e-5;

/// Largest allowed rest error, as a fraction of the cage's diagonal.
const REST_TOLERANCE: f64 = 1e-5;

/// Cages of triangles and quads, convex and non-convex, aligned with the grid and rotated.
pub(crate) fn cages() -> Vec<Cage> {
    let turn = RandomGenerator::new(7).rotation();
    let rotated = |mesh: &PolygonMesh| moved(mesh, |p| turn * p);
    let corners = [Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::Z];
    [
        tetrahedron(corners),
        octahedron(),
        sphere(1),
        l_shape(),
        rotated(&l_shape()),
        rotated(&triangulated(&c_shape())),
        c_prism(),
        blocks(&[[0, 0, 0]]),
    ]
    .iter()
    .map(cage)
    .collect()
}

pub(crate) fn weights_are_not_negative(back_end: &BackEnd) {
    for cage in cages() {
        let binding = back_end.bind(&points::inside(&cage, 400, 4), &cage);
        let min = dense(&binding.weights).into_iter().fold(f32::INFINITY, f32::min);
        assert!(min >= MIN_WEIGHT, "smallest weight {min}");
        assert!(binding.report.weights.min >= MIN_WEIGHT);
        // Stored weights are clipped at 0; this is the minimum before clipping.
        let sampled = binding.report.raw_error.unwrap().min_weight;
        assert!(sampled >= MIN_WEIGHT, "smallest weight {sampled} before clipping");
        assert!(binding.weights.data().iter().all(|w| w.is_finite()));
    }
}

pub(crate) fn weights_sum_to_one(back_end: &BackEnd) {
    for cage in cages() {
        // At this tau the sum is accurate everywhere, also before rows are corrected to sum to 1.
        let points = points::inside(&cage, 400, 5);
        let binding = back_end.bind_with(&points, &cage, |o| o.tau = 1e-8);
        for (v, (_, row)) in binding.weights.rows().enumerate() {
            let sum: f64 = row.iter().map(|&w| f64::from(w)).sum();
            assert!((sum - 1.0).abs() <= SUM_TOLERANCE, "weights of vertex {v} sum to {sum}");
        }
        assert!(binding.report.weights.max_sum_error <= SUM_TOLERANCE);
        assert!(binding.report.raw_error.unwrap().sum.max <= SUM_TOLERANCE, "{:?}", binding.report.raw_error);
    }
}

pub(crate) fn points_are_reproduced(back_end: &BackEnd) {
    for cage in cages() {
        let points = points::inside(&cage, 400, 6);
        let binding = back_end.bind(&points, &cage);
        let diagonal = f64::from(cage.diagonal());
        assert_eq!(binding.outside, []);
        assert_combined(&binding.weights, cage.positions(), &points, REST_TOLERANCE * diagonal);
        assert!(binding.report.rest_error.max_rel <= REST_TOLERANCE);
        // The raw error is the error before rows are corrected to reproduce the points at rest.
        let raw = binding.report.raw_error.unwrap().point_rel;
        assert!(raw.max <= f64::from(WEIGHT_TOLERANCE), "{raw:?}");
    }
}

pub(crate) fn affine_motion_is_followed(back_end: &BackEnd) {
    let cage = cage(&triangulated(&c_shape()));
    let points = points::inside(&cage, 400, 8);
    let binding = back_end.bind(&points, &cage);
    // The map contains shear, scaling, reflection and translation.
    let matrix = Mat3::from_cols_array(&[1.5, 0.3, -0.2, 0.4, -0.7, 0.1, 0.0, 0.6, 2.0]);
    let to = |p: &Vec3| matrix * *p + Vec3::new(3.0, -2.0, 1.0);
    let [posed, expected] = [cage.positions(), &points].map(|p| p.iter().map(to).collect::<Vec<_>>());
    // The map stretches no distance by more than a factor of three.
    assert_combined(&binding.weights, &posed, &expected, 3.0 * REST_TOLERANCE * f64::from(cage.diagonal()));
}

pub(crate) fn vertex_at_a_cage_vertex_has_weight_one(back_end: &BackEnd) {
    for cage in cages() {
        let n = cage.n_vertices();
        let binding = back_end.bind(cage.positions(), &cage);
        let identity: Vec<f32> = (0..n * n).map(|k| if k / n == k % n { 1.0 } else { 0.0 }).collect();
        assert_close(&dense(&binding.weights), &identity, WEIGHT_TOLERANCE);
        assert_eq!(binding.outside, [], "cage vertices lie on the cage");
    }
}

/// A cage vertex at the end of the upper arm of a C has little influence in the lower arm: its weights there are below
/// 1e-3 of its largest weight.
pub(crate) fn influence_stays_in_its_arm_of_a_c(back_end: &BackEnd) {
    const MAX_RATIO: f32 = 1e-3;
    for mesh in [c_shape(), c_prism()] {
        influence_stays(back_end, &mesh, MAX_RATIO);
    }
}

fn influence_stays(back_end: &BackEnd, mesh: &PolygonMesh, max_ratio: f32) {
    let cage = cage(mesh);
    let points = points::inside(&cage, 2000, 9);
    let binding = back_end.bind_with(&points, &cage, |o| o.grid = 32);
    let weights = dense(&binding.weights);
    let n = cage.n_vertices();
    let in_lower_arm = |p: &Vec3| p.x > 1.0 && p.y < 1.0;
    assert!(points.iter().filter(|p| in_lower_arm(p)).count() > 500);
    for (i, _) in cage.positions().iter().enumerate().filter(|(_, c)| c.y >= 2.0 && c.x >= 2.0) {
        let column = || points.iter().zip(weights[i..].iter().step_by(n));
        let max = column().fold(0.0, |max: f32, (_, &w)| max.max(w));
        let there = column().filter(|(p, _)| in_lower_arm(p)).fold(0.0, |max: f32, (_, &w)| max.max(w.abs()));
        assert!(max > 0.3, "cage vertex {i} influences its own arm");
        assert!(there < max_ratio * max, "cage vertex {i}: {there} in the other arm, {max} in its own");
    }
}

pub(crate) fn renumbering_the_cage_renumbers_the_weights(back_end: &BackEnd) {
    let mesh = c_shape();
    let n = mesh.positions.len() as u32;
    // 7 and n are coprime, so the map is a permutation that moves vertices to other batches.
    assert_ne!(n % 7, 0);
    let new_of = |i: u32| 7 * i % n;
    let mut renumbered = mesh.clone();
    for (i, &p) in (0..).zip(&mesh.positions) {
        renumbered.positions[new_of(i) as usize] = p;
    }
    for i in renumbered.faces.iter_mut().flatten() {
        *i = new_of(*i);
    }
    let (before, after) = (cage(&mesh), cage(&renumbered));
    let points = points::inside(&before, 300, 10);
    let [before, after] = [before, after].map(|cage| dense(&back_end.bind(&points, &cage).weights));
    let reordered: Vec<f32> =
        (0..before.len() as u32).map(|k| after[(k / n * n + new_of(k % n)) as usize]).collect();
    assert_close(&before, &reordered, WEIGHT_TOLERANCE);
}

/// The octahedron is symmetric in x; the grid, whose cell centres are offset slightly, is not.
pub(crate) fn mirrored_cage_has_mirrored_weights(back_end: &BackEnd) {
    /// Twice the largest error at g = 32 near the octahedron's edges, where second derivatives are unbounded.
    const DISCRETISATION_ERROR: f32 = 5e-3;
    let cage = cage(&octahedron());
    let points = points::inside(&cage, 300, 11);
    let mirrored: Vec<Vec3> = points.iter().map(|p| p * Vec3::new(-1.0, 1.0, 1.0)).collect();
    let bound = |points: &[Vec3]| dense(&back_end.bind_with(points, &cage, |o| o.grid = 32).weights);
    let mut swapped = bound(&mirrored);
    for row in swapped.chunks_mut(6) {
        row.swap(0, 1);
    }
    assert_close(&bound(&points), &swapped, DISCRETISATION_ERROR);
}

pub(crate) fn runs_are_bit_identical(back_end: &BackEnd) {
    let cage = cage(&triangulated(&c_shape()));
    let points = points::inside(&cage, 1500, 12);
    let first = back_end.bind(&points, &cage);
    for _ in 0..3 {
        let again = back_end.bind(&points, &cage);
        assert!(again.weights == first.weights, "weights differ from run to run");
        assert_eq!(again.report.delta_history, first.report.delta_history);
    }
}
