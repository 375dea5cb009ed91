use glam::{DVec3, Vec3};

use crate::Cage;
use crate::bind::pipeline::{FieldStorage, PreparedBind};
use crate::bind::{Watch, bind};
use crate::cage::shapes::prism;
use crate::cage::subdivided_box;
use crate::mesh::{Bounds, PolygonMesh};
use crate::options::BindOptions;
use crate::progress::NoProgress;

fn cube() -> Cage {
    Cage::new(&subdivided_box(Bounds { min: Vec3::ZERO, max: Vec3::ONE }, 0.0, [3; 3])).unwrap()
}

/// The uniform quadratic B-spline has the variance 1/4 wherever it is evaluated; trilinear interpolation has t (1 - t) at
/// the fraction t between two centres.
#[test]
fn away_from_walls_the_second_moment_of_a_stencil_is_that_of_the_quadratic_b_spline() {
    let (cage, options) = (cube(), BindOptions { grid: 16, ..BindOptions::default() });
    let points: Vec<Vec3> = (0..20).map(|k| Vec3::new(0.3 + 0.02 * k as f32, 0.45, 0.53)).collect();
    let watch = Watch::new(&NoProgress);
    let prepared = PreparedBind::new(&points, (&cage).into(), &options, FieldStorage::Host, &watch).unwrap();
    let level = &prepared.hierarchy().levels[0];
    let cell_of = |row: u32| level.row_of.iter().position(|&r| r == row).expect("a row of the field");
    for (p, (nodes, hats)) in points.iter().zip(prepared.stencils().iter()) {
        let p = level.grid.to_grid(p.as_dvec3());
        let [mut mean, mut variance] = [DVec3::ZERO; 2];
        for &(row, weight) in nodes {
            let apart = DVec3::from_array(level.grid.cell(cell_of(row)).map(f64::from)) - p;
            mean += f64::from(weight) * apart;
            variance += f64::from(weight) * apart * apart;
        }
        assert!(hats.is_empty() && mean.length() < 1e-6, "{p}: {mean}");
        assert!((variance - 0.25).abs().max_element() < 1e-6, "{p}: {variance}");
    }
}

/// Bending a bar by 90 degrees turns its middle line by 90/32 degrees per cell at g = 32. The turn should be spread over
/// the cell: within an eighth of a cell, at most twice an eighth of it. With trilinear interpolation the whole turn is at
/// cell faces.
#[test]
fn a_bent_bar_has_no_kinks_at_cell_faces() {
    let bounds = Bounds { min: Vec3::ZERO, max: Vec3::new(1.0, 1.0, 4.0) };
    let cage = Cage::new(&subdivided_box(bounds, 0.0, [1, 1, 4])).unwrap();
    let step = 1.0 / 64.0;
    let points: Vec<Vec3> = (0..160).map(|k| Vec3::new(0.37, 0.5, 0.8 + step * k as f32)).collect();
    let options = BindOptions { grid: 32, ..BindOptions::default() };
    let weights = bind(&points, &cage, &options, &NoProgress).unwrap().weights;
    let radius = 4.0 / std::f64::consts::FRAC_PI_2;
    let mut bent = vec![DVec3::ZERO; points.len()];
    for (column, p) in cage.positions().iter().enumerate() {
        let (p, height) = (p.as_dvec3(), radius - (f64::from(p.y) - 0.5));
        let (sin, cos) = (p.z / radius).sin_cos();
        let p = DVec3::new(p.x, radius - height * cos, height * sin);
        for (at, w) in bent.iter_mut().zip(weights.column(column as u32)) {
            *at += f64::from(w) * p;
        }
    }
    let turns = bent.windows(3).map(|at| (at[1] - at[0]).angle_between(at[2] - at[1]).to_degrees());
    let (largest, even) = (turns.fold(0.0, f64::max), 90.0 / 32.0 / 8.0);
    assert!(largest < 2.0 * even, "a turn of {largest} degrees, {even} if spread evenly");
}

/// Beside a face, weights tend to the face's hat functions, which are bilinear on squares, also across the edges of faces.
#[test]
fn beside_a_wall_weights_are_those_of_the_wall() {
    let cage = cube();
    let options = BindOptions { grid: 16, ..BindOptions::default() };
    let depth = 3e-6;
    for axis in 0..3 {
        // Up to a quarter of a cell from the edge between two squares, at a third of the side.
        let points: Vec<Vec3> = (0..40)
            .map(|k| {
                let mut p = Vec3::splat(depth);
                p[(axis + 1) % 3] = 1.0 / 3.0 + (k as f32 - 20.0) / 20.0 / 64.0;
                p[(axis + 2) % 3] = 0.41;
                p
            })
            .collect();
        let weights = bind(&points, &cage, &options, &NoProgress).unwrap().weights;
        let worst = (0..cage.n_vertices())
            .flat_map(|column| {
                let corner = cage.positions()[column];
                let hat = move |p: &Vec3| {
                    let linear = |a: usize| (1.0 - 3.0 * (p[a] - corner[a]).abs()).max(0.0);
                    let on_wall = if corner[axis] == 0.0 { 1.0 } else { 0.0 };
                    on_wall * linear((axis + 1) % 3) * linear((axis + 2) % 3)
                };
                let column = weights.column(column as u32);
                points.iter().zip(column).map(|(p, w)| (w - hat(p)).abs()).collect::<Vec<_>>()
            })
            .fold(0.0, f32::max);
        assert!(worst < 2e-4, "axis {axis}: {worst}");
    }
}

/// A cage that is turned by 90 degrees or mirrored has the same weights. The grid differs only by its small offset.
#[test]
fn turned_and_mirrored_cages_have_the_same_weights() {
    let bounds = Bounds { min: Vec3::ZERO, max: Vec3::new(1.0, 0.7, 0.4) };
    let mesh = subdivided_box(bounds, 0.0, [3; 3]);
    let at = |k: u32, factor: f32| (k as f32 * factor).fract();
    let points: Vec<Vec3> = (1..400)
        .map(|k| bounds.extent() * Vec3::new(at(k, 0.618_034), at(k, 0.754_878), at(k, 0.569_84)))
        .collect();
    let options = BindOptions { grid: 16, ..BindOptions::default() };
    let weights = |to: fn(Vec3) -> Vec3| {
        let mut moved =
            PolygonMesh { positions: mesh.positions.iter().map(|&p| to(p)).collect(), ..mesh.clone() };
        if to(Vec3::X).cross(to(Vec3::Y)).dot(to(Vec3::Z)) < 0.0 {
            moved.faces.iter_mut().for_each(|face| face.reverse());
        }
        let points: Vec<Vec3> = points.iter().map(|&p| to(p)).collect();
        bind(&points, &Cage::new(&moved).unwrap(), &options, &NoProgress).unwrap().weights
    };
    let at_rest = weights(|p| p);
    // 4.1e-4 and 2.7e-4 about x and z with a grid anchored at the lowest corner.
    let limit = 4e-5;
    let check = |name: &str, to: fn(Vec3) -> Vec3| {
        let moved = weights(to);
        let n = at_rest.n_columns() as u32;
        let differences = (0..n).flat_map(|c| {
            at_rest.column(c).zip(moved.column(c)).map(|(a, b)| (a - b).abs()).collect::<Vec<_>>()
        });
        let mean = differences.sum::<f32>() / (points.len() * n as usize) as f32;
        assert!(mean < limit, "{name}: {mean}");
    };
    check("about x", |p| Vec3::new(p.x, -p.z, p.y));
    check("about y", |p| Vec3::new(p.z, p.y, -p.x));
    check("about z", |p| Vec3::new(-p.y, p.x, p.z));
    check("mirrored", |p| Vec3::new(-p.x, p.y, p.z));
}

/// Beside the facets of a bent face, rows are right before they are corrected: the correction of a row whose weights lie
/// nearly in a plane multiplies errors.
#[test]
fn beside_bent_faces_weights_stay_between_0_and_1() {
    let mut mesh = subdivided_box(Bounds { min: Vec3::ZERO, max: Vec3::ONE }, 0.0, [1; 3]);
    mesh.positions[7] += Vec3::new(0.06, 0.09, 0.07);
    let cage = Cage::new(&mesh).unwrap();
    let depth = 1.5e-6 * f64::from(cage.diagonal());
    let points: Vec<Vec3> = (0..cage.facets().len() as u32)
        .flat_map(|facet| {
            let [a, b, c] = cage.facet_corners(facet);
            let inwards = depth * (c - a).cross(b - a).normalize();
            [[0.6, 0.3, 0.1], [0.2, 0.5, 0.3]].map(|[u, v, w]| (u * a + v * b + w * c + inwards).as_vec3())
        })
        .collect();
    let options = BindOptions { grid: 16, ..BindOptions::default() };
    let bound = bind(&points, &cage, &options, &NoProgress).unwrap();
    let raw = bound.report.raw_error.unwrap().point_rel.max;
    assert!(raw < 1e-6, "rows miss their points by {raw} diagonals");
    let stats = bound.report.weights;
    assert!(stats.min >= -1e-6 && stats.max <= 1.0 + 1e-6, "{} to {}", stats.min, stats.max);
}

/// Beside a re-entrant edge, weights do not hang on the sign of a rounding error of the faces' normals.
#[test]
fn weights_beside_a_re_entrant_edge_do_not_jump_when_it_tilts() {
    let outline = [[0.0, 0.0], [1.0, 0.0], [1.0, 0.5], [0.5, 0.5], [0.5, 1.0], [0.0, 1.0]];
    let mesh = prism(&outline, 1.0);
    let point = [Vec3::new(0.495_441_1, 0.499_899_1, 0.990_361)];
    let options = BindOptions { grid: 64, ..BindOptions::default() };
    let weight = |tilt: f32| {
        let mut mesh = mesh.clone();
        mesh.positions[3] += tilt * Vec3::new(1.0, 0.3, 0.2);
        bind(&point, &Cage::new(&mesh).unwrap(), &options, &NoProgress)
            .unwrap()
            .weights
            .column(9)
            .next()
            .unwrap()
    };
    for tilt in [1e-6, -1e-6] {
        let [upright, tilted] = [0.0, tilt].map(weight);
        assert!((upright - tilted).abs() < 1e-4, "{tilt}: {upright} and {tilted}");
    }
}
