use glam::{DVec3, Vec3};

use crate::Cage;
use crate::bind::pipeline::{FieldStorage, PreparedBind};
use crate::bind::{Watch, bind};
use crate::cage::subdivided_box;
use crate::mesh::Bounds;
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
