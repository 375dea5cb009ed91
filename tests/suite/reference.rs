//! A non-convex cage, compared with weights computed without a grid: quadratic finite elements, and Walk on Spheres.
//!
//! Source of the numbers: `tests/data/README.md`.

use cagework_core::options::BindOptions;
use cagework_core::{Cage, PolygonMesh};
use cagework_tests::cages::cage;
use cagework_tests::dense;
use glam::Vec3;

use super::BackEnd;

/// Number of points, from the first one, whose weights have also been computed by Walk on Spheres.
const N_WALK_VERTICES: usize = 100;

/// Largest allowed mean error of a weight at g = 64, 1.5 times the measured 6.9e-5. With the weights of the nearest
/// cell centre instead of interpolated weights, the mean error is 3.3e-4.
const LIMIT_AT_64: f64 = 1.05e-4;

/// Largest allowed mean error of a weight at g = 128, 1.6 times the measured 2.3e-5. The mean error of the finite
/// elements themselves is 1.3e-5.
const LIMIT_AT_128: f64 = 3.6e-5;

/// Array of a NumPy file in `tests/data/armadillo`, as little-endian 32-bit words.
macro_rules! npy {
    ($name:literal) => {
        words(include_bytes!(concat!("../data/armadillo/", $name, ".npy")))
    };
}

/// Splits the data after the header, whose length is in bytes 8 and 9, into words.
fn words(npy: &[u8]) -> impl Iterator<Item = [u8; 4]> {
    let header = usize::from(u16::from_le_bytes([npy[8], npy[9]]));
    npy[10 + header..].chunks_exact(4).map(|word| word.try_into().expect("four bytes"))
}

fn points(words: impl Iterator<Item = [u8; 4]>) -> Vec<Vec3> {
    let values: Vec<f32> = words.map(f32::from_le_bytes).collect();
    values.chunks_exact(3).map(Vec3::from_slice).collect()
}

/// Computes the mean of |a - b|.
fn mean_difference(a: &[f32], b: impl Iterator<Item = [u8; 4]>) -> f64 {
    let b: Vec<f32> = b.map(f32::from_le_bytes).collect();
    assert_eq!(a.len(), b.len());
    a.iter().zip(&b).map(|(a, b)| f64::from((a - b).abs())).sum::<f64>() / a.len() as f64
}

pub(crate) fn armadillo_is_exact_at_64(back_end: &BackEnd) {
    mean_error_is_below(LIMIT_AT_64, back_end, 64);
}

pub(crate) fn armadillo_is_exact_at_128(back_end: &BackEnd) {
    mean_error_is_below(LIMIT_AT_128, back_end, 128);
}

/// Reads the cage of the Armadillo from `tests/data/armadillo`.
pub(crate) fn armadillo_cage() -> Cage {
    let corners: Vec<u32> = npy!("cage_triangles").map(u32::from_le_bytes).collect();
    let faces = corners.chunks_exact(3).map(<[u32]>::to_vec).collect();
    cage(&PolygonMesh { positions: points(npy!("cage_positions")), faces })
}

fn mean_error_is_below(limit: f64, back_end: &BackEnd, grid: u32) {
    let cage = armadillo_cage();
    // The default tau, as for users.
    let tau = BindOptions::default().tau;
    let binding = back_end.bind_with(&points(npy!("points")), &cage, |o| (o.grid, o.tau) = (grid, tau));
    assert_eq!(binding.report.outside_vertices, 0);
    let weights = dense(&binding.weights);
    let error = mean_difference(&weights, npy!("weights_fem"));
    assert!(error <= limit, "mean difference from finite elements is {error:e}, more than {limit:e}");
    // Walk on Spheres is independent of the finite elements. Its own mean error is at most one standard error.
    let walked = &weights[..N_WALK_VERTICES * cage.n_vertices()];
    let noise = mean_difference(&vec![0.0; walked.len()], npy!("stderr_wos"));
    let (error, limit) = (mean_difference(walked, npy!("weights_wos")), limit + noise);
    assert!(error <= limit, "mean difference from Walk on Spheres is {error:e}, more than {limit:e}");
}
