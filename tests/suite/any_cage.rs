//! Difficult cages: parts that share faces or overlap, re-entrant edges, bent quads, and faces that the grid cannot
//! resolve; also the threshold of sparse weights. Figures at g = 64 are in `docs/notes/any-cage.md`.

use cagework_core::{Bounds, Cage, PolygonMesh, Weights, subdivided_box};
use cagework_tests::cages::{cage, cuboid, icosphere, l_shape, moved, sphere, together};
use cagework_tests::{RandomGenerator, dense, points};
use glam::{DVec3, Quat, Vec3};

use super::reference::armadillo_cage;
use super::{BackEnd, combined, principles};

/// Finds the largest difference between two matrices of weights.
fn largest_change(a: &Weights, b: &Weights) -> f32 {
    dense(a).iter().zip(dense(b)).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max)
}

/// Twists points smoothly: rotates each point about y by `0.5 * p.y / size` radians.
fn twisted(points: &[Vec3], size: f32) -> Vec<Vec3> {
    points.iter().map(|&p| Quat::from_rotation_y(0.5 * p.y / size) * p).collect()
}

/// Dropped weights are redistributed: no weight becomes negative or changes by more than 5 times the threshold, and a
/// smooth pose changes by at most 1e-3 of the diagonal. (Dropping without redistribution changes weights by 0.5 on an
/// icosphere of 642 vertices.)
pub(crate) fn sparsify_changes_weights_and_poses_little(back_end: &BackEnd) {
    let mut n_dropped = 0;
    for cage in principles::cages().into_iter().chain([2, 3].map(|times| cage(&icosphere(times)))) {
        let points = points::inside(&cage, 400, 71);
        let all = back_end.bind_with(&points, &cage, |o| o.grid = 32).weights;
        let sparse = back_end.bind_with(&points, &cage, |o| (o.grid, o.sparsify) = (32, 1e-3)).weights;
        n_dropped += all.data().len() - sparse.data().len();
        assert!(sparse.data().iter().all(|w| *w > 0.0));
        let change = largest_change(&all, &sparse);
        assert!(change <= 5e-3, "a weight of {} vertices changes by {change}", cage.n_vertices());
        let posed = twisted(cage.positions(), cage.diagonal());
        let [all, sparse] = [all, sparse].map(|weights| combined(&weights, &posed));
        let off = all.iter().zip(&sparse).map(|(a, b)| a.distance(*b)).fold(0.0, f64::max);
        let off = off / f64::from(cage.diagonal());
        assert!(off <= 1e-3, "a pose of {} vertices is off by {off}", cage.n_vertices());
    }
    assert!(n_dropped > 1000, "{n_dropped} weights were dropped");
}

/// Asserts that the weights of two closed parts in one cage equal the weights of each part as a cage of its own.
fn assert_independent(back_end: &BackEnd, a: &PolygonMesh, b: &PolygonMesh, tolerance: f32) {
    let both = cage(&together(a, b));
    let n = a.positions.len();
    for (mesh, columns) in [(a, 0..n), (b, n..both.n_vertices())] {
        let alone = cage(mesh);
        let points = points::inside(&alone, 300, 72);
        // Use the cell size that the cage of both parts has at g = 64.
        let length = |c: &Cage| c.bounds().extent().max_element();
        let grid = (64.0 * length(&alone) / length(&both)).round() as u32;
        let expected = dense(&back_end.bind_with(&points, &alone, |o| o.grid = grid).weights);
        let got = dense(&back_end.bind_with(&points, &both, |o| o.grid = 64).weights);
        for v in 0..points.len() {
            for column in 0..both.n_vertices() {
                let w = got[v * both.n_vertices() + column];
                let alone =
                    columns.contains(&column).then(|| expected[v * columns.len() + column - columns.start]);
                let off = (w - alone.unwrap_or(0.0)).abs();
                assert!(off <= tolerance, "vertex {v}, column {column}: {w}, alone {alone:?}");
            }
        }
    }
}

/// Two parts that share a face, fully or partly, aligned with the grid or rotated, have independent weights.
pub(crate) fn parts_that_share_a_face_do_not_leak(back_end: &BackEnd) {
    let turn = RandomGenerator::new(73).rotation();
    let upper = cuboid(Vec3::new(0.0, 1.0, 0.0), Vec3::new(1.0, 2.0, 1.0));
    let smaller = cuboid(Vec3::new(0.25, 1.0, 0.5), Vec3::new(0.75, 2.0, 1.0));
    for other in [upper, smaller] {
        let lower = cuboid(Vec3::ZERO, Vec3::ONE);
        assert_independent(back_end, &lower, &other, 2e-3);
        let [a, b] = [lower, other].map(|mesh| moved(&mesh, |p| turn * p));
        assert_independent(back_end, &a, &b, 8e-3);
    }
}

/// Estimates harmonic coordinates of the union of two boxes at a point by Walk on Spheres (Muller 1956). Each step
/// jumps to a random point of the largest sphere inside one of the boxes. A walk ends within 1e-4 of the union's
/// boundary, with the trilinear coordinates of its last point in the box that contains this point.
fn walk_on_spheres(
    boxes: &[[DVec3; 2]; 2],
    from: DVec3,
    n_walks: u32,
    random: &mut RandomGenerator,
) -> [f64; 16] {
    let mut sums = [0.0; 16];
    for _ in 0..n_walks {
        let mut p = from;
        let near = loop {
            let room = boxes.map(|[low, high]| (p - low).min(high - p).min_element());
            let k = usize::from(room[1] > room[0]);
            if room[k] < 1e-4 {
                break k;
            }
            let z = f64::from(random.between(-1.0, 1.0));
            let (sin, cos) = f64::from(random.between(0.0, std::f32::consts::TAU)).sin_cos();
            let r = (1.0 - z * z).sqrt();
            p += room[k] * DVec3::new(r * cos, r * sin, z);
        };
        let [low, high] = boxes[near];
        let t = ((p - low) / (high - low)).clamp(DVec3::ZERO, DVec3::ONE);
        for corner in 0..8 {
            let factor = |a: usize| if corner >> a & 1 == 1 { t[a] } else { 1.0 - t[a] };
            sums[8 * near + corner] += factor(0) * factor(1) * factor(2) / f64::from(n_walks);
        }
    }
    sums
}

/// Overlapping parts are bound as their union, with a notice: walls inside the union do not stop the field.
pub(crate) fn overlapping_parts_are_bound_as_one(back_end: &BackEnd) {
    let overlap = 0.03 * 6.0 / 64.0;
    let limbs = [
        // The first limb is half inside the body, the second overlaps the body by 3 % of a cell.
        [DVec3::new(2.0, 1.2, 1.3), DVec3::new(6.0, 2.6, 2.7)],
        [DVec3::new(4.0 - overlap, 1.2, 1.3), DVec3::new(6.0, 2.6, 2.7)],
    ];
    for limb in limbs {
        let boxes = [[DVec3::ZERO, DVec3::splat(4.0)], limb];
        let [body, arm] = boxes.map(|[low, high]| cuboid(low.as_vec3(), high.as_vec3()));
        let both = cage(&together(&body, &arm));
        let points: Vec<Vec3> = [
            [3.0, 2.0, 2.0],
            // The next three points are 0.001 from a wall inside the union, which sampling rays may hit.
            [3.999, 1.9, 1.9],
            [4.001, 2.0, 1.8],
            [2.001, 2.0, 2.1],
            [4.5, 1.6, 2.0],
            [5.5, 2.2, 1.5],
            [1.0, 3.0, 0.5],
            [2.5, 1.3, 2.0],
        ]
        .map(Vec3::from)
        .to_vec();
        let binding = back_end.bind_with(&points, &both, |o| o.grid = 64);
        assert_eq!(binding.report.outside_vertices, 0);
        let notices = &binding.report.notices;
        assert!(notices.iter().any(|n| n.contains("Parts of the cage overlap")), "{notices:?}");
        let mut random = RandomGenerator::new(74);
        let weights = dense(&binding.weights);
        for (v, p) in points.iter().enumerate() {
            let expected = walk_on_spheres(&boxes, p.as_dvec3(), 20_000, &mut random);
            for (column, expected) in expected.into_iter().enumerate() {
                let w = f64::from(weights[16 * v + column]);
                assert!((w - expected).abs() < 0.02, "{p}, column {column}: {w}, not {expected}");
            }
        }
    }
}

/// Two bars of a cross, whose upper and lower faces are flush. Where they cross, rays and grid lines meet both faces at
/// the same place up to rounding, so a wall must be chosen by more than its place. The weights of the first bar along a
/// line just above the lower faces then change smoothly, and little with the grid.
pub(crate) fn flush_walls_of_overlapping_parts_are_one(back_end: &BackEnd) {
    let bars = [[[0.0, 0.3, 0.3], [1.0, 0.7, 0.7]], [[0.3, 0.0, 0.3], [0.7, 1.0, 0.7]]];
    let [a, b] = bars.map(|[low, high]| cuboid(Vec3::from(low), Vec3::from(high)));
    let both = cage(&together(&a, &b));
    let points: Vec<Vec3> =
        (0..=20u8).map(|k| Vec3::new(0.025 + 0.0475 * f32::from(k), 0.5, 0.301)).collect();
    let first_bar = |grid| -> Vec<f32> {
        let binding = back_end.bind_with(&points, &both, |o| o.grid = grid);
        dense(&binding.weights).chunks(16).map(|row| row[..8].iter().sum()).collect()
    };
    let (coarse, fine) = (first_bar(64), first_bar(128));
    for (k, (a, b)) in coarse.iter().zip(&fine).enumerate() {
        assert!((a - b).abs() < 0.05, "{}: {a} at g = 64, {b} at 128", points[k]);
    }
    for pair in coarse.windows(3) {
        assert!((pair[0] - 2.0 * pair[1] + pair[2]).abs() < 0.4, "{pair:?}");
    }
}

/// Finds the re-entrant edges of a cage. An edge counts as re-entrant if more than 60 % of random points near it are
/// inside.
fn re_entrant_edges(cage: &Cage, near: f32) -> Vec<[Vec3; 2]> {
    let mut random = RandomGenerator::new(75);
    let sides = cage.faces().iter().flat_map(|f| (0..f.len()).map(|k| [f[k], f[(k + 1) % f.len()]]));
    let edges = sides.filter(|[a, b]| a < b).map(|edge| edge.map(|i| cage.positions()[i as usize]));
    edges
        .filter(|[a, b]| {
            let around = (0..100).map(|_| a.midpoint(*b) + near * random.point(Vec3::NEG_ONE, Vec3::ONE));
            around.filter(|&p| points::is_inside(cage, p)).count() > 60
        })
        .collect()
}

/// Finds the largest change of a weight between points 1/250 of a cell apart, on lines near re-entrant edges that keep
/// a distance of at least 0.1 cells from them.
fn largest_jump(back_end: &BackEnd, cage: &Cage, grid: u32) -> f32 {
    let cell = cage.bounds().extent().max_element() / grid as f32;
    let edges = re_entrant_edges(cage, 0.1 * cell);
    assert!(!edges.is_empty());
    let mut random = RandomGenerator::new(77);
    let lines = (0..1000).map(|k| {
        let [a, b] = edges[k % edges.len()];
        let near = a.lerp(b, random.between(0.2, 0.8));
        let ends = [0, 1].map(|_| near + 1.5 * cell * random.point(Vec3::NEG_ONE, Vec3::ONE));
        let n = (ends[0].distance(ends[1]) / (0.004 * cell)).ceil() as usize;
        let line: Vec<Vec3> = (0..=n).map(|k| ends[0].lerp(ends[1], k as f32 / n as f32)).collect();
        let way = (b - a).normalize();
        // Keep a distance from the edge, on which the exact field is arbitrarily steep.
        let is_clear =
            |p: &Vec3| (*p - a).reject_from(way).length() > 0.1 * cell && points::is_inside(cage, *p);
        if line.iter().all(is_clear) { line } else { Vec::new() }
    });
    let lines: Vec<Vec<Vec3>> = lines.filter(|line| line.len() > 1).take(200).collect();
    let weights = dense(&back_end.bind_with(&lines.concat(), cage, |o| o.grid = grid).weights);
    let mut rows = weights.chunks(cage.n_vertices());
    let mut largest = 0.0f32;
    for line in &lines {
        let rows: Vec<&[f32]> = rows.by_ref().take(line.len()).collect();
        for (before, after) in rows.windows(2).map(|w| (w[0], w[1])) {
            largest = before.iter().zip(after).map(|(b, a)| (b - a).abs()).fold(largest, f32::max);
        }
    }
    largest
}

/// Next to re-entrant edges, weights change by at most 4e-3 per 1/250 of a cell at g = 64, and by more at g = 32.
/// Weights would jump if sampling rays that just miss an edge gave other values than rays that hit it.
pub(crate) fn weights_do_not_jump_at_re_entrant_edges(back_end: &BackEnd) {
    let turn = RandomGenerator::new(76).rotation();
    let rotated = moved(&l_shape(), |p| turn * p);
    for cage in [cage(&l_shape()), cage(&rotated), armadillo_cage()] {
        let [coarse, fine] = [32, 64].map(|grid| largest_jump(back_end, &cage, grid));
        println!("{} vertices: jumps of {coarse} at g = 32, {fine} at g = 64", cage.n_vertices());
        assert!(fine <= 4e-3, "a weight jumps by {fine}");
        assert!(fine < coarse, "from {coarse} at g = 32 to {fine} at g = 64");
    }
}

/// Lifting a corner of the unit cube changes weights continuously, starting from planar faces. (Splitting bent faces
/// into two triangles makes weights jump by 0.237 at the lift where the split first occurs.)
pub(crate) fn weights_are_continuous_in_the_corners_of_a_cage(back_end: &BackEnd) {
    let flat = cuboid(Vec3::ZERO, Vec3::ONE);
    let points = points::inside(&cage(&flat), 300, 77);
    let bind = |lift: f32| {
        let corner = Vec3::new(1.0, 1.0, 1.0 + lift);
        let mesh = moved(&flat, |p| if p == Vec3::ONE { corner } else { p });
        back_end.bind_with(&points, &cage(&mesh), |o| o.grid = 64).weights
    };
    let lifts = [0.0, 1e-6, 1.39e-5, 1.4e-5, 1e-4, 1e-3, 0.01, 0.05, 0.1, 0.2, 0.3, 1.0 / 3.0];
    let mut before = bind(lifts[0]);
    for lifts in lifts.windows(2) {
        let after = bind(lifts[1]);
        let change = largest_change(&before, &after);
        // The summand 1e-5 allows for rounding and for the solver's error.
        let allowed = 20.0 * (lifts[1] - lifts[0]) + 1e-5;
        assert!(change <= allowed, "from {} to {}: a weight changes by {change}", lifts[0], lifts[1]);
        before = after;
    }
}

/// If the faces of a vertex are small, or a part is thinner than a cell, the bind gives a notice that names a sufficient
/// grid.
pub(crate) fn unresolved_parts_are_reported_with_a_sufficient_grid(back_end: &BackEnd) {
    let fine = cage(&sphere(4));
    let fin = cage(&cuboid(Vec3::ZERO, Vec3::new(1.0, 0.6, 0.55 / 16.0)));
    // The bar is rotated, so that grid lines cross its adjacent sides and not only its opposite sides.
    let turn = RandomGenerator::new(79).rotation();
    let bar = cage(&moved(&cuboid(Vec3::ZERO, Vec3::new(1.0, 0.035, 0.035)), |p| turn * p));
    // The sides of the plate are strips of a quarter of a cell: both strips of a vertex can lie between two lines over their
    // whole length.
    let bounds = Bounds { min: Vec3::ZERO, max: Vec3::new(4.0, 3.0, 0.1) };
    let plate = cage(&subdivided_box(bounds, 0.0, [4, 4, 8]));
    for (cage, grid) in [(fine, 8), (fin, 16), (bar, 16), (plate, 83)] {
        let points = points::inside(&cage, 50, 78);
        let notice = |grid: u32| {
            let report = back_end.bind_with(&points, &cage, |o| (o.grid, o.tau) = (grid, 1e-5)).report;
            report.notices.into_iter().find(|n| n.contains("does not resolve"))
        };
        let first = notice(grid).expect("a notice");
        let words: Vec<&str> = first.split_whitespace().collect();
        let at = words.windows(4).position(|w| w[..4] == ["use", "a", "grid", "of"]).expect("advice");
        let enough: u32 = words[at + 4].parse().expect("a number of cells");
        assert!(enough > grid && notice(enough).is_none(), "{first} Then: {:?}", notice(enough));
    }
    let cube = cage(&cuboid(Vec3::ZERO, Vec3::ONE));
    let report = back_end.bind(&points::inside(&cube, 50, 79), &cube).report;
    assert!(report.notices.is_empty(), "{:?}", report.notices);
}
