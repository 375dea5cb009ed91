//! Kinds of cages: polygons, bent quads, several components, thin parts, any size and position.

use cagework_tests::cages::{
    blocks, c_shape, cage, cuboid, inside_out, l_shape, moved, pentagonal_prism, sphere, thin_bar, together,
    triangulated,
};
use cagework_tests::{RandomGenerator, assert_close, dense, points};
use glam::Vec3;

use super::{BackEnd, TAU, WEIGHT_TOLERANCE, assert_combined};

pub(crate) fn inside_out_cage_gives_the_same_weights(back_end: &BackEnd) {
    let mesh = triangulated(&l_shape());
    let (outward, inward) = (cage(&mesh), cage(&inside_out(&mesh)));
    let points = points::inside(&outward, 300, 70);
    let [a, b] = [outward, inward].map(|cage| back_end.bind(&points, &cage));
    assert_close(&dense(&a.weights), &dense(&b.weights), WEIGHT_TOLERANCE);
    assert!(a.report.notices.is_empty() && b.report.notices.len() == 1, "{:?}", b.report.notices);
}

pub(crate) fn unused_cage_vertex_has_no_weight(back_end: &BackEnd) {
    let mesh = l_shape();
    let mut with_one_more = mesh.clone();
    // Insert the unused vertex first, so that all other columns are shifted by one. It is so far away that it would
    // enlarge the grid if it were used.
    with_one_more.positions.insert(0, Vec3::splat(50.0));
    for i in with_one_more.faces.iter_mut().flatten() {
        *i += 1;
    }
    let (without, with) = (cage(&mesh), cage(&with_one_more));
    let points = points::inside(&without, 300, 71);
    let [without, with] = [without, with].map(|cage| back_end.bind(&points, &cage).weights);
    assert_eq!(with.n_columns(), without.n_columns() + 1);
    let kept: Vec<f32> = dense(&with).chunks(with.n_columns()).flat_map(|row| row[1..].to_vec()).collect();
    assert!(dense(&with).iter().step_by(with.n_columns()).all(|&w| w == 0.0));
    assert_close(&kept, &dense(&without), WEIGHT_TOLERANCE);
}

pub(crate) fn components_do_not_feel_each_other(back_end: &BackEnd) {
    // The gap is smaller than a cell of the coarse levels.
    let gap = if back_end.is_embedded() { 0.01 } else { 0.5 };
    let second = moved(&sphere(1), |p| p + Vec3::new(2.0 + gap, 0.0, 0.0));
    let both = cage(&together(&sphere(1), &second));
    let points = points::inside(&both, 500, 72);
    let binding = back_end.bind(&points, &both);
    let n_first = sphere(1).positions.len() as u32;
    for (v, p) in points.iter().enumerate() {
        let in_first = p.x < 1.0 + 0.5 * gap;
        let (columns, row) = binding.weights.row(v);
        for (&i, &w) in columns.iter().zip(row) {
            // Coarse levels of multigrid couple both components; the cycles reduce this coupling below tau.
            assert!(
                (i < n_first) == in_first || w < TAU,
                "vertex {v} at {p} has weight {w} of cage vertex {i}"
            );
        }
    }
}

/// Weights do not depend on the unit of length.
pub(crate) fn weights_are_independent_of_scale(back_end: &BackEnd) {
    let mesh = triangulated(&c_shape());
    let points = points::inside(&cage(&mesh), 300, 73);
    let bound = |scale: f32| {
        let points: Vec<Vec3> = points.iter().map(|p| p * scale).collect();
        dense(&back_end.bind(&points, &cage(&moved(&mesh, |p| p * scale))).weights)
    };
    let unit = bound(1.0);
    // Powers of two scale f32 exactly, so that no vertex changes its cell by rounding.
    for scale in [2f32.powi(-12), 2f32.powi(14)] {
        assert_close(&bound(scale), &unit, WEIGHT_TOLERANCE);
    }
}

pub(crate) fn cage_far_from_the_origin_is_bound(back_end: &BackEnd) {
    // At this distance from the origin f32 has steps of 2^-14.
    let shift = Vec3::new(1000.0, -500.0, 800.0);
    let mesh = moved(&c_shape(), |p| p + shift);
    let cage = cage(&mesh);
    let points = points::inside(&cage, 300, 74);
    let binding = back_end.bind(&points, &cage);
    assert_eq!(binding.outside, []);
    // Sums of f32 weights are 1 to within 2e-7; the distance to the origin, 1,400, multiplies that error.
    assert_combined(&binding.weights, cage.positions(), &points, 3e-4);
    assert!(binding.report.weights.max_sum_error <= 1e-5);
}

pub(crate) fn polygons_reproduce_points(back_end: &BackEnd) {
    let turn = RandomGenerator::new(75).rotation();
    for mesh in [pentagonal_prism(), moved(&pentagonal_prism(), |p| turn * p)] {
        let cage = cage(&mesh);
        let points = points::inside(&cage, 400, 75);
        let binding = back_end.bind(&points, &cage);
        assert_eq!(binding.outside, []);
        assert_combined(&binding.weights, cage.positions(), &points, 1e-5 * f64::from(cage.diagonal()));
    }
}

pub(crate) fn quads_that_are_not_planar_reproduce_points(back_end: &BackEnd) {
    let mut random = RandomGenerator::new(76);
    let shaken: Vec<Vec3> = c_shape()
        .positions
        .iter()
        .map(|&p| p + random.point(Vec3::splat(-0.15), Vec3::splat(0.15)))
        .collect();
    let mut mesh = c_shape();
    mesh.positions = shaken;
    let cage = cage(&mesh);
    let points = points::inside(&cage, 600, 76);
    let binding = back_end.bind(&points, &cage);
    assert_eq!(binding.outside, []);
    assert_combined(&binding.weights, cage.positions(), &points, 1e-5 * f64::from(cage.diagonal()));
    assert!(binding.report.weights.min >= -1e-6);
}

/// Thin parts, such as the leg of a horse on a coarse grid, contain few or no cell centres.
pub(crate) fn parts_thinner_than_a_cell_get_weights(back_end: &BackEnd) {
    let leg = moved(&blocks(&[[0, 0, 0], [0, 0, 1]]), |p| p * Vec3::new(0.02, 0.02, 1.0));
    let with_body = together(&cuboid(Vec3::new(1.0, 0.0, 0.0), Vec3::new(2.0, 1.0, 2.0)), &leg);
    for mesh in [thin_bar(0.5), thin_bar(0.1), thin_bar(0.01), with_body] {
        let cage = cage(&mesh);
        // Few points, because rejection sampling needs about a hundred attempts each.
        let points = points::inside(&cage, 60, 77);
        for grid in [8, 16] {
            let binding = back_end.bind_with(&points, &cage, |o| o.grid = grid);
            assert_eq!(binding.outside, [], "g = {grid}");
            assert!(binding.weights.rows().all(|(_, row)| !row.is_empty()));
            assert!(binding.report.weights.min >= -1e-6 && binding.report.weights.max_sum_error <= 1e-5);
            let diagonal = f64::from(cage.diagonal());
            assert_combined(&binding.weights, cage.positions(), &points, 1e-5 * diagonal);
        }
    }
}
