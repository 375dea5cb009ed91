//! Bends a capture of Gaussian splats by its generated cage. Prints the errors of interpolating the deformation in a
//! lattice, compared with weights bound for each splat at g = 128 (the table of docs/splats.md), and times for a
//! million splats.
//!
//! `cargo run --release -p cagework-benches --example splats -- CAPTURE [THREADS]`

use std::time::Instant;

use cagework_cage::CageOptions;
use cagework_cage::generate::generate;
use cagework_core::bind::SolvedCage;
use cagework_core::deform::deform_bound;
use cagework_core::field::{CELLS, Field, FieldWeights};
use cagework_core::options::BindOptions;
use cagework_core::progress::NoProgress;
use cagework_core::splats::{SortedSplats, SplatPose, Splats, deform_splats};
use cagework_core::team::Team;
use cagework_core::{Bounds, Cage};
use cagework_io::{Model, ModelFormat};
use cagework_tests::random::RandomGenerator;
use glam::{DVec3, Mat3, Vec3};

/// Number of cells of the solver's grid along the cage's longest side. Splats and lattice nodes are bound on the same
/// grid, so that their difference is the error of interpolation in the lattice.
const FINE_GRID: u32 = 128;
/// Number of splats that are bound at a time.
const RUN: usize = 10_000;
/// Number of points that are bound for each splat: its centre, both ends of its longest axis, and a pair along each
/// coordinate axis for the differences that give the deformation gradient F.
const POINTS: usize = 9;
/// Distance of the points of a pair from the centre, as a fraction of the diagonal of the splats' bounds.
const STEP: f32 = 0.002;

fn main() {
    let path = std::env::args().nth(1).expect("give a file of splats");
    let threads = std::env::args().nth(2).map_or(0, |n| n.parse().expect("the number of threads"));
    let bytes = std::fs::read(&path).expect("the file can be read");
    let model = Model::read(&path, &bytes, &mut |_| None).expect("the file is a model");
    let splats = model.splats().expect("the file has splats");
    let (positions, triangles) = model.states(None).expect("no clip was given");
    let made = generate(&positions, &triangles, &CageOptions::default(), &NoProgress).expect("it has a cage");
    let cage = &made.cage;
    println!("{} splats, {}-vertex cage", splats.len(), cage.n_vertices());
    let options = BindOptions { threads, ..BindOptions::default() };
    let weights = FieldWeights::bind(cage, CELLS, &options, &NoProgress).expect("the cage can be bound");
    let fine = BindOptions { grid: FINE_GRID, ..options };
    errors(
        splats,
        cage,
        &FieldWeights::bind(cage, CELLS, &fine, &NoProgress).expect("the cage can be bound"),
    );
    times(splats, cage, &weights, &Team::new(threads));
}

/// Makes three test poses, each with its name and the posed positions of the cage's vertices. `diagonal`: length that
/// displacements are relative to.
fn poses(cage: &Cage, diagonal: f32) -> [(&'static str, Vec<Vec3>); 3] {
    let rest = cage.positions();
    let bounds = cage.bounds();
    let per_height = (2.0 * std::f32::consts::PI / 3.0) / bounds.extent().y;
    let mean = rest.iter().map(|p| p.x).sum::<f32>() / rest.len() as f32;
    let radius = per_height.recip();
    let bend = |p: &Vec3| {
        let (sin, cos) = ((p.y - bounds.min.y) * per_height).sin_cos();
        let x = radius - (p.x - mean);
        Vec3::new(radius - x * cos, x * sin, p.z)
    };
    let lowest = (0..rest.len()).min_by(|&a, &b| rest[a].y.total_cmp(&rest[b].y)).unwrap_or_default();
    let mut pulled = rest.to_vec();
    pulled[lowest].x += 0.3 * diagonal;
    let mut random = RandomGenerator::new(0);
    // The sum of twelve uniform numbers is nearly normal, with variance 1.
    let mut normal = || (0..12).map(|_| random.unit()).sum::<f32>() - 6.0;
    let noise = rest.iter().map(|&p| p + 0.03 * diagonal * Vec3::new(normal(), normal(), normal())).collect();
    [("bend 120", rest.iter().map(bend).collect()), ("one vertex 0.3", pulled), ("noise 3 %", noise)]
}

/// For each splat: position error relative to the diagonal, relative error of the deformation gradient F, and error of
/// F's first-order prediction at the end of the longest axis, relative to its half length.
type Errors = [Vec<f32>; 3];

fn errors(splats: &Splats, cage: &Cage, weights: &FieldWeights) {
    let diagonal = Bounds::around(&splats.positions).map_or(1.0, |bounds| bounds.diagonal());
    let poses = poses(cage, diagonal);
    let fields = poses.each_ref().map(|(_, posed)| weights.pose(cage.positions(), posed));
    let options = BindOptions { grid: FINE_GRID, ..BindOptions::default() };
    let solved = SolvedCage::new(cage, &options, &NoProgress).expect("the cage can be solved");
    let mut all: [Errors; 3] = Default::default();
    for first in (0..splats.len()).step_by(RUN) {
        let run = first..splats.len().min(first + RUN);
        let points: Vec<Vec3> = run.clone().flat_map(|s| points_of(splats, s, STEP * diagonal)).collect();
        let binding = solved.bind(&points, 0, 0, &NoProgress).expect("the splats can be bound");
        for ((_, posed), (field, errors)) in poses.iter().zip(fields.iter().zip(&mut all)) {
            let moved = deform_bound(&binding.weights, &binding.frames, posed);
            for (splat, moved) in run.clone().zip(moved.chunks_exact(POINTS)) {
                add(errors, (splats, splat), moved, field, diagonal);
            }
        }
    }
    println!(
        "pose; position error / diagonal: median, maximum; F, relative: 99 %; first order at the axis end: median, 99 %; above 10 %"
    );
    for ((name, _), [position, gradient, first_order]) in poses.iter().zip(&mut all) {
        let above = first_order.iter().filter(|&&e| e > 0.1).count() as f32 / first_order.len() as f32;
        println!(
            "{name}: {:.1e}, {:.1e}; {:.2} %; {:.2} %, {:.2} %; {:.3} %",
            quantile(position, 0.5),
            quantile(position, 1.0),
            100.0 * quantile(gradient, 0.99),
            100.0 * quantile(first_order, 0.5),
            100.0 * quantile(first_order, 0.99),
            100.0 * above
        );
    }
}

/// Returns the vector from a splat's centre along its longest axis, sqrt(3) standard deviations long.
fn half_axis(splats: &Splats, splat: usize) -> Vec3 {
    let axes = splats.axes(splat).to_cols_array_2d().map(Vec3::from_array);
    let longest = axes.into_iter().max_by(|a, b| a.length_squared().total_cmp(&b.length_squared()));
    3.0_f32.sqrt() * longest.unwrap_or_default()
}

fn points_of(splats: &Splats, splat: usize, step: f32) -> [Vec3; POINTS] {
    let (center, half) = (splats.positions[splat], half_axis(splats, splat));
    let [x, y, z] = Vec3::AXES.map(|axis| step * axis);
    [Vec3::ZERO, half, -half, x, -x, y, -y, z, -z].map(|by| center + by)
}

fn add(errors: &mut Errors, (splats, splat): (&Splats, usize), moved: &[Vec3], field: &Field, diagonal: f32) {
    let column = |k: usize| (moved[3 + 2 * k] - moved[4 + 2 * k]) / (2.0 * STEP * diagonal);
    let exact = Mat3::from_cols(column(0), column(1), column(2));
    let size = |m: Mat3| m.to_cols_array().iter().map(|x| x * x).sum::<f32>().sqrt();
    let center = splats.positions[splat];
    errors[0].push(field.map(center).distance(moved[0]) / diagonal);
    errors[1].push(size(field.gradient(center) - exact) / size(exact));
    let half = half_axis(splats, splat);
    errors[2].push(moved[1].distance(moved[0] + exact * half) / half.length().max(f32::MIN_POSITIVE));
}

fn quantile(numbers: &mut [f32], share: f64) -> f32 {
    let rank = (share * (numbers.len() - 1) as f64).round() as usize;
    *numbers.select_nth_unstable_by(rank, f32::total_cmp).1
}

/// Prints times for a million splats, which are copies of the capture's splats with small random offsets.
fn times(capture: &Splats, cage: &Cage, weights: &FieldWeights, team: &Team) {
    const N: usize = 1_000_000;
    let mut random = RandomGenerator::new(1);
    let mut splats = Splats::default();
    for k in 0..N {
        let from = k % capture.len();
        let offset =
            Vec3::new(random.unit(), random.unit(), random.unit()) * capture.scales[from].max_element();
        splats.positions.push(capture.positions[from] + offset);
        splats.scales.push(capture.scales[from]);
        splats.rotations.push(capture.rotations[from]);
        splats.opacities.push(capture.opacities[from]);
        splats.colors.push(capture.colors[from]);
    }
    let [(_, posed), ..] = poses(cage, cage.diagonal());
    let timed = |what: &str, runs: usize, work: &mut dyn FnMut()| {
        let mut times: Vec<f64> = (0..runs)
            .map(|_| {
                let started = Instant::now();
                work();
                started.elapsed().as_secs_f64() * 1e3
            })
            .collect();
        times.sort_by(f64::total_cmp);
        println!("{what}: {:.1} ms (fastest of {runs}; median {:.1})", times[0], times[runs / 2]);
    };
    println!("a million splats, {} threads", team.n_threads());
    let mut field = weights.pose(cage.positions(), &posed);
    timed("field of a pose", 10, &mut || field = weights.pose(cage.positions(), &posed));
    let mut sorted = SortedSplats::default();
    timed("sort by cell", 3, &mut || sorted = SortedSplats::new(&splats, &field.lattice));
    let mut pose = SplatPose::default();
    timed("pose, sorted", 20, &mut || deform_splats(&sorted, &field, team, &mut pose));
    let unsorted = splats.rest_pose();
    timed("pose, unsorted", 3, &mut || {
        for (splat, (to, covariance)) in pose.positions.iter_mut().zip(&mut pose.covariances).enumerate() {
            let p = unsorted.positions[splat];
            *to = field.map(p);
            *covariance = cagework_core::splats::splat_covariance(field.gradient(p) * splats.axes(splat));
        }
    });
    for format in [ModelFormat::Ply, ModelFormat::Splat, ModelFormat::Spz, ModelFormat::Gltf] {
        let model = Model::of_splats("a", splats.clone(), DVec3::ZERO).expect("the splats are valid");
        let bytes = model.write_in_field(format, &field).expect("the splats can be written");
        let name = format!("a.{}", format.export_extension());
        let read = || Model::read(&name, &bytes, &mut |_| None).expect("it was written");
        timed(
            &format!("read .{}, {} MB", format.export_extension(), bytes.len() / 1_000_000),
            3,
            &mut || {
                let _ = read();
            },
        );
        let model = read();
        timed(&format!("deform and write .{}", format.export_extension()), 3, &mut || {
            let _ = model.write_in_field(format, &field);
        });
    }
    timed("cage", 3, &mut || {
        let (positions, triangles) = splats.shells();
        let _ = generate(&positions, &triangles, &CageOptions::default(), &NoProgress);
    });
}
