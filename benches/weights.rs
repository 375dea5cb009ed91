//! Measures the errors of sampled weights that `docs/method.md` and `docs/notes/sampling.md` state. Prints Markdown.
//!
//! `cargo bench -p cagework-benches --bench weights`

use cagework_cage::generate::{CageOptions, generate};
use cagework_core::bind::bind;
use cagework_core::cage::subdivided_box;
use cagework_core::options::BindOptions;
use cagework_core::progress::NoProgress;
use cagework_core::{Bounds, Cage, PolygonMesh, TriMesh, Weights};
use cagework_tests::cages::{inside_out, moved, prism};
use cagework_tests::creature::{creature, creature_cage};
use cagework_tests::points::{inside, is_inside};
use cagework_tests::{RandomGenerator, dense};
use glam::{DVec3, Vec3};

/// Number of cells along the longest side of the cage, unless stated otherwise.
const GRID: u32 = 64;

/// Depth, as a fraction of the cage's diagonal, of the points right beside a wall.
const DEPTH: f32 = 1.5e-6;

/// Largest distance between two neighbouring points of a line past a re-entrant edge, in cells.
const STEP: f32 = 1.0 / 250.0;

fn main() {
    let cages = [
        ("L-shaped prism", cage(&prism(&L_SHAPE, 1.0))),
        ("creature, by hand", cage(&creature_cage())),
        ("creature, generated", generated()),
    ];
    println!("A bar of 1 x 1 x 4, bent by 90 degrees: largest turn within an eighth of a cell.\n");
    println!("| cells from the wall | degrees |\n|---|---|");
    for cells in [8.0, 2.7, 1.6, 0.53] {
        println!("| {cells} | {:.2} |", largest_turn(cells));
    }
    println!("\nDifference between the weights on a face and {DEPTH:e} diagonals behind it.\n");
    println!("| cage | largest |\n|---|---|");
    for (name, cage) in &cages {
        println!("| {name} | {:.1e} |", beside_walls(cage));
    }
    println!(
        "\nDifference between the weights of a box of 1 x 0.7 x 0.4 and those of the same box, turned.\n"
    );
    println!("| turn | mean | largest |\n|---|---|---|");
    for (name, mean, largest) in turned() {
        println!("| {name} | {mean:.1e} | {largest:.1e} |");
    }
    println!("\nLargest jump between points 1/250 of a cell apart, on 200 lines past re-entrant edges.\n");
    println!("| cage | largest |\n|---|---|");
    for (name, cage) in &cages {
        println!("| {name} | {:.1e} |", largest_jump(cage));
    }
    println!("\nDifference from the weights on a grid of 256 cells, 2,000 points.\n");
    println!("| cage | grid | mean | rows beyond 0.01 | largest |\n|---|---|---|---|---|");
    for (name, cage) in &cages {
        for grid in [0, 64, 128] {
            let points = inside(cage, 2000, 1);
            let [coarse, fine] = [grid, 256].map(|grid| weights(&points, cage, grid));
            let Differences { mean, largest, rows } = differences(&coarse, &fine);
            let grid = if grid == 0 { "auto".to_owned() } else { grid.to_string() };
            let share = 100.0 * rows as f64 / points.len() as f64;
            println!("| {name} | {grid} | {mean:.1e} | {share:.1} % | {largest:.1e} |");
        }
    }
}

/// Outline of a square without a quarter.
const L_SHAPE: [[f32; 2]; 6] = [[0.0, 0.0], [1.0, 0.0], [1.0, 0.5], [0.5, 0.5], [0.5, 1.0], [0.0, 1.0]];

fn cage(mesh: &PolygonMesh) -> Cage {
    Cage::new(mesh).expect("the mesh is a cage")
}

fn generated() -> Cage {
    let TriMesh { positions, triangles, .. } = creature();
    let made = generate(&positions, &triangles, &CageOptions::default(), &NoProgress);
    made.expect("the creature gets a cage").cage
}

/// Weights of the cage's vertices at some points. Points outside the cage have weights of further columns.
fn weights(points: &[Vec3], cage: &Cage, grid: u32) -> Weights {
    let options = BindOptions { grid, ..BindOptions::default() };
    let bound = bind(points, cage, &options, &NoProgress).expect("the cage can be bound");
    bound.weights.columns(0..cage.n_vertices() as u32)
}

struct Differences {
    mean: f64,
    largest: f32,
    /// Number of rows in which a weight differs by more than 0.01.
    rows: usize,
}

fn differences(a: &Weights, b: &Weights) -> Differences {
    let (mut sum, mut largest, mut rows) = (0.0, 0.0f32, 0);
    let [of_a, of_b] = [a, b].map(dense);
    let n = a.n_columns();
    for (a, b) in of_a.chunks(n).zip(of_b.chunks(n)) {
        let apart = a.iter().zip(b).map(|(a, b)| (a - b).abs());
        let of_row = apart.clone().fold(0.0, f32::max);
        sum += apart.map(f64::from).sum::<f64>();
        largest = largest.max(of_row);
        rows += usize::from(of_row > 0.01);
    }
    Differences { mean: sum / of_a.len() as f64, largest, rows }
}

/// Largest turn, in degrees, between steps of an eighth of a cell along a line at `cells` cells from a side of the bar.
fn largest_turn(cells: f32) -> f64 {
    let bounds = Bounds { min: Vec3::ZERO, max: Vec3::new(1.0, 1.0, 4.0) };
    let cage = cage(&subdivided_box(bounds, 0.0, [1, 1, 4]));
    let cell = 4.0 / GRID as f32;
    let (n, fine) = (2560, cell / 64.0);
    let points: Vec<Vec3> = (0..n).map(|k| Vec3::new(0.41, cells * cell, 0.7 + fine * k as f32)).collect();
    let weights = weights(&points, &cage, GRID);
    let radius = 4.0 / std::f64::consts::FRAC_PI_2;
    let pose: Vec<DVec3> = cage
        .positions()
        .iter()
        .map(|p| {
            let p = p.as_dvec3();
            let (sin, cos) = (p.z / radius).sin_cos();
            let height = radius + 0.5 - p.y;
            DVec3::new(p.x, radius - height * cos, height * sin)
        })
        .collect();
    let bent: Vec<DVec3> = dense(&weights)
        .chunks(pose.len())
        .map(|row| row.iter().zip(&pose).map(|(&w, &p)| f64::from(w) * p).sum())
        .collect();
    let turns = bent.windows(17).map(|at| (at[8] - at[0]).angle_between(at[16] - at[8]).to_degrees());
    turns.fold(0.0, f64::max)
}

/// Largest difference between the weights of points on the cage's facets, which are those of the faces' hat functions,
/// and of points right behind them.
fn beside_walls(cage: &Cage) -> f32 {
    let mut random = RandomGenerator::new(3);
    let depth = f64::from(DEPTH * cage.diagonal());
    let mut on = Vec::new();
    let mut behind = Vec::new();
    for facet in 0..cage.facets().len() as u32 {
        let [a, b, c] = cage.facet_corners(facet);
        let normal = (b - a).cross(c - a).normalize_or_zero();
        for _ in 0..8 {
            let (u, v) = (f64::from(random.unit()).sqrt(), f64::from(random.unit()));
            let p = a + u * ((1.0 - v) * (b - a) + v * (c - a));
            on.push(p.as_vec3());
            behind.push((p - depth * normal).as_vec3());
        }
    }
    let [on, behind] = [on, behind].map(|points| weights(&points, cage, GRID));
    differences(&on, &behind).largest
}

/// Turns or mirrors a point.
type Motion = fn(Vec3) -> Vec3;

fn turned() -> Vec<(&'static str, f64, f32)> {
    let bounds = Bounds { min: Vec3::ZERO, max: Vec3::new(1.0, 0.7, 0.4) };
    let mesh = subdivided_box(bounds, 0.0, [3; 3]);
    let rest = cage(&mesh);
    let points = inside(&rest, 1500, 1);
    let at_rest = weights(&points, &rest, GRID);
    let moves: [(&str, Motion); 4] = [
        ("90 degrees about x", |p| Vec3::new(p.x, -p.z, p.y)),
        ("90 degrees about y", |p| Vec3::new(p.z, p.y, -p.x)),
        ("90 degrees about z", |p| Vec3::new(-p.y, p.x, p.z)),
        ("mirrored in x", |p| Vec3::new(-p.x, p.y, p.z)),
    ];
    let measure = |(name, to): (&'static str, Motion)| {
        let moved_mesh = moved(&mesh, to);
        let is_mirrored = name.starts_with("mirrored");
        let moved_mesh = if is_mirrored { inside_out(&moved_mesh) } else { moved_mesh };
        let points: Vec<Vec3> = points.iter().map(|&p| to(p)).collect();
        let of_moved = weights(&points, &cage(&moved_mesh), GRID);
        let Differences { mean, largest, .. } = differences(&at_rest, &of_moved);
        (name, mean, largest)
    };
    moves.into_iter().map(measure).collect()
}

/// Largest change of a weight between neighbouring points of short random lines that pass edges at which the cage turns
/// inwards.
fn largest_jump(cage: &Cage) -> f32 {
    let mut random = RandomGenerator::new(5);
    let cell = cage.bounds().extent().max_element() / GRID as f32;
    let edges = re_entrant_edges(cage);
    if edges.is_empty() {
        return 0.0;
    }
    let n = 1000;
    let mut points = Vec::new();
    for line in 0..200 {
        let [a, b] = edges[line % edges.len()];
        let middle = a.lerp(b, random.unit().into()).as_vec3();
        let from = middle + cell * random.point(Vec3::splat(-1.0), Vec3::ONE);
        let way = random.point(Vec3::splat(-1.0), Vec3::ONE).normalize_or(Vec3::X);
        points.extend((0..n).map(|k| from + (k as f32 - 0.5 * n as f32) * STEP * cell * way));
    }
    let weights = weights(&points, cage, GRID);
    let weights = dense(&weights);
    let rows: Vec<&[f32]> = weights.chunks(cage.n_vertices()).collect();
    let mut largest = 0.0f32;
    for (points, rows) in points.chunks(n).zip(rows.chunks(n)) {
        let is_inside: Vec<bool> = points.iter().map(|&p| is_inside(cage, p)).collect();
        let inside = rows.windows(2).enumerate().filter(|&(k, _)| is_inside[k] && is_inside[k + 1]);
        for (_, pair) in inside {
            largest = pair[0].iter().zip(pair[1]).map(|(a, b)| (a - b).abs()).fold(largest, f32::max);
        }
    }
    largest
}

/// Ends of the edges at which the cage turns inwards by more than 14 degrees.
fn re_entrant_edges(cage: &Cage) -> Vec<[DVec3; 2]> {
    let mut sides = std::collections::BTreeMap::new();
    for (number, facet) in cage.facets().iter().enumerate() {
        for k in 0..3 {
            sides.insert((facet[k], facet[(k + 1) % 3]), (number as u32, facet[(k + 2) % 3]));
        }
    }
    let points = cage.facet_points();
    let edges = sides.iter().filter_map(|(&(a, b), &(facet, _))| {
        let &(_, opposite) = sides.get(&(b, a)).filter(|_| a < b)?;
        let [p, q, r] = cage.facet_corners(facet);
        let normal = (q - p).cross(r - p).normalize_or_zero();
        let [start, end, tip] = [a, b, opposite].map(|i| points[i as usize]);
        let off = (tip - start).reject_from((end - start).normalize_or(DVec3::X)).normalize_or_zero();
        (off.dot(normal) > 0.25).then_some([start, end])
    });
    edges.collect()
}
